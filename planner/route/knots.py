"""Knots of a climb: what a controller sends at one time of a move, and the climb made of them.

Between two neighbouring knots a controller interpolates linearly in time: joint angles, tendon
tensions, and the position of the body (its orientation along the shortest turn).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from hand_models.base import Array, Pose
from planner.result import LimitName
from planner.route.climb import Route
from planner.route.moving_hand import HandKnot

if TYPE_CHECKING:
    from planner.route.held import HeldPosture

__all__ = ["Climb", "Failure", "Knot", "KnotPhase"]

KnotPhase = Literal["start", "shift", "unload", "open", "swing", "close", "load"]
"""Part of a move that a knot ends: the body shifts, the leaving hand is unloaded to its closing
tensions, opens, swings, closes on its new hold, and is loaded."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Knot:
    """One time of a climb: poses, joint angles, and verified loads of all hands.

    Attributes
    ----------
    index : int
        From zero, in climbing order.
    move : int
        Number of the move, from one; zero for the start, one more than there are moves for the end.
    phase : {'start', 'shift', 'unload', 'open', 'swing', 'close', 'load'}
        Part of the move that this knot ends, or is in.
    limb : str or None
        Limb that moves; None for the start and the end.
    stage : int or None
        Index of the route's stage that this knot is the plan of; None between stages.
    time : float
        Since the start, at the rates of the controller [s].
    body : Pose
        Pose of the body frame B in W.
    joints, joint_torque : mapping of str to ndarray, shape (n,)
        Joint angles [rad] and torques [N·m] of every limb.
    hands : tuple of HandKnot
        Of every limb that has a hand in the route, in the order of the start stance.
    utilisation : float
        Largest load over capacity of all limits.
    bound : float or None
        Largest utilisation from the knot before to this one, while a controller interpolates; None
        for the start.
    limiting : LimitName or None
        The limit with the largest utilisation.
    verified : bool
        Whether the independent check passed.
    """

    index: int
    move: int
    phase: KnotPhase
    limb: str | None
    stage: int | None
    time: float
    body: Pose
    joints: Mapping[str, Array]
    joint_torque: Mapping[str, Array]
    hands: tuple[HandKnot, ...]
    utilisation: float
    bound: float | None
    limiting: LimitName | None
    verified: bool


@dataclass(frozen=True)
class Failure:
    """Why a climb ends in the middle of a move.

    Attributes
    ----------
    move : int
        Number of the move, from one; zero if the start has no plan.
    phase : str
        Part of the move, as of `Knot`.
    limb : str or None
    reason : str
        One sentence: what is missing, or which link meets what.
    """

    move: int
    phase: KnotPhase
    limb: str | None
    reason: str


@dataclass(frozen=True, eq=False)
class Climb:
    """All knots of a route, up to its end or to the move that fails.

    Attributes
    ----------
    route : Route
    knots : tuple of Knot
        In climbing order.
    failure : Failure or None
        Why the climb ends early; None if it runs from end to end.
    rates : mapping of str to float
        Rates of the controller on which the knots' times rest, by name, as of `ClimbSettings`.
    held : tuple of HeldPosture
        The robot as it is held at the start and after each move, where another climb can branch
        off.
    """

    route: Route
    knots: tuple[Knot, ...]
    failure: Failure | None = None
    rates: Mapping[str, float] = field(default_factory=dict)
    held: tuple[HeldPosture, ...] = ()

    @property
    def fails(self) -> bool:
        """True if the climb ends early although the route asks for joints."""
        return self.failure is not None and self.route.start.joints is not None

    @property
    def stage_joints(self) -> Mapping[int, Mapping[str, Array]]:
        """Joint angles of the stages that have a knot, by index of the stage.

        There are none of a climb that ends early if the route does not ask for joints: then all its
        stages are planned without.
        """
        if self.failure is not None and not self.fails:
            return {}
        return {knot.stage: knot.joints for knot in self.knots if knot.stage is not None}
