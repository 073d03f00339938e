"""Parts of a plan that are words and plain numbers, sent in a reply without conversion.

A value that does not exist is None in Python and null in JSON; a field that was not asked for is
left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, Literal, NamedTuple, TypeVar

from msgspec import UNSET, Struct, UnsetType
from msgspec.structs import astuple

__all__ = [
    "Clearance",
    "Distance",
    "Finding",
    "Finger",
    "LimitName",
    "LoadFactor",
    "LoadFactorStatus",
    "Palm",
    "Price",
    "Reliability",
    "Solver",
    "Status",
    "TensionPath",
    "Tile",
    "Time",
]

Vector = list[float]

AnyVector = TypeVar("AnyVector")
"""Type of a part's vectors: arrays in the planner, lists in a reply."""


class LimitName(Struct, frozen=True):
    """A limit of one hand or its limb, by name.

    Attributes
    ----------
    limb : str
        Limb that has the limit, or whose hand has it.
    finger, phalanx : str or None
        None if the limit is not a finger's, or not a tile's.
    limit : str
        What is limited: of a tile ``shear``, ``pull_off``; of a finger ``tendon_tension``,
        ``motor_torque``, ``motor_current``, ``finger_shear``, ``finger_lateral``, with its distal
        phalanx ``fingertip_force``, with the phalanx after a joint ``finger_twist``; of a hand
        ``palm_shear``, ``palm_pressing``, ``hand_load`` and, if the question caps it,
        ``force_cap``; of a limb ``joint_torque``, or ``joint_force`` of a prismatic joint; or a
        hard row's name.
    joint : str or None
        Joint whose torque or force is limited; None for other limits.
    """

    limb: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None


class Price(LimitName, frozen=True, kw_only=True):
    """Shadow price of an active limit: decrease of the utilisation per unit more of the limit.

    Attributes
    ----------
    price : float
        Decrease of the utilisation [1/unit].
    unit : str
        Unit of the limit's capacity: ``N``, ``N·m`` or ``A``.
    """

    price: float
    unit: str

    @classmethod
    def of(cls, name: LimitName, price: float, unit: str) -> Price:
        """Return the shadow price of a limit, given the decrease of the utilisation per unit."""
        return cls(*astuple(name), price=price, unit=unit)

    @property
    def name(self) -> LimitName:
        """The limit without its price."""
        return LimitName(self.limb, self.finger, self.phalanx, self.limit, self.joint)


Status = Literal["optimal", "overloaded", "infeasible", "failed"]
"""Status of a plan."""

LoadFactorStatus = Literal["found", "at_least", "unbounded", "none", "not_asked", "not_finished"]
"""Status of a load factor.

``found``: it is the largest; ``at_least``: it is a lower bound; ``unbounded``: any multiple of the
body wrench can be held; ``none``: no multiple can; ``not_asked``: the question did not ask for it;
``not_finished``: the deadline expired first."""


class LoadFactor(NamedTuple):
    """Result of the search for a load factor.

    Attributes
    ----------
    factor : float or None
        Largest multiple of the body wrench found; None if none was found.
    least : bool
        True if ``factor`` is only a lower bound.
    unbounded : bool
        True if any multiple of the body wrench can be held.
    unfinished : bool
        True if the deadline expired first.
    """

    factor: float | None = None
    least: bool = False
    unbounded: bool = False
    unfinished: bool = False

    @property
    def status(self) -> LoadFactorStatus:
        """Status of the search, for a load factor that was asked for."""
        if self.unbounded:
            return "unbounded"
        if self.factor is not None:
            return "at_least" if self.least else "found"
        return "not_finished" if self.unfinished else "none"


class Solver(Struct, frozen=True):
    """The solver of a plan, and its status.

    Attributes
    ----------
    name, status : str
        Name of the solver, and its status as CVXPY names it.
    iterations : int
        Number of iterations; zero if the plan follows from the active limits of an earlier plan,
        without the solver.
    """

    name: str
    status: str
    iterations: int


class Time(Struct, frozen=True):
    """Computing time [s]: preparing the model, solving the program, and the total."""

    model: float
    solve: float
    total: float


