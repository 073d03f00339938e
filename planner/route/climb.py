"""Routes: a start stance and moves, expanded into the stances (stages) to be planned in order.

A move takes one limb to its next hold. First the body may shift, with all hands on the rock. Then
the limb lifts (a stance without that hand). Then the hand is placed on the new hold:

    start → [shift] → lift → place → [shift] → lift → place → … → [shift]
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from msgspec import structs

from hand_models.base import Array, InvalidInputError, Pose
from hand_models.parameters import ParameterSample
from planner.question import (
    HandOnHold,
    Limits,
    Load,
    Objective,
    Question,
    Stance,
    Want,
    known_limbs,
)
from planner.result import Finding, LoadFactorStatus, Plan

__all__ = ["Move", "OutOfReach", "Route", "RouteResult", "RouteStage", "in_route", "stages"]

Phase = Literal["start", "shift", "lift", "place"]

JointAngles = Array | Literal["solve"]
"""Joint angles of a limb [rad], or 'solve' to find them by inverse kinematics."""


@dataclass(frozen=True, eq=False)
class Move:
    """Move of one limb to its next hold.

    Attributes
    ----------
    hand : HandOnHold
        The limb's hand on its new hold.
    body : Pose, optional
        Pose of the body frame B in the world frame W to which the body shifts first, on the hands
        that are on the rock.
    joints : mapping of str to (ndarray or 'solve'), or 'solve'
        Joint angles by limb [rad], for routes whose start stance has joints. Angles of limbs on the
        rock count from the shift on, those of the moving limb on its new hold. Limbs left out keep
        their angles, except that all are found by inverse kinematics if the body shifts, and those
        of the moving limb in any case.
    """

    hand: HandOnHold
    body: Pose | None = None
    joints: Mapping[str, JointAngles] | Literal["solve"] = "solve"


@dataclass(frozen=True, eq=False)
class Route:
    """A climb to be planned: a start stance and moves.

    Attributes
    ----------
    name : str
        Name of the climb.
    start : Stance
        Stance from which the climb starts.
    moves : tuple of Move
        Moves in climbing order.
    end : Pose, optional
        Pose of the body frame B in W to which the body shifts after all moves, with all hands on
        the rock.
    load : Load
        Mass, payloads and acceleration of the body, the same in every stage.
    limits : Limits
        Limits of every stage. A cap on a hand's force counts while the hand is on the rock;
        ``tension_change`` counts between knots of a `Climb` instead.
    objective : {'max_margin', 'min_effort', 'max_reliability', 'max_robust'}
        Objective of every stage.
    explain : bool
        Whether each stage without a plan is explained by a certificate, as in `Question`.
    want : frozenset of str
        Extras of every stage, in addition to the load factor.
    draws : tuple of ParameterSample, optional
        Samples of the ``spread`` of every stage, as in `Question`.
    """

    name: str
    start: Stance
    moves: tuple[Move, ...]
    end: Pose | None = field(default=None, kw_only=True)
    load: Load = field(default_factory=Load)
    limits: Limits = field(default_factory=Limits)
    objective: Objective = "max_margin"
    explain: bool = True
    want: frozenset[Want] = frozenset()
    draws: tuple[ParameterSample, ...] | None = None


@dataclass(frozen=True, eq=False)
class RouteStage:
    """One stance of a route, with the question to be planned.

    Attributes
    ----------
    index : int
        Index of the stage from zero, in climbing order.
    move : int
        Number of its move, from one; zero for the start, one more than there are moves for the end.
    phase : {'start', 'shift', 'lift', 'place'}
        Part of the move: shift of the body, lift of the limb, or place of its hand.
    limb : str or None
        Limb that moves; None for the start and the end.
    question : Question
        The stage's stance, load, limits and objective.
    paths : dict of str to str
        Field of the route that gives ``hands[i]``, ``body`` and ``joints.limb`` of the stance, for
        error messages.
    """

    index: int
    move: int
    phase: Phase
    limb: str | None
    question: Question
    paths: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class OutOfReach:
    """Answer for a stage that inverse kinematics cannot reach: it has no plan.

    Its attributes are those that a `Plan` has, without values.

    Attributes
    ----------
    reason : str
        Which limb does not reach its hand's pose, and the distance that is missing.
    """

    reason: str
    status: Literal["unreachable"] = "unreachable"
    utilisation: None = None
    load_factor: None = None
    load_factor_unbounded: Literal[False] = False
    load_factor_status: Literal["none"] = "none"
    limiting: None = None
    joint_utilisation: None = None
    joints: None = None
    spread: None = None
    warnings: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class RouteResult:
    """Plans of all stages of a route.

    Attributes
    ----------
    route : Route
        The climb.
    stages : tuple of RouteStage
        Stances of the climb, in climbing order.
    plans : tuple of Plan or OutOfReach
        Answer for each stage.
    """

    route: Route
    stages: tuple[RouteStage, ...]
    plans: tuple[Plan | OutOfReach, ...]

    @property
    def status(self) -> str:
        """Worst status of all stages; ``optimal`` if every stage is.

        From best to worst: optimal, overloaded, infeasible, unreachable, failed.
        """
        # each worse than the one before
        order = ("optimal", "overloaded", "infeasible", "unreachable", "failed")
        return max((p.status for p in self.plans), key=order.index)

    @property
    def feasible(self) -> bool:
        """True if every stage is ``optimal``."""
        return self.status == "optimal"

    @property
    def load_factor(self) -> float | None:
        """Least load factor of all stages; None if a stage has none, or all are unbounded."""
        factors: list[float] = []
        for p in self.plans:
            if p.load_factor is not None:
                factors.append(p.load_factor)
            elif not p.load_factor_unbounded:
                return None
        return min(factors, default=None)

    @property
    def load_factor_unbounded(self) -> bool:
        """True if the load factor of every stage is unbounded."""
        return all(p.load_factor_unbounded for p in self.plans)

    @property
    def load_factor_status(self) -> LoadFactorStatus:
        """Status of the route's load factor: that of the stage with the least load factor."""
        found = {p.load_factor_status for p in self.plans}
        # that of the least is the first of these that any stage has
        order: tuple[LoadFactorStatus, ...]
        order = ("none", "not_finished", "not_asked", "at_least", "found", "unbounded")
        return next(status for status in order if status in found)

    @property
    def crux(self) -> int:
        """Index of the hardest stage.

        Unreachable is hardest, then infeasible, then failed, then the largest utilisation.
        """
        return max(range(len(self.plans)), key=lambda i: _hardness(self.plans[i]))


