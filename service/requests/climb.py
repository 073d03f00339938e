"""Define the request for a climb that is searched for on a rock, and the one that cancels it."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from hand_models.base import Coordinate, InvalidFieldError, Name, Position, Strict
from hand_models.hand import Grasp, WristTravel
from planner import MOVING_WRIST_OBJECTIVES, BodyGrid, Limits, PlaceGrid
from service.requests.holds import MeshMessage, SurfaceMessage
from service.requests.questions import ObjectiveName
from service.requests.request import (
    LONGEST_DEADLINE,
    Identifier,
    InParts,
    PoseMessage,
    Query,
    Request,
)
from service.requests.stance import HandEntries

__all__ = ["CancelRequest", "ClimbEnd", "ClimbRequest", "EndHand"]

WallName = Annotated[str, Meta(max_length=64, pattern="^[a-z-]+(:[0-9]{1,9})?$")]
Enough = Annotated[float, Meta(gt=0.0, le=1e3, description="load factor that is enough")]
SearchTime = Annotated[float, Meta(gt=0.0, le=LONGEST_DEADLINE, description="of the search [s]")]


class EndHand(Strict, frozen=True, kw_only=True):
    """Hand of a stance in which a climb begins or ends, on the climb's rock.

    - ``limb``: name of the limb that carries the hand.
    - ``pose``: pose of H in W.
    - ``grasp``: how the hand closes.
    """

    limb: Name
    pose: Annotated[PoseMessage, Meta(description="of H in W")]
    grasp: Grasp = Grasp()


class ClimbEnd(Strict, frozen=True, kw_only=True):
    """End of a climb, its start or its goal, with all hands on the rock; one of three ways.

    - ``near``: point of W within ``radius`` of which the body's origin is [m].
    - ``radius``: distance from ``near``; 0.3 m by default [m].
    - ``height``: z of the body's origin in W, at most where a climb begins, at least where it ends
      [m].
    - ``body``, ``hands``: a stance: pose of B in W, and a hand of every limb.
    """

    near: Annotated[Position | None, Meta(description="in W [m]")] = None
    radius: Annotated[float, Meta(gt=0.0, le=100.0, description="about near [m]")] = 0.3
    height: Annotated[Coordinate | None, Meta(description="z of the body's origin in W [m]")] = None
    body: Annotated[PoseMessage | None, Meta(description="of B in W")] = None
    hands: Annotated[list[EndHand], Meta(max_length=16, description="one of every limb")] = []

    def __post_init__(self) -> None:
        stance = self.body is not None or self.hands
        given = [
            name
            for name, there in (
                ("near", self.near is not None),
                ("height", self.height is not None),
                ("body", stance),
            )
            if there
        ]
        if len(given) != 1:
            said = " and ".join(given) if given else "none"
            raise InvalidFieldError(
                f"give one of near, height, or body and hands; got {said}",
                field=given[-1] if given else "near",
            )
        if stance and (self.body is None or not self.hands):
            missing = "hands" if self.body is not None else "body"
            raise InvalidFieldError(
                "missing; a stance has a body and a hand of every limb", field=missing
            )


class ClimbRequest(Query, frozen=True, kw_only=True):
    """Request for the best climb on a rock from one place to another, with a bound of every other.

    - ``name``: name of the climb, and of the route that is found.
    - ``robot``: name of the robot; by default the one that is served.
    - ``hand``: numbers of the hand that replace the service's, by section and entry of
      ``hand.toml``.
    - ``rock``: mesh with the pose of its frame in W; or the name of a generated wall, with a seed
      if wanted: ``leaning-wall``, ``leaning-wall:3``.
    - ``surface``: name of a bundled surface, or numbers of a surface of the caller's own.
    - ``start``, ``goal``: where the climb begins and ends.
    - ``places``, ``bodies``: grids on which hands are tried and the body may be.
    - ``limits``, ``objective``: of every stage, as in a plan's request.
    - ``wrist``: ``compliant``: the stages of the climb that is found are planned with wrists that
      give, too. Search, moves and bound are about fixed wrists.
    - ``wrist_travel``: range in which compliant wrists may come to rest.
    - ``best_within``: the search ends when no other climb can have a least load factor that is
      larger by more than this part.
    - ``at_least``: the search ends with the first climb that has this load factor in all stages, or
      when it is proven that there is none.
    - ``time``: time of the search, after which the best climb so far is the answer [s]; by default
      until the deadline.
    - ``refine``: how often places and poses are added about the weakest stage, and the climb is
      searched for again, until it is as good as was asked for. Each search has an equal part of the
      time; the best climb is the answer, and its bound is about its own placements and poses.
    - ``want``: names of further results: ``trajectory``, the knots of the climb; ``certificate``,
      the file that proves the bound.
    - ``parts``: over zenoh, replies of their own say how far the search is, and knots come move by
      move.
    """

    name: Identifier = "climb"
    robot: Name | None = None
    hand: HandEntries | None = None
    rock: Annotated[
        MeshMessage | WallName,
        Meta(description="mesh, with its frame's pose in W; or name of a generated wall"),
    ]
    surface: Annotated[Name | SurfaceMessage, Meta(description="a preset's name, or numbers")] = (
        "rock"
    )
    start: ClimbEnd
    goal: ClimbEnd
    places: Annotated[PlaceGrid, Meta(description="where hands are tried")] = field(
        default_factory=PlaceGrid
    )
    bodies: Annotated[BodyGrid, Meta(description="where the body may be")] = field(
        default_factory=BodyGrid
    )
    limits: Limits = Limits()
    objective: ObjectiveName = "max_margin"
    wrist: Annotated[
        Literal["fixed", "compliant"],
        Meta(description="compliant: stages are planned with wrists that give, too"),
    ] = "fixed"
    wrist_travel: Annotated[
        WristTravel | None, Meta(description="range in which a compliant wrist may settle")
    ] = None
    best_within: Annotated[
        float,
        Meta(ge=0.0, le=10.0, description="part by which another climb may be better"),
    ] = 0.05
    at_least: Enough | None = None
    time: SearchTime | None = None
    refine: Annotated[
        int, Meta(ge=0, le=16, description="times that the weakest stage gets places and poses")
    ] = 0
    want: Annotated[
        list[Literal["trajectory", "certificate"]],
        Meta(
            description="trajectory: how the robot moves, knot by knot. certificate: the file that "
            "proves the bound"
        ),
    ] = []
    parts: InParts = False

    def __post_init__(self) -> None:
        if self.wrist == "compliant" and self.objective not in MOVING_WRIST_OBJECTIVES:
            valid = " or ".join(MOVING_WRIST_OBJECTIVES)
            raise InvalidFieldError(
                f"'compliant' requires objective {valid}, got {self.objective!r}",
                field="wrist",
            )
        if self.wrist_travel is not None and self.wrist != "compliant":
            raise InvalidFieldError(
                f"requires wrist 'compliant', got {self.wrist!r}: change wrist, or leave it out",
                field="wrist_travel",
            )


class CancelRequest(Request, frozen=True, kw_only=True):
    """Request that cancels questions of the same client: those that wait, and climbs in work.

    - ``id``: ``id`` of the questions.
    """

    id: Identifier
