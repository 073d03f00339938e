"""What a caller may ask: every request, strict, with the bounds of its numbers.

Fields that the contract knows but this version does not are declared, so that they are refused by
name (`service.wire.checks`) and not as unknown. Bounds are far beyond any climbing robot; they keep
arithmetic finite.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

__all__ = [
    "Axis",
    "BodySpaceRequest",
    "Cylinder",
    "Edge",
    "Ellipsoid",
    "ForceCap",
    "Grasp",
    "Hand",
    "Hold",
    "Limits",
    "Load",
    "Mesh",
    "Move",
    "Placed",
    "PlanRequest",
    "Plane",
    "Pose",
    "Profile",
    "Request",
    "RouteRequest",
    "Sphere",
    "Stance",
    "Strict",
    "Strips",
    "Surface",
    "WrenchSpaceRequest",
]

Coordinate = Annotated[float, Meta(ge=-1e4, le=1e4)]
Position = Annotated[tuple[Coordinate, Coordinate, Coordinate], Meta(description="[m]")]
QuaternionEntry = Annotated[float, Meta(ge=-1e3, le=1e3)]
Quaternion = Annotated[
    tuple[QuaternionEntry, QuaternionEntry, QuaternionEntry, QuaternionEntry],
    Meta(description="[x, y, z, w], of norm 1 within 1e-3"),
]
AccelerationEntry = Annotated[float, Meta(ge=-1e3, le=1e3)]
Acceleration = Annotated[
    tuple[AccelerationEntry, AccelerationEntry, AccelerationEntry],
    Meta(description="in W [m/s²]"),
]
WrenchEntry = Annotated[float, Meta(ge=-1e6, le=1e6)]
Wrench = Annotated[
    tuple[WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry],
    Meta(description="[fx, fy, fz, mx, my, mz], force first [N, N·m]"),
]
Mass = Annotated[float, Meta(ge=1e-3, le=1e5, description="[kg]")]
Duration = Annotated[float, Meta(gt=0.0, le=1e6, description="[s]")]
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
    list[Position], Meta(max_length=2_000_000, description="in the hold's frame [m]")
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
Scatter = Annotated[float, Meta(ge=0.0, le=1e5, description="standard deviation, of one tile [N]")]
Count = Annotated[int, Meta(ge=1, le=64)]
OuterRotation = Annotated[float, Meta(ge=0.0, le=math.pi + 1e-6, description="[rad]")]
Tension = Annotated[float, Meta(ge=1e-3, le=1e4, description="of a tendon [N]")]
PreloadEntry = Annotated[float, Meta(ge=0.0, le=1e4)]
Preload = Annotated[
    tuple[PreloadEntry, PreloadEntry, PreloadEntry, PreloadEntry],
    Meta(
        description="tensions that the tendons of a floating hand hold at rest [N]; by default the "
        "closing tension"
    ),
]
Tensions = Annotated[
    tuple[PreloadEntry, PreloadEntry, PreloadEntry, PreloadEntry],
    Meta(description="of a hand's tendons [N]"),
]
Angle = Annotated[float, Meta(ge=-1e3, le=1e3)]
Angles = Annotated[
    list[Angle],
    Meta(min_length=1, max_length=64, description="of a limb's joints from the body outward [rad]"),
]
Torque = Annotated[float, Meta(ge=1e-3, le=1e6)]
Torques = Annotated[
    list[Torque],
    Meta(min_length=1, max_length=64, description="of a limb's joints from the body outward [N·m]"),
]
Force = Annotated[float, Meta(ge=1e-3, le=1e6, description="[N]")]
ForceBound = Annotated[float, Meta(ge=-1e6, le=1e6)]
ForceRange = Annotated[
    list[ForceBound],
    Meta(min_length=2, max_length=2, description="least and largest, with zero in between [N]"),
]
AxisForce = Force | ForceRange | None
# a tuple with lists in it crashes msgspec's garbage collection
AxisForces = Annotated[list[AxisForce], Meta(min_length=3, max_length=3)]
Utilisation = Annotated[float, Meta(ge=1e-3, le=1.0)]
Axis = Literal["fx", "fy", "fz", "mx", "my", "mz"]
Direction = tuple[Coordinate, Coordinate, Coordinate]
Name = Annotated[str, Meta(max_length=64)]
Identifier = Annotated[str, Meta(max_length=256, description="echoed in the reply")]
HandEntries = Annotated[
    dict[Name, Any],
    Meta(
        description="numbers of the hand in place of the service's own, by section and entry of "
        "its parameter file hand.toml",
        extra_json_schema={
            "additionalProperties": {
                "type": "object",
                "additionalProperties": {"$ref": "#/$defs/Quantity"},
            }
        },
    ),
]
ObjectiveName = Annotated[
    Literal["max_margin", "min_effort", "max_reliability"],
    Meta(
        description="least utilisation, or least effort within limits.utilisation; "
        "max_reliability is not supported in this version"
    ),
]
Later = Annotated[Any, Meta(description="not supported in this version; leave it out")]


class Strict(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A part of a request: an unknown field in it is an error."""


class Pose(Strict, frozen=True, kw_only=True):
    """A frame in another."""

    position: Position
    orientation: Quaternion


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


Hold = Plane | Cylinder | Sphere | Edge | Ellipsoid | Profile | Mesh


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