def _hardness(answer: Plan | OutOfReach) -> tuple[int, float]:
    order = {"optimal": 0, "overloaded": 0, "failed": 1, "infeasible": 2, "unreachable": 3}
    used = answer.utilisation if answer.utilisation is not None else math.inf
    return order[answer.status], used


def stages(route: Route) -> Iterator[RouteStage]:
    """Yield the stances of a route in climbing order, each with its question.

    Raises
    ------
    InvalidInputError
        If a move's limb is not in the start stance, or has the only hand on the rock, or a stance
        is not valid; the field is relative to the route.
    """
    hands = {hand.limb: hand for hand in route.start.hands}
    for limb in route.limits.per_hand:
        if limb not in hands:
            raise InvalidInputError(
                f"no hand of the start stance; it has {', '.join(hands)}",
                field=f"limits.per_hand.{limb}",
            )
    body = route.start.body
    fields = {hand.limb: f"stance.hands[{i}]" for i, hand in enumerate(route.start.hands)}
    body_field = "stance.body"
    joints = _joints_of(route.start)
    joint_fields = {limb: f"stance.joints.{limb}" for limb in route.start.given_joints}
    index = 0

    def stage(move: int, phase: Phase, limb: str | None, held: Sequence[HandOnHold]) -> RouteStage:
        paths = {f"hands[{i}]": fields[hand.limb] for i, hand in enumerate(held)}
        paths |= {"body": body_field} | {f"joints.{limb}": at for limb, at in joint_fields.items()}
        on_rock = {hand.limb for hand in held}
        try:
            angles = None if joints is None else _on_rock(joints, on_rock)
            stance = replace(route.start, hands=tuple(held), body=body, joints=angles)
        except InvalidInputError as error:
            raise in_route(error, paths) from None
        caps = {limb: cap for limb, cap in route.limits.per_hand.items() if limb in on_rock}
        question = Question(
            stance,
            load=route.load,
            limits=structs.replace(route.limits, per_hand=caps, tension_change=None),
            want=route.want | {"load_factor"},
            draws=route.draws,
            objective=route.objective,
            explain=route.explain,
        )
        return RouteStage(index, move, phase, limb, question, paths)

    yield stage(0, "start", None, list(hands.values()))
    for number, move in enumerate(route.moves, start=1):
        limb = move.hand.limb
        if limb not in hands:
            raise InvalidInputError(
                f"limb {limb!r} is not in the start stance; it has {', '.join(hands)}",
                field=f"moves[{number - 1}].limb",
            )
        if len(hands) == 1:
            raise InvalidInputError(
                "the only hand on the rock cannot be lifted; add another hand to the start stance",
                field=f"moves[{number - 1}].limb",
            )
        given = dict(move.joints) if isinstance(move.joints, Mapping) else {}
        if joints is None and given:
            raise InvalidInputError(
                "requires stance.joints in the start stance, angles or 'solve'; add them, or "
                "remove the joints of the move",
                field=f"moves[{number - 1}].joints",
            )
        known_limbs(given, route.start.robot, f"moves[{number - 1}].joints")
        joint_fields |= {each: f"moves[{number - 1}].joints.{each}" for each in given}
        if joints is not None:
            if move.body is not None:
                joints |= dict.fromkeys(hands, "solve")
            joints |= {each: angles for each, angles in given.items() if each != limb}
        if move.body is not None:
            body, body_field = move.body, f"moves[{number - 1}].body"
            index += 1
            yield stage(number, "shift", limb, list(hands.values()))
        index += 1
        yield stage(number, "lift", limb, [hand for hand in hands.values() if hand.limb != limb])
        hands[limb], fields[limb] = move.hand, f"moves[{number - 1}]"
        if joints is not None:
            joints[limb] = given.get(limb, "solve")
        index += 1
        yield stage(number, "place", limb, list(hands.values()))
    if route.end is not None:
        body, body_field = route.end, "end"
        if joints is not None:
            joints |= dict.fromkeys(hands, "solve")
        index += 1
        yield stage(len(route.moves) + 1, "shift", None, list(hands.values()))


