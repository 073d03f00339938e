"""Where the hands are, what the body needs, and what is asked about it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, Literal, get_args

import numpy as np

from hand_models.errors import InvalidInputError
from hand_models.frames import Array, Pose, finite_vector
from hand_models.hand import FINGERS, Grasp
from hand_models.holds import Hold
from hand_models.spines import Surface
from planner.robosimian import Robot, robosimian

__all__ = ["EARTH", "HandOnHold", "Limits", "Load", "Question", "Stance", "Wrist"]

Wrist = Literal["fixed", "floating"]

WRISTS: Final = get_args(Wrist)
"""How a wrist may be."""

EARTH: Final = (0.0, 0.0, -9.81)
"""Gravity in W unless a request gives another [m/s²] (the contract's figure)."""

FARTHEST: Final = 1e9
"""How far from its parent's origin a frame may be [m]; farther, its digits are all lost."""

HEAVIEST: Final = 1e12
"""Largest component of a body wrench that is taken for one [N, N·m]."""

TOO_FAR: Final = 10.0
"""How many times its limb's reach a hand may be from the body: beyond, the units are wrong."""

ORTHONORMAL: Final = 1e-6
"""How far the products of a pose's axes may be from those of orthonormal ones."""


def _moderate(wrench: Array, field: str | None) -> Array:
    """Return a body wrench; refuse one that is absurdly large."""
    if not np.abs(wrench).max() <= HEAVIEST:
        raise InvalidInputError(f"asks for more than {HEAVIEST:g} N or N·m", field=field)
    return wrench


def _possible(pose: Pose, field: str) -> None:
    """Refuse a pose that is not finite, absurdly far, or whose axes are not orthonormal."""
    position = finite_vector(pose.position, 3, f"{field}.position")
    if np.abs(position).max() > FARTHEST:
        raise InvalidInputError(
            f"must be within {FARTHEST:g} m, got {position.tolist()}", field=f"{field}.position"
        )
    axes = finite_vector(np.ravel(pose.rotation), 9, f"{field}.orientation").reshape(3, 3)
    if np.abs(axes).max() > 2.0 or not (
        np.abs(axes.T @ axes - np.eye(3)).max() <= ORTHONORMAL and np.linalg.det(axes) > 0.0
    ):
        raise InvalidInputError(
            "orthonormal right-handed axes are needed", field=f"{field}.orientation"
        )


@dataclass(frozen=True, eq=False)
class HandOnHold:
    """One hand of a stance.

    Attributes
    ----------
    limb : str
        One of the robot's limbs.
    pose : Pose
        H in W.
    hold : Hold
    surface : Surface
    hold_pose : Pose, optional
        The hold's frame in W.
    hold_in_hand : Pose, optional
        The hold's frame in H. With neither, the hand is seated on the hold.
    grasp : Grasp
    wrist : {'fixed', 'floating'}
        Whether its motors give each tendon the tension that the plan asks for while the wrist keeps
        its pose, or stand still while the wrist gives way.
    tendon_preload : ndarray, shape (4,), optional
        Tensions that the tendons of a floating hand hold at rest [N]; the closing tension by
        default.
    """

    limb: str
    pose: Pose
    hold: Hold
    surface: Surface
    hold_pose: Pose | None = None
    hold_in_hand: Pose | None = None
    grasp: Grasp = field(default_factory=Grasp)
    wrist: Wrist = "fixed"
    tendon_preload: Array | None = None

    def __post_init__(self) -> None:
        if self.wrist not in WRISTS:
            raise InvalidInputError(
                f"unknown wrist {self.wrist!r}; known are {', '.join(WRISTS)}", field="wrist"
            )
        if self.tendon_preload is not None:
            if self.wrist == "fixed":
                raise InvalidInputError(
                    "only a floating wrist holds a preload; valid is none, or wrist floating",
                    field="tendon_preload",
                )
            preload = finite_vector(self.tendon_preload, len(FINGERS), "tendon_preload")
            object.__setattr__(self, "tendon_preload", preload)
        if self.hold_pose is not None and self.hold_in_hand is not None:
            raise InvalidInputError("give pose or pose_in_hand, not both", field="hold")
        _possible(self.pose, "pose")
        if self.hold_pose is not None:
            _possible(self.hold_pose, "hold.pose")
        if self.hold_in_hand is not None:
            _possible(self.hold_in_hand, "hold.pose_in_hand")

    def placed_hold(self) -> Pose | None:
        """Return the hold's frame in H, or None if the hand is to be seated."""
        if self.hold_pose is not None:
            return self.pose.inverse() @ self.hold_pose
        return self.hold_in_hand


@dataclass(frozen=True, eq=False)
class Stance:
    """Hands on holds around a body.

    Attributes
    ----------
    hands : tuple of HandOnHold
        Between one and the number of the robot's limbs, each limb once.
    body : Pose
        B in W.
    gravity : ndarray, shape (3,)
        In W [m/s²].
    robot : Robot
    """

    hands: tuple[HandOnHold, ...]
    body: Pose
    gravity: Array = field(default_factory=lambda: np.array(EARTH))
    robot: Robot = field(default_factory=robosimian)

    def __post_init__(self) -> None:
        if not self.hands:
            raise InvalidInputError("at least one hand is needed", field="hands")
        _possible(self.body, "body")
        object.__setattr__(self, "gravity", finite_vector(self.gravity, 3, "gravity"))
        seen: set[str] = set()
        for i, hand in enumerate(self.hands):
            if hand.limb not in self.robot.limbs:
                raise InvalidInputError(
                    f"unknown limb {hand.limb!r}; known are {', '.join(self.robot.limbs)}",
                    field=f"hands[{i}].limb",
                )
            if hand.limb in seen:
                raise InvalidInputError(
                    f"limb {hand.limb!r} appears twice", field=f"hands[{i}].limb"
                )
            seen.add(hand.limb)
            away = float(np.linalg.norm(hand.pose.position - self.body.position))
            if away > TOO_FAR * self.robot.reach:
                raise InvalidInputError(
                    f"the hand is {away:.3g} m from the body; its limb reaches about "
                    f"{self.robot.reach:.2g} m (positions are in metres)",
                    field=f"hands[{i}].pose.position",
                )


@dataclass(frozen=True)
class Load:
    """What the body weighs and how it is to move.

    Attributes
    ----------
    mass : float, optional
        [kg]; the robot's own with its hands.
    com : tuple of float, optional
        Centre of mass in B [m]; the robot's own.
    acceleration : tuple of float
        Of the body in W [m/s²].
    """

    mass: float | None = None
    com: tuple[float, float, float] | None = None
    acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def body_wrench(self, stance: Stance) -> Array:
        """Return the resultant that the rock must exert on the robot, in B, shape (6,) [N, N·m].

        ``f = m (a − g)`` at the centre of mass; the body does not turn.
        """
        mass = stance.robot.mass if self.mass is None else self.mass
        if not (math.isfinite(mass) and mass > 0.0):
            raise InvalidInputError(f"must be above 0 kg, got {mass:g}", field="mass")
        com = finite_vector(stance.robot.com if self.com is None else self.com, 3, "com")
        acceleration = finite_vector(self.acceleration, 3, "acceleration")
        with np.errstate(over="ignore", invalid="ignore"):
            force = mass * stance.body.rotation.T @ (acceleration - stance.gravity)
            wrench = np.concatenate([force, np.cross(com, force)])
        return _moderate(wrench, None)


@dataclass(frozen=True)
class Limits:
    """Caps that a caller puts on a plan.

    Attributes
    ----------
    utilisation : float
        Largest utilisation that still counts as ``optimal``, in (0, 1].
    tendon_tension : float, optional
        Of every tendon [N]; the hand's own maximum if that is less.
    """

    utilisation: float = 1.0
    tendon_tension: float | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.utilisation <= 1.0:
            raise InvalidInputError(
                f"must be in (0, 1], got {self.utilisation:g}", field="utilisation"
            )
        tension = self.tendon_tension
        if tension is not None and not (math.isfinite(tension) and tension > 0.0):
            raise InvalidInputError(f"must be above 0 N, got {tension:g}", field="tendon_tension")


Want = Literal["load_factor", "prices", "model"]


@dataclass(frozen=True, eq=False)
class Question:
    """A stance, and what is asked of it.

    Attributes
    ----------
    stance : Stance
    body_wrench : ndarray, shape (6,), optional
        In B [N, N·m]; computed from ``load`` if it is not given.
    load : Load
    limits : Limits
    want : frozenset of {'load_factor', 'prices', 'model'}
        Extras.
    """

    stance: Stance
    body_wrench: Array | None = None
    load: Load = field(default_factory=Load)
    limits: Limits = field(default_factory=Limits)
    want: frozenset[Want] = frozenset()

    def __post_init__(self) -> None:
        if self.body_wrench is not None:
            wrench = finite_vector(self.body_wrench, 6, "body_wrench")
            _moderate(wrench, "body_wrench")
            object.__setattr__(self, "body_wrench", wrench)

    def needed_wrench(self) -> Array:
        """Return the body wrench that is planned for, shape (6,) [N, N·m]."""
        if self.body_wrench is not None:
            return self.body_wrench
        return self.load.body_wrench(self.stance)