class Grasp(Strict, frozen=True, kw_only=True):
    """How a hand takes its hold."""

    outer_rotation: OuterRotation = 0.0
    closing_tension: Tension | None = None
    palm: bool = True
    lateral: bool = True
    fingernail: Annotated[
        bool, Meta(description="fingers straight, clinging with their nails alone")
    ] = False


class Hand(Strict, frozen=True, kw_only=True):
    """One hand on its hold."""

    limb: Name
    pose: Annotated[Pose, Meta(description="of H in W")]
    hold: Hold
    surface: Annotated[Name | Surface, Meta(description="a preset's name, or numbers")]
    grasp: Grasp = Grasp()
    wrist: Annotated[
        Literal["fixed", "floating"],
        Meta(description="floating: the motors stand still, and the wrist gives way"),
    ] = "fixed"
    tendon_preload: Preload | None = None
    wrench: Annotated[
        tuple[
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
        ]
        | None,
        Meta(
            description="what the hand must exert on the rock, in H [N, N·m]; null components are "
            "the plan's"
        ),
    ] = None


class Stance(Strict, frozen=True, kw_only=True):
    """Where the body and the hands are."""

    robot: Annotated[
        Name | None,
        Meta(description="by default that which is served or given by --robot, or robosimian"),
    ] = None
    hand: HandEntries | None = None
    gravity: Acceleration | None = None
    body: Annotated[Pose, Meta(description="of B in W")]
    joints: Annotated[
        dict[Name, Angles] | Literal["solve"] | None,
        Meta(
            description="angles of every limb with a hand, or that inverse kinematics finds them; "
            "with joints their torques count"
        ),
    ] = None
    hands: Annotated[list[Hand], Meta(max_length=16)]


class Load(Strict, frozen=True, kw_only=True):
    """What the body weighs and how it is to move; by default the robot's own weight, at rest."""

    mass: Mass | None = None
    com: Annotated[Position | None, Meta(description="centre of mass in B")] = None
    acceleration: Acceleration = (0.0, 0.0, 0.0)
    angular_acceleration: Annotated[
        tuple[AccelerationEntry, AccelerationEntry, AccelerationEntry],
        Meta(description="in W [rad/s²]; needs the stance's joints"),
    ] = (0.0, 0.0, 0.0)


class ForceCap(Strict, frozen=True, kw_only=True):
    """The most that a hand may do to its rock."""

    largest_force: Annotated[
        Force | AxisForces,
        Meta(
            description="whatever its direction; or along each axis of the frame: the largest "
            "either way, a range, or null for none"
        ),
    ]
    frame: Literal["hand", "body", "world"] = "hand"


class Limits(Strict, frozen=True, kw_only=True):
    """Caps that the caller puts on the plan."""

    utilisation: Utilisation = 1.0
    tendon_tension: Tension | None = None
    joint_torque: Annotated[
        Torque | dict[Name, Torque | Torques] | None,
        Meta(description="of all joints, or by limb, in place of the robot's own figures [N·m]"),
    ] = None
    per_hand: Annotated[dict[Name, ForceCap], Meta(description="by limb")] = {}
    tension_change: Annotated[
        Tension | None, Meta(description="largest change from the present tensions [N]")
    ] = None


Want = Literal["load_factor", "prices", "model"]


class Request(Strict, frozen=True, kw_only=True):
    """What every request has."""

    v: Literal[1]


class PlanRequest(Request, frozen=True, kw_only=True):
    """Asks who carries what in a stance."""

    id: Identifier | None = None
    stance: Stance
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    present: Annotated[
        dict[Name, Tensions],
        Meta(description="tensions of the tendons now, by limb: is the straight way safe? [N]"),
    ] = {}
    confidence: Later = None
    deadline: Annotated[
        Duration | None,
        Meta(
            description="how long the answer may take, from where the service takes the question "
            "on: then what is verified so far is the answer [s]"
        ),
    ] = None
    want: list[Want] = []


class WrenchSpaceRequest(Request, frozen=True, kw_only=True):
    """Asks what one hand of a stance can carry."""

    stance: Stance
    limb: Name


class BodySpaceRequest(Request, frozen=True, kw_only=True):
    """Asks what a stance can hold: body wrenches, a plane of them, and accelerations."""

    id: Identifier | None = None
    stance: Stance
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    limits: Limits = Limits()
    present: Annotated[
        dict[Name, Tensions], Meta(description="tensions of the tendons now, by limb [N]")
    ] = {}
    axes: Annotated[
        list[Axis], Meta(min_length=2, max_length=2, description="of the plane; fx and fz")
    ] = field(default_factory=lambda: ["fx", "fz"])
    others: Annotated[
        Literal["needed", "zero", "free"],
        Meta(
            description="the plane's other components: as asked for, zero, or whatever they may be"
        ),
    ] = "needed"
    directions: Annotated[
        list[Direction],
        Meta(max_length=100, description="along which the largest acceleration is wanted, in W"),
    ] = []


class Move(Hand, frozen=True, kw_only=True):
    """One limb to its next hold."""

    body: Annotated[
        Pose | None, Meta(description="of B in W: where the body shifts to before the limb lifts")
    ] = None


class RouteRequest(Request, frozen=True, kw_only=True):
    """A climb: a start stance, and moves. Not asked over zenoh; a file of the command line."""

    name: Identifier = "route"
    stance: Stance
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    moves: Annotated[list[Move], Meta(max_length=10_000)]