def _joints_of(start: Stance) -> dict[str, JointAngles] | None:
    """Return the joints of a start stance limb by limb; None where nothing is said of them."""
    if start.joints is None:
        return None
    found: dict[str, JointAngles] = dict.fromkeys(start.solved_limbs, "solve")
    return found | start.given_joints


def _on_rock(
    joints: Mapping[str, JointAngles], limbs: Collection[str]
) -> Mapping[str, JointAngles] | Literal["solve"]:
    """Return the joints of a stage; of limbs in the air there is nothing to find."""
    found = {
        limb: angles
        for limb, angles in joints.items()
        if limb in limbs or not isinstance(angles, str)
    }
    return found if any(not isinstance(angles, str) for angles in found.values()) else "solve"


def in_route(error: InvalidInputError, paths: Mapping[str, str]) -> InvalidInputError:
    """Return a stage's error with its field renamed to the field of the route.

    Parameters
    ----------
    error : InvalidInputError
        Error whose field is relative to the stage's question; it is changed in place.
    paths : mapping of str to str
        Field of the route for each field of the stance, as in `RouteStage`.
    """
    place = (error.field or "").removeprefix("stance.")
    for part, path in paths.items():
        rest = place.removeprefix(part)
        if place.startswith(part) and rest[:1] in ("", ".", "["):
            error.field = path + rest
    return error
