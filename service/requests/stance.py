"""Define the stance of a request: poses of body and hands, and how hands take their holds."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from hand_models.base import Acceleration, Coordinate, Name, Position, Strict
from hand_models.hand import Grasp, Placing, WristTravel
from planner import LimbStiffness
from service.requests.holds import Hold, Rock, SurfaceMessage
from service.requests.request import FourTensions, PoseMessage, WrenchEntries, WrenchEntry

__all__ = [
    "Angles",
    "Hand",
    "Place",
    "StanceMessage",
]

Preload = Annotated[
    FourTensions,
    Meta(
        description="tensions that the tendons of a floating hand hold at rest [N]; by default the "
        "closing tension"
    ),
]
Planned = WrenchEntry | None
Angle = Annotated[float, Meta(ge=-1e3, le=1e3)]
Displacement = Annotated[float, Meta(ge=-0.05, le=0.05)]
Rotation = Annotated[float, Meta(ge=-0.3, le=0.3)]
Direction = Annotated[tuple[Coordinate, Coordinate, Coordinate], Meta(description="not zero")]
Angles = Annotated[
    list[Angle],
    Meta(
        min_length=1,
        max_length=64,
        description="of a limb's joints from the body outward; those that slide in m [rad]",
    ),
]
Entries = Annotated[
    dict[Name, Any],
    Meta(
        extra_json_schema={
            "additionalProperties": {
                "type": "object",
                "additionalProperties": {"$ref": "#/$defs/Quantity"},
            }
        },
    ),
]
HandEntries = Annotated[
    Entries,
    Meta(
        description="numbers of the hand in place of the service's own, by section and entry of "
        "its parameter file hand.toml"
    ),
]


class Place(Strict, frozen=True, kw_only=True):
    """Point on a rock at which a hand is seated, with the direction of its approach.

    - ``point``: point near the rock; the hand goes to where its line along ``approach`` meets the
      rock [m].
    - ``approach``: direction into the rock, of any length: z of the hand.
    - ``wrist_angle``: angle by which the hand is turned about its approach, from where its x is
      nearest to ``up`` [rad].
    - ``frame``: frame of ``point``, ``approach`` and ``up``: ``world``, or ``rock`` for the frame
      of the rock.
    - ``up``: direction that counts as up; by default z of the world, or x of the rock's frame.
    """

    point: Annotated[Position, Meta(description="on the rock, where the hold's crest would be [m]")]
    approach: Annotated[Direction, Meta(description="into the rock, of any length: z of the hand")]
    wrist_angle: Annotated[
        Angle,
        Meta(
            description="by which the hand is turned about its approach from where its x is "
            "nearest to up [rad]"
        ),
    ] = 0.0
    frame: Annotated[Literal["world", "rock"], Meta(description="of point, approach and up")] = (
        "world"
    )
    up: Annotated[
        Direction | None,
        Meta(description="by default z of the world, or x of the rock's frame"),
    ] = None


class Hand(Strict, frozen=True, kw_only=True):
    """One hand on its hold; the hand is given by its pose, or by a place on the rock.

    - ``limb``: name of the limb that carries the hand.
    - ``pose``: pose of H in W.
    - ``place``: place on the rock, instead of ``pose``; the reply then contains the pose.
    - ``hold``: the rock under the hand.
    - ``surface``: name of a bundled surface, or numbers of a surface of the caller's own.
    - ``grasp``: how the hand closes: fingers, palm and fingernails.
    - ``wrist``: ``fixed``; ``floating``, the wrist moves and the motors stand still; or
      ``compliant``, the wrist moves and the tendons are driven.
    - ``wrist_travel``: range in which a compliant wrist may come to rest.
    - ``tendon_preload``: tensions of the four tendons of a floating hand at rest [N]; by default
      the closing tension.
    - ``wrench``: wrench that the hand must exert on the rock, in H [N, N·m]; the plan chooses
      components that are null.
    - ``seat``: how a hand is seated whose hold has no pose: ``rest`` as its grasp has it, ``best``
      at the nearby pose with the strongest grip.
    - ``seat_direction``: wrench on the rock, in H, in which the ``best`` seat is strongest; by
      default the pull-off.
    - ``placing``: ``given``, the hand is where it is put or seated; ``contact``, it is moved along
      z and turned about x and y of H to where the closed, unloaded hand rests on its rock. The
      reply then contains the pose.
    - ``contact_offset``: small displacement and rotation of H from that rest, in H at rest [m,
      rad].
    """

    limb: Name
    pose: Annotated[PoseMessage | None, Meta(description="of H in W")] = None
    place: Annotated[
        Place | None,
        Meta(
            description="in place of a pose: where on the rock, whose frame is `hold.pose`, or W, "
            "the hand is seated; the reply has its pose"
        ),
    ] = None
    hold: Hold
    surface: Annotated[Name | SurfaceMessage, Meta(description="a preset's name, or numbers")]
    grasp: Grasp = Grasp()
    wrist: Annotated[
        Literal["fixed", "floating", "compliant"],
        Meta(
            description="floating: the motors stand still, and the wrist moves; compliant: the "
            "tendons are driven, and the wrist moves"
        ),
    ] = "fixed"
    wrist_travel: Annotated[
        WristTravel | None, Meta(description="range in which a compliant wrist may settle")
    ] = None
    tendon_preload: Preload | None = None
    wrench: Annotated[
        tuple[Planned, Planned, Planned, Planned, Planned, Planned] | None,
        Meta(
            description="what the hand must exert on the rock, in H [N, N·m]; null components are "
            "the plan's"
        ),
    ] = None
    seat: Annotated[
        Literal["rest", "best"],
        Meta(
            description="how a hand is seated whose hold has no pose: as its grasp would have it, "
            "or near there where it holds most"
        ),
    ] = "rest"
    seat_direction: Annotated[
        WrenchEntries | None,
        Meta(
            description="in which wrench on the rock, in H, the best seat is to hold most; by "
            "default the pull-off"
        ),
    ] = None
    placing: Annotated[
        Placing,
        Meta(
            description="contact: by its z and its turns about x and y the hand is moved to where, "
            "closed and unloaded, it rests on its rock; the reply has its pose"
        ),
    ] = "given"
    contact_offset: Annotated[
        tuple[Displacement, Displacement, Displacement, Rotation, Rotation, Rotation] | None,
        Meta(description="of H from where it rests, in H at rest; of placing contact [m, rad]"),
    ] = None


class StanceMessage(Strict, frozen=True, kw_only=True):
    """Stance of the robot: pose of the body, and all hands on their holds.

    - ``robot``: name of the robot; by default the robot that is served or given by ``--robot``, or
      ``robosimian``.
    - ``hand``: numbers of the hand that replace the service's, by section and entry of
      ``hand.toml``.
    - ``gravity``: acceleration of gravity in W [m/s²]; by default the Earth's.
    - ``body``: pose of B in W.
    - ``joints``: joint angles by limb from the body outward [rad], or ``"solve"`` for inverse
      kinematics; with joints their torques count as limits. Hands may be 10 mm and 0.05 rad off the
      pose that the angles give.
    - ``limb_stiffness``: stiffness with which limbs carry floating or compliant wrists; replies
      then have pose targets.
    - ``rocks``: rocks by name, for holds that refer to them.
    - ``hands``: the hands, at most 16.
    """

    robot: Annotated[
        Name | None,
        Meta(description="by default that which is served or given by --robot, or robosimian"),
    ] = None
    hand: HandEntries | None = None
    gravity: Acceleration | None = None
    body: Annotated[PoseMessage, Meta(description="of B in W")]
    joints: Annotated[
        dict[Name, Angles | Literal["solve"]] | Literal["solve"] | None,
        Meta(
            description="angles of every limb with a hand, or that inverse kinematics finds them, "
            "of a limb or of all; either way hands may be 10 mm and 0.05 rad off; with joints "
            "their torques count"
        ),
    ] = None
    limb_stiffness: Annotated[
        LimbStiffness | None,
        Meta(description="with which limbs hold wrists that move: replies then have pose targets"),
    ] = None
    rocks: Annotated[
        dict[Name, Rock],
        Meta(
            max_length=64,
            description="by name, for hands that refer to them; a mesh's frame may begin anywhere",
        ),
    ] = {}
    hands: Annotated[
        list[Hand],
        Meta(
            max_length=16,
            description="together with at most 256 half_planes, those of a compliant or floating "
            "hand counted four times, and 40000 points of profiles; more is an error of kind limit",
        ),
    ]
