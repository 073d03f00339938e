"""Define the holds of requests: rock of every shape, and its surface."""

from __future__ import annotations

import math
from typing import Annotated

from msgspec import Meta

from hand_models.base import Coordinate, Name, Strict
from service.requests.request import Pose

__all__ = [
    "Cylinder",
    "Edge",
    "Ellipsoid",
    "Hold",
    "Mesh",
    "Plane",
    "Profile",
    "Rock",
    "RockReference",
    "Sphere",
    "Surface",
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
    """A hold, placed by one pose or none; with none the hand is seated on it."""

    pose: Annotated[Pose | None, Meta(description="in W")] = None
    pose_in_hand: Annotated[Pose | None, Meta(description="in H")] = None


class Plane(Placed, frozen=True, kw_only=True, tag="plane"):
    """A flat wall."""


class Cylinder(Placed, frozen=True, kw_only=True, tag="cylinder"):
    """A round log of rock along y of its frame."""

    diameter: Diameter


class Sphere(Placed, frozen=True, kw_only=True, tag="sphere"):
    """A ball of rock."""

    diameter: Diameter


class Edge(Placed, frozen=True, kw_only=True, tag="edge"):
    """Two flat faces that meet in a fillet along y of its frame."""

    fillet_radius: FilletRadius
    angle: EdgeAngle


class Ellipsoid(Placed, frozen=True, kw_only=True, tag="ellipsoid"):
    """A rounded boulder; the crest is an end of its last semi-axis."""

    semi_axes: Annotated[
        tuple[SemiAxis, SemiAxis, SemiAxis], Meta(description="along x, y, z of its frame [m]")
    ]


class Strips(Strict, frozen=True, kw_only=True):
    """The rock under each finger; the strips meet at y = 0 and half-way between two fingers."""

    outer_left: Outline
    inner_left: Outline
    inner_right: Outline
    outer_right: Outline


class Profile(Placed, frozen=True, kw_only=True, tag="profile"):
    """Rock drawn out along y of its frame, smoothed to the scale of a tile; points or profiles."""

    points: Outline | None = None
    profiles: Strips | None = None


class Mesh(Placed, frozen=True, kw_only=True, tag="mesh"):
    """Triangles of rock, open or closed; vertices and faces, or a file for the command line."""

    vertices: Vertices | None = None
    faces: Faces | None = None
    file: FileName | None = None


Rock = Plane | Cylinder | Sphere | Edge | Ellipsoid | Profile | Mesh


class RockReference(Placed, frozen=True, kw_only=True, tag="rock"):
    """One of the stance's rocks, which hands share; it is at its own pose if none is given here."""

    rock: Annotated[Name, Meta(description="of stance.rocks")]


Hold = Rock | RockReference


class Surface(Strict, frozen=True, kw_only=True):
    """A surface of the caller's own; what is left out follows from the shear limit."""

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
