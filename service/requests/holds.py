"""Define the holds of requests: rock of every shape, its pose, and its surface."""

from __future__ import annotations

import math
from typing import Annotated

from msgspec import Meta

from hand_models.base import Coordinate, Name, Strict
from service.requests.request import PoseMessage

__all__ = [
    "CylinderMessage",
    "EdgeMessage",
    "EllipsoidMessage",
    "Hold",
    "MeshMessage",
    "PlaneMessage",
    "ProfileMessage",
    "Rock",
    "RockReference",
    "SphereMessage",
    "SurfaceMessage",
]

Diameter = Annotated[float, Meta(ge=1e-3, le=100.0, description="[m]")]
SemiAxis = Annotated[float, Meta(ge=5e-4, le=50.0)]
FilletRadius = Annotated[float, Meta(ge=1e-4, le=100.0, description="[m]")]
EdgeAngle = Annotated[
    float, Meta(ge=1e-2, lt=math.pi, description="of the rock between the faces [rad]")
]
OutlinePoint = Annotated[tuple[Coordinate, Coordinate], Meta(description="[x, z] [m]")]
Outline = Annotated[
    list[OutlinePoint],
    Meta(min_length=2, max_length=5000, description="rock on the side of larger z"),
]
VertexIndex = Annotated[int, Meta(ge=0, lt=2_000_000)]
Vertices = Annotated[
    list[tuple[float, float, float]],  # without bounds: those that no face names may be no numbers
    Meta(max_length=2_000_000, description="in the hold's frame, within 10⁴ [m]"),
]
Faces = Annotated[
    list[tuple[VertexIndex, VertexIndex, VertexIndex]],
    Meta(max_length=4_000_000, description="counterclockwise seen from outside the rock"),
]
FileName = Annotated[
    str,
    Meta(
        max_length=4096,
        description="STL, PLY, OBJ or OFF in metres, relative to the file that names it; only on "
        "the command line, which sends vertices and faces",
    ),
]
TileForce = Annotated[float, Meta(ge=1e-3, le=1e5, description="of one tile [N]")]
PullOffAngle = Annotated[float, Meta(ge=1e-3, le=math.pi / 2, description="[rad]")]
Gain = Annotated[float, Meta(ge=0.0, le=1e3)]
LateralShare = Annotated[float, Meta(ge=1e-3, le=1.0)]
Friction = Annotated[
    float, Meta(ge=0.0, le=1e3, description="of a tile dragged backwards: T ≥ −friction N")
]
Exponent = Annotated[
    float, Meta(ge=0.25, le=4.0, description="strength falls by (angle / pull_off_angle)^this; 1")
]
Scatter = Annotated[float, Meta(ge=0.0, le=1e5, description="standard deviation, of one tile [N]")]
Count = Annotated[int, Meta(ge=1, le=64)]


class Placed(Strict, frozen=True, kw_only=True, tag_field="shape"):
    """Pose of a hold: in the world, in the hand, or neither.

    At most one of the two poses is given. With neither, ``crux`` chooses a seat for the hand.

    - ``pose``: pose of the hold's frame in W.
    - ``pose_in_hand``: pose of the hold's frame in H.
    """

    pose: Annotated[PoseMessage | None, Meta(description="in W")] = None
    pose_in_hand: Annotated[PoseMessage | None, Meta(description="in H")] = None


class PlaneMessage(Placed, frozen=True, kw_only=True, tag="plane"):
    """Flat wall; z of its frame points into the rock."""


class CylinderMessage(Placed, frozen=True, kw_only=True, tag="cylinder"):
    """Round log of rock along y of its frame.

    - ``diameter``: diameter of the log [m].
    """

    diameter: Diameter


class SphereMessage(Placed, frozen=True, kw_only=True, tag="sphere"):
    """Ball of rock.

    - ``diameter``: diameter of the ball [m].
    """

    diameter: Diameter


class EdgeMessage(Placed, frozen=True, kw_only=True, tag="edge"):
    """Two flat faces that meet in a rounded edge (fillet) along y of its frame.

    - ``fillet_radius``: radius of the fillet [m].
    - ``angle``: angle of the rock between the faces [rad].
    """

    fillet_radius: FilletRadius
    angle: EdgeAngle