class Reliability(Struct, frozen=True):
    """Probability that no tile slips, of a plan of least hazard.

    The hazard is Σ (u Γ(1 + 1/m) / w̄)^m over all tiles on rock (`hand_models.tile.TileStrengths`),
    with each tile's utilisation u and the Weibull modulus m of its surface. Tiles are independent,
    and their mean strength is right; w̄ > 1 where that was fitted to the weakest of several.

    Attributes
    ----------
    hazard : float
        Of the plan; comparable only between plans on the same surfaces.
    no_slip : float
        exp(−hazard): probability that no tile slips, of tiles alone. (`Survival.no_slip` counts
        palms and the factors of holds and rock, too.)
    utilisation_before, hazard_before : float
        Of the plan for ``max_margin``.
    moduli : list of float
        m of each hand's tiles, from the scatter of its surface.
    """

    hazard: float
    no_slip: float
    utilisation_before: float
    hazard_before: float
    moduli: list[float]


class TensionPath(Struct, frozen=True):
    """Straight-line interpolation from present to planned tensions, checked for safety.

    Attributes
    ----------
    safe : bool
        Whether every point of the path balances the body within the cap on the utilisation. Hard
        rows may be exceeded by 1 mN, as no present tension is known better.
    safe_part : float
        Share of the path that is safe, from the plan backward, 0 to 1; zero if the plan itself is
        beyond the cap.
    utilisation_at_present : float or None
        Least utilisation at the present tensions; None if no utilisation balances the body there.
    largest_change : float
        Largest change of a tension along the path [N].
    limiting : list of LimitName
        Limits and hard rows that end the safe part, the one with the largest weight first; for a
        plan beyond the cap, the limits that it uses most. Empty if the path is safe.
    """

    safe: bool
    safe_part: float
    utilisation_at_present: float | None
    largest_change: float
    limiting: list[LimitName] = []


class Finding(Struct, frozen=True):
    """Something odd about a stance, which is planned all the same.

    Attributes
    ----------
    kind : str
        ``palm_away``, ``fingers_down``, ``body_in_rock``, ``body_reversed``, ``hands_overlap``,
        ``hand_in_body``, ``limbs_crossed``, ``out_of_reach``, ``gravity_up``, ``unit``,
        ``wrench_not_up``, ``nearly_pinching``, ``hand_adds_nothing``, ``margin_not_had``,
        ``margin_reduced``,
        ``palm_without_travel``, ``tile_stretched_far`` or, if joints are known, ``link_in_rock``,
        ``links_collide``, ``mass_below_limbs`` and ``com_off_posture``.
    field : str
        Field of the question, such as ``stance.hands[0].pose.orientation``.
    message : str
        What is odd, and the mistake that is its likely cause.
    value : float
        Measured value: a depth, a distance, a share of the reach, a cosine, an angle, the travel
        that a palm lacks, the stretch of a tile, the share of the margins that is kept, or the
        utilisation without the hand; or the number that seems to have a wrong unit.
    unit : str
        Unit of ``value``, such as ``m``, ``m/s²`` or ``1``.
    """

    kind: str
    field: str
    message: str
    value: float
    unit: str

    @property
    def doubts_number(self) -> bool:
        """True if a number is likely not what is meant: in another unit or frame, or rounded."""
        return self.kind in ("unit", "wrench_not_up", "out_of_reach", "nearly_pinching")


class Distance(Struct, frozen=True):
    """The least distance between two things.

    Attributes
    ----------
    between : list of str
        Names of the two things, such as ``hand of front_left``, ``rock of front_left``, ``body``;
        a link has its name, or that of the joint that moves it.
    distance : float
        Least distance [m]; if negative, the depth of the overlap.
    points : list of (list of float)
        Nearest point of each of the two things, in the world frame W [m].
    """

    between: list[str]
    distance: float
    points: list[Vector]


