"""Parts of a plan that are words and plain numbers: they travel as they are.

A name that does not exist is None, and null on its way; what was not asked for is left out.
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
    "RobustLoadFactor",
    "Solver",
    "TensionPath",
    "Tile",
    "Time",
]

Vector = list[float]

AnyVector = TypeVar("AnyVector")
"""Kind of a part's vectors: arrays in the planner, lists in a reply."""


class LimitName(Struct, frozen=True):
    """A limit of one hand or its limb, by name.

    Attributes
    ----------
    limb : str
    finger, phalanx : str or None
        None where the limit is not a finger's, or not a tile's.
    limit : str
        What is limited: of a tile ``shear``, ``pull_off``; of a finger ``tendon_tension``,
        ``motor_torque``, ``motor_current``, ``finger_shear``, ``finger_lateral`` and, with its
        distal phalanx, ``fingertip_force``; of a hand ``palm_shear``, ``palm_pressing``,
        ``hand_load`` and, where it is capped, ``force_cap``; of a limb ``joint_torque``, or
        ``joint_force`` of a joint that slides; or a hard row's name.
    joint : str or None
        The joint whose torque it is.
    """

    limb: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None


class Price(LimitName, frozen=True, kw_only=True):
    """A limit that binds, and what one more unit of it would take off the utilisation.

    Attributes
    ----------
    price : float
        [1/unit]
    unit : str
        Of the limit's capacity: ``N``, ``N·m`` or ``A``.
    """

    price: float
    unit: str

    @classmethod
    def of(cls, name: LimitName, price: float, unit: str) -> Price:
        """Return the price of a limit."""
        return cls(*astuple(name), price=price, unit=unit)

    @property
    def name(self) -> LimitName:
        """The limit alone."""
        return LimitName(self.limb, self.finger, self.phalanx, self.limit, self.joint)


LoadFactorStatus = Literal["found", "at_least", "unbounded", "none", "not_asked", "not_finished"]
"""Status of a load factor: it is there, or that it is no less; no multiple of the body wrench is
too much, or none can be held; it was not asked for, or a deadline came before."""


class LoadFactor(NamedTuple):
    """The outcome of a search for a load factor.

    Attributes
    ----------
    factor : float or None
    least : bool
        Whether it is only known to be no less.
    unbounded : bool
        Whether any multiple of the body wrench can be held.
    unfinished : bool
        Whether the deadline came before.
    """

    factor: float | None = None
    least: bool = False
    unbounded: bool = False
    unfinished: bool = False

    @property
    def status(self) -> LoadFactorStatus:
        """Status of the search, where it was asked for."""
        if self.unbounded:
            return "unbounded"
        if self.factor is not None:
            return "at_least" if self.least else "found"
        return "not_finished" if self.unfinished else "none"


class Solver(Struct, frozen=True):
    """The solver, and how it ended.

    Attributes
    ----------
    name, status : str
    iterations : int
        Zero where the limits that bound in a plan before led to this one without it.
    """

    name: str
    status: str
    iterations: int


class Time(Struct, frozen=True):
    """The time that each part took [s]."""

    model: float
    solve: float
    total: float


class TensionPath(Struct, frozen=True):
    """The straight way from the present tensions to the planned ones.

    Attributes
    ----------
    safe : bool
        Whether every point of it balances the body within the cap on the utilisation, hard rows
        giving by 1 mN: no present tension is known better.
    safe_part : float
        How much of it does, from the plan backward; zero where the plan itself does not.
    utilisation_at_present : float or None
        The least at the present tensions; None if these balance the body at no utilisation.
    largest_change : float
        Of a tension [N].
    limiting : list of LimitName
        The limits and hard rows that end the safe part, the weightiest first; of a plan beyond the
        cap those of which it uses most. Empty where the way is safe.
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
        ``hand_adds_nothing`` or, where joints are known, ``link_in_rock``, ``links_collide``,
        ``mass_below_limbs`` and ``com_off_posture``.
    field : str
        Its place in the question, such as ``stance.hands[0].pose.orientation``.
    message : str
        What is odd, and the slip that it is likely to come of.
    value : float
        What was measured: how deep, how far, how much of its reach, a cosine, or the utilisation
        without the hand; or the number that looks as if it were in another unit.
    unit : str
        Of that, such as ``m``, ``m/s²`` or ``1``.
    """

    kind: str
    field: str
    message: str
    value: float
    unit: str


class Distance(Struct, frozen=True):
    """The least distance between two things.

    Attributes
    ----------
    between : list of str
        Their names, such as ``hand of front_left``, ``rock of front_left``, ``body``; a link has
        its own, or that of the joint that moves it.
    distance : float
        Below zero: how deep one is in the other [m].
    points : list of (list of float)
        The nearest point of each, in W [m].
    """

    between: list[str]
    distance: float
    points: list[Vector]