class EllipsoidMessage(Placed, frozen=True, kw_only=True, tag="ellipsoid"):
    """Rounded boulder; its crest is an end of the last semi-axis.

    - ``semi_axes``: half the lengths of the boulder along x, y and z of its frame [m].
    """

    semi_axes: Annotated[
        tuple[SemiAxis, SemiAxis, SemiAxis], Meta(description="along x, y, z of its frame [m]")
    ]


class Strips(Strict, frozen=True, kw_only=True):
    """Outlines of the rock under each of the four fingers, as lists of points [x, z] [m].

    Two strips meet at y = 0 of the hold's frame, the others half-way between two fingers.

    - ``outer_left``: rock under the outer left finger.
    - ``inner_left``: rock under the inner left finger.
    - ``inner_right``: rock under the inner right finger.
    - ``outer_right``: rock under the outer right finger.
    """

    outer_left: Outline
    inner_left: Outline
    inner_right: Outline
    outer_right: Outline


class ProfileMessage(Placed, frozen=True, kw_only=True, tag="profile"):
    """Rock with one cross-section, an outline in x and z, drawn out along y of its frame.

    Outlines are smoothed to the scale of a tile. Either ``points`` or ``profiles`` is given.

    - ``points``: one outline for all fingers, as points [x, z] [m].
    - ``profiles``: one outline for each finger.
    """

    points: Outline | None = None
    profiles: Strips | None = None


class MeshMessage(Placed, frozen=True, kw_only=True, tag="mesh"):
    """Triangle mesh of rock, open or closed.

    Either ``vertices`` and ``faces`` are given, or ``file``, which only the command line accepts.

    - ``vertices``: points in the hold's frame [m].
    - ``faces``: three vertex indices for each triangle, counterclockwise seen from outside the
      rock.
    - ``file``: path of an STL, PLY, OBJ or OFF file in metres.
    """

    vertices: Vertices | None = None
    faces: Faces | None = None
    file: FileName | None = None


Rock = (
    PlaneMessage
    | CylinderMessage
    | SphereMessage
    | EdgeMessage
    | EllipsoidMessage
    | ProfileMessage
    | MeshMessage
)


class RockReference(Placed, frozen=True, kw_only=True, tag="rock"):
    """Reference to one of the stance's rocks, which several hands can share.

    The rock is at the pose in ``stance.rocks`` if no pose is given here.

    - ``rock``: name of the rock in ``stance.rocks``.
    """

    rock: Annotated[Name, Meta(description="of stance.rocks")]


Hold = Rock | RockReference


class SurfaceMessage(Strict, frozen=True, kw_only=True):
    """Strength of the rock's surface under a spine tile, in the caller's numbers.

    Only ``shear_limit`` is needed; fields that are left out follow from the shear limit.

    - ``shear_limit``: strength of one tile in pure shear along the rock [N].
    - ``pull_off_limit``: strength of one tile at ``pull_off_angle`` [N].
    - ``pull_off_angle``: largest angle of the load away from the rock that the tile can carry, at
      most π/2 [rad].
    - ``lateral_limit``: strength of one tile along the rock straight sideways [N].
    - ``compression_gain``: shear strength gained per newton of pressing [N/N].
    - ``half_planes``: number of half-planes that approximate the limit curve from pure shear to
      ``pull_off_angle``.
    - ``lateral_pull_off_ratio``: factor by which lateral strength over shear strength is smaller at
      ``pull_off_angle``, above 0 and at most 1.
    - ``shear_scatter``: standard deviation of ``shear_limit`` from place to place, of one tile [N].
    - ``friction``: Coulomb friction coefficient of a tile that is dragged backwards, away from the
      finger's base.
    - ``pull_off_exponent``: exponent of the fall of strength from ``shear_limit`` to
      ``pull_off_limit``; 1 is a straight line over the angle.
    """

    shear_limit: TileForce
    pull_off_limit: TileForce | None = None
    pull_off_angle: PullOffAngle | None = None
    lateral_limit: TileForce | None = None
    compression_gain: Gain | None = None
    half_planes: Count | None = None
    lateral_pull_off_ratio: LateralShare | None = None
    shear_scatter: Scatter | None = None
    friction: Friction | None = None
    pull_off_exponent: Exponent | None = None