class Clearance(Struct, frozen=True, kw_only=True):
    """Least distances between hands, links, body and rock (collision check); None if not measured.

    Links that are joined, and a hand with its own rock or the link that carries it, are left out.

    Attributes
    ----------
    link_rock : Distance or None
        Distance of a limb's link from rock.
    link_link : Distance or None
        Distance of a limb's link from another link, the body or another limb's hand.
    hand_hand, hand_body : Distance or None
        Distance of a hand from another hand, and from the body.
    body_rock : Distance or None
        Distance of the body from rock.
    unchecked : list of str
        What was not measured, and why.
    """

    link_rock: Distance | None = None
    link_link: Distance | None = None
    hand_hand: Distance | None = None
    hand_body: Distance | None = None
    body_rock: Distance | None = None
    unchecked: list[str] = []


class Palm(Struct, Generic[AnyVector], frozen=True, kw_only=True, eq=False):
    """Load of the palm: contact point, force on the rock and moment about the point, in H.

    Attributes
    ----------
    position, force, moment : vector, length 3
        Contact point [m], force on the rock [N], and moment about the contact point [N·m].
    engaged : sequence of int
        Indices of the palm's tiles that are on the rock.
    utilisation : float
        Largest load over capacity of the palm's limits.
    """

    position: AnyVector
    force: AnyVector
    moment: AnyVector
    engaged: Sequence[int]
    utilisation: float


class Tile(Struct, frozen=True):
    """Load of one finger tile. Vectors are in the hand frame H, forces act on the rock; SI units.

    A reply has the last three fields with ``"want": ["model"]``. Of those, ``load_at_zero`` and
    ``load_per_newton`` are only there if the wrist is fixed.

    Attributes
    ----------
    phalanx : str
        ``base``, ``proximal``, ``middle`` or ``distal``, or ``nail``.
    contact : str
        ``face``; ``edge``; ``frame``: the phalanx only presses on rock beside the tile; ``nail``;
        ``slipped``: the tile's spines have let go, and it drags on with friction; ``none``: the
        tile touches nothing and carries no load.
    position : list of float, length 3
        Point of contact [m].
    force : list of float, length 3
        shear·shear_axis + normal·normal_axis + lateral·lateral_axis [N].
    shear, normal, lateral : float
        Components of the force along the three axes [N].
    shear_axis, normal_axis, lateral_axis : list of float, length 3
        Unit vectors.
    utilisation : float
        Largest ratio of load to capacity over the tile's half-planes; at least zero.
    load_at_zero : list of float, length 2
        Shear and normal load at zero tendon tension [N].
    load_per_newton : list of float, length 2
        Increase of shear and normal load per newton of tension.
    half_planes : list of list of float, length 4
        [a_shear, a_normal, a_lateral, capacity] of each limit a_shear·shear + a_normal·normal +
        a_lateral·lateral ≤ capacity [N] of the tile's spines on the rock; for a tile that is not
        on rock, of a whole tile.
    """

    phalanx: str
    contact: str
    position: Vector
    force: Vector
    shear: float
    normal: float
    lateral: float
    shear_axis: Vector
    normal_axis: Vector
    lateral_axis: Vector
    utilisation: float
    load_at_zero: Vector | UnsetType = UNSET
    load_per_newton: Vector | UnsetType = UNSET
    half_planes: list[Vector] | UnsetType = UNSET


class Finger(Struct, frozen=True):
    """One finger of a plan: tendon tension, motor load while tightening, and tiles.

    Attributes
    ----------
    name : str
        Name of the finger.
    closure : str
        How the finger ended its closing: ``laid``, ``hooked``, ``wedged``, ``curled``, ``stopped``
        or ``straight``.
    tendon_tension : float
        Tension of the finger's tendon [N].
    motor_torque, motor_current : float
        Torque [N·m] and current [A] of the motor while it tightens the tendon.
    winch_angle : float
        Rotation of the winch from the open finger to the planned tension [rad]; for a floating
        hand, to the preload at which its motor stands still.
    tiles : list of Tile
        Tiles of the finger, from its base outward.
    """

    name: str
    closure: str
    tendon_tension: float
    motor_torque: float
    motor_current: float
    winch_angle: float
    tiles: list[Tile]