class Clearance(Struct, frozen=True, kw_only=True):
    """The least distances about a stance; None where nothing was measured.

    Links that are joined, and a hand with its own rock or the link that carries it, are left out.

    Attributes
    ----------
    link_rock, link_link : Distance or None
        Of a limb's link from rock; from another link, the body or another limb's hand.
    hand_hand, hand_body : Distance or None
        Of a hand from another hand, and from the body.
    body_rock : Distance or None
        Of the body from rock.
    unchecked : list of str
        What was not measured, and why.
    """

    link_rock: Distance | None = None
    link_link: Distance | None = None
    hand_hand: Distance | None = None
    hand_body: Distance | None = None
    body_rock: Distance | None = None
    unchecked: list[str] = []


class RobustLoadFactor(Struct, frozen=True):
    """The load factor where the hands are not quite where they were put.

    Each hand is closed anew at ``places`` about its own, a scrambled Sobol sequence by its limb's
    name, and the places of all hands are combined at random. H stays in W, so that body and joints
    stay, too: it is the rock that is elsewhere. Quantiles are over all draws: one in which a hand
    cannot be, or nothing can be held, has a load factor of zero.

    Attributes
    ----------
    draws, without : int
        Combinations of places, and those of them that have a load factor of zero.
    refused : dict of str to int
        In how many draws a hand cannot be, by limb; those that always can are left out.
    position, angle : float
        The scatter: to either side along each axis of H [m], and about each [rad].
    seed : int
        Of the draws.
    worst : float
        Deprecated: the same as ``hundredth``. It was the least of the draws that had one, which
        depends on how many there are.
    tenth : float
        What it exceeds in nine in ten draws.
    tenth_interval : list of float, length 2
        Interval that holds it with 95 % confidence, for this number of draws.
    hundredth : float
        What it exceeds in 99 of a hundred draws.
    hundredth_interval : list of float, length 2
        The same of that.
    places : int
        Of each hand.
    reasons : dict of str to str
        Why a hand cannot be at the first of its places where it cannot, by limb.
    """

    draws: int
    without: int
    refused: dict[str, int]
    position: float
    angle: float
    seed: int
    worst: float
    tenth: float
    tenth_interval: list[float]
    hundredth: float
    hundredth_interval: list[float]
    places: int
    reasons: dict[str, str] = {}


class Palm(Struct, Generic[AnyVector], frozen=True, kw_only=True, eq=False):
    """The palm: where it acts, its force on the rock there, and its moment about that point, in H.

    Attributes
    ----------
    position, force, moment : vector, length 3
        [m], [N], [N·m]
    engaged : sequence of int
        Its tiles that are on the rock.
    utilisation : float
    """

    position: AnyVector
    force: AnyVector
    moment: AnyVector
    engaged: Sequence[int]
    utilisation: float


class Tile(Struct, frozen=True):
    """One finger tile of a plan. Vectors in H, forces on the rock, SI units.

    A reply has the last three fields with ``"want": ["model"]``; the first two of them there are
    only where the wrist is fixed.

    Attributes
    ----------
    phalanx : str
        ``base``, ``proximal``, ``middle`` or ``distal``, or ``nail``.
    contact : str
        ``face``, ``edge``, ``frame`` where its phalanx only presses beside it, ``nail``, or
        ``none`` where it touches nothing and carries nothing.
    position : list of float, length 3
    force : list of float, length 3
        shear·shear_axis + normal·normal_axis + lateral·lateral_axis.
    shear, normal, lateral : float
    shear_axis, normal_axis, lateral_axis : list of float, length 3
    utilisation : float
        Largest load over capacity of its half-planes; never below zero.
    load_at_zero : list of float, length 2
        Shear and normal load at zero tension [N].
    load_per_newton : list of float, length 2
        The same per newton of tension.
    half_planes : list of list of float, length 4
        [a_shear, a_normal, a_lateral, capacity] of each limit of the spines that are on the rock;
        of a tile that is not on rock, of a whole one.
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
    """One finger of a plan: its tendon, its motor while it tightens that, and its tiles.

    Attributes
    ----------
    name : str
    closure : str
        How it has ended on its hold: ``laid``, ``hooked``, ``wedged``, ``curled``, ``stopped`` or
        ``straight``.
    tendon_tension : float
        [N]
    motor_torque, motor_current : float
        [N·m], [A]
    winch_angle : float
        From the open finger to that tension, of a floating hand to the preload at which the motor
        stands still [rad].
    tiles : list of Tile
        From the base outward.
    """

    name: str
    closure: str
    tendon_tension: float
    motor_torque: float
    motor_current: float
    winch_angle: float
    tiles: list[Tile]
