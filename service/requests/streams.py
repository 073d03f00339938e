"""Define the requests of streams: their declaration, and wrenches that are asked or published."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from hand_models.base import Name
from planner import Limits, Load, LostTile
from service.requests.request import Detail, Query, Request, Wrench
from service.requests.stance import StanceMessage

__all__ = ["LostTiles", "SetPointsRequest", "StreamRequest", "WrenchRequest"]

Radius = Annotated[
    float,
    Meta(
        gt=0.0,
        le=1e4,
        description="of an interpolation, along a force; along a moment a tenth, per metre [N]",
    ),
]
NeededWrench = Annotated[Wrench, Meta(description="that the rock must exert on the robot, in B")]
LostTiles = Annotated[list[LostTile], Meta(max_length=1000, description="tiles that have slipped")]


class StreamRequest(Query, frozen=True, kw_only=True):
    """Request that declares a stance as a stream, for set-points of many body wrenches.

    All wrists of the stance must be fixed or compliant.

    - ``stance``: poses of body and hands, and their holds.
    - ``body_wrench``: centre of the first interpolation, in B [N, N·m]; give it or ``load``, not
      both.
    - ``load``: mass, acceleration and payloads from which the body wrench follows; by default the
      robot's weight at rest.
    - ``limits``: the cap on the utilisation, and the caller's own limits.
    - ``radius``: distance from the centre within which set-points are interpolated between plans
      [N]; along a moment a tenth of it per metre [N·m]. Without meaning for compliant wrists, whose
      set-points are solved one by one.
    - ``lost``: tiles that have slipped before; fixed wrists only.
    """

    stance: StanceMessage
    body_wrench: Annotated[Wrench | None, Meta(description="the first centre, in B; or load")] = (
        None
    )
    load: Load | None = None
    limits: Limits = Limits()
    radius: Radius = 30.0
    lost: LostTiles = []


class SetPointsRequest(Query, frozen=True, kw_only=True):
    """Request for the set-points of one body wrench, from a declared stream.

    - ``stream``: identifier in the reply to the stream's declaration.
    - ``body_wrench``: wrench that the rock must exert on the robot, in B [N, N·m].
    - ``detail``: ``set_points`` leaves out torques, currents and wrenches; ``hands`` and ``full``
      are the same.
    - ``lost``: all tiles that have slipped, besides those of the declaration: the set-points do
      without them. Fixed wrists only.
    """

    stream: Annotated[Name, Meta(description="as the reply to its declaration names it")]
    body_wrench: NeededWrench
    detail: Detail | None = None
    lost: LostTiles = []


class WrenchRequest(Request, frozen=True, kw_only=True):
    """Body wrench that a client publishes on a stream, to be answered by published set-points.

    - ``number``: number of the wrench, by which its set-points are known; counted by the client.
    - ``time``: time of the wrench on the client's clock [s]; repeated with the set-points.
    - ``body_wrench``, ``detail``, ``lost``: as of a request for set-points.
    """

    number: Annotated[int, Meta(ge=0, le=2**63 - 1, description="by the client, upwards")]
    time: Annotated[float, Meta(description="on the client's clock [s]")]
    body_wrench: NeededWrench
    detail: Detail | None = None
    lost: LostTiles = []

    def asked(self, stream: str) -> SetPointsRequest:
        """Return the wrench as a request for set-points of a stream."""
        return SetPointsRequest(
            v=1,
            stream=stream,
            body_wrench=self.body_wrench,
            detail=self.detail,
            lost=self.lost,
        )
