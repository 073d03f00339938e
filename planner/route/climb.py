"""A route: a sequence of stances and moves, evaluated move by move.

A move takes one limb to its next hold. Before it, the body may shift on all the hands it has; then
the limb lifts (a stance without that hand); then it takes the new hold:

    start → [shift] → lift → place → [shift] → lift → place → …
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
"""Joint angles of a limb [rad]; ``solve`` if they are to be found."""


@dataclass(frozen=True, eq=False)
class Move:
    """Move of one limb to its next hold.

    Attributes
    ----------
    hand : HandOnHold
        The limb on its new hold.
    body : Pose, optional
        Where the body shifts to first, on the hands it has; B in W.
    joints : mapping of str to (ndarray or 'solve'), or 'solve'
        Of a route with joints: angles by limb [rad], of those on the rock from the shift on, of the
        limb that moves on its new hold. Limbs left out keep theirs, unless the body shifts or they
        move: then they are found.
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
    start : Stance
    moves : tuple of Move
    load : Load
        What the body weighs; the same all the way.
    limits : Limits
        Those of a hand count while it is on the rock.
    objective : {'max_margin', 'min_effort'}
        Of every stage.
    explain : bool
        As of every stage's question.
    want : frozenset of str
        Extras of every stage's question, beside its load factor.
    draws : tuple of ParameterSample, optional
        As of every stage's question.
    """

    name: str
    start: Stance
    moves: tuple[Move, ...]
    load: Load = field(default_factory=Load)
    limits: Limits = field(default_factory=Limits)
    objective: Objective = "max_margin"
    explain: bool = True
    want: frozenset[Want] = frozenset()
    draws: tuple[ParameterSample, ...] | None = None


@dataclass(frozen=True, eq=False)
class RouteStage:
    """One stance of a climb.

    Attributes
    ----------
    index : int
        From zero, in climbing order.
    move : int
        The move it belongs to, from one; zero for the start.
    phase : {'start', 'shift', 'lift', 'place'}
    limb : str or None
        The one that moves.
    question : Question
    paths : dict of str
        Where the route gives ``hands[i]`` and ``body`` of its stance.
    """

    index: int
    move: int
    phase: Phase
    limb: str | None
    question: Question
    paths: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class OutOfReach:
    """A stage without a plan: no joint angles put its hands in their places.

    Attributes
    ----------
    reason : str
        Which limb, and how far it is from there.
    """

    reason: str
    status: Literal["unreachable"] = "unreachable"
    utilisation: None = None
    load_factor: None = None
    load_factor_unbounded: Literal[False] = False
    load_factor_status: Literal["none"] = "none"
    limiting: None = None
    joint_utilisation: None = None
    spread: None = None
    warnings: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class RouteResult:
    """A climb, planned stage by stage.

    Attributes
    ----------
    route : Route
    stages : tuple of RouteStage
    plans : tuple of Plan or OutOfReach
        One for each stage.
    """

    route: Route
    stages: tuple[RouteStage, ...]
    plans: tuple[Plan | OutOfReach, ...]

    @property
    def status(self) -> str:
        """Status of the stage that is worst off; ``optimal`` where every stage is."""
        # each worse than the one before
        order = ("optimal", "overloaded", "infeasible", "unreachable", "failed")
        return max((p.status for p in self.plans), key=order.index)

    @property
    def feasible(self) -> bool:
        """True where every stage is ``optimal``."""
        return self.status == "optimal"

    @property
    def load_factor(self) -> float | None:
        """The least of all stages; None where one has none, or where there is no end to any."""
        factors: list[float] = []
        for p in self.plans:
            if p.load_factor is not None:
                factors.append(p.load_factor)
            elif not p.load_factor_unbounded:
                return None
        return min(factors, default=None)

    @property
    def load_factor_unbounded(self) -> bool:
        """True where the load factor of every stage is unbounded."""
        return all(p.load_factor_unbounded for p in self.plans)

    @property
    def load_factor_status(self) -> LoadFactorStatus:
        """Status of the least load factor of all stages: found, or why not."""
        found = {p.load_factor_status for p in self.plans}
        # that of the least is the first of these that any stage has
        order: tuple[LoadFactorStatus, ...]
        order = ("none", "not_finished", "not_asked", "at_least", "found", "unbounded")
        return next(status for status in order if status in found)

    @property
    def crux(self) -> int:
        """Index of the hardest stage: no way there, then no plan, then the largest utilisation."""
        return max(range(len(self.plans)), key=lambda i: _hardness(self.plans[i]))


def _hardness(answer: Plan | OutOfReach) -> tuple[int, float]:
    order = {"optimal": 0, "overloaded": 0, "failed": 1, "infeasible": 2, "unreachable": 3}
    used = answer.utilisation if answer.utilisation is not None else math.inf
    return order[answer.status], used


def stages(route: Route) -> Iterator[RouteStage]:
    """Yield the stances of a climb in order.

    Raises
    ------
    InvalidInputError
        If a move's limb holds nothing to start with, or is the only one that does, or a hand
        cannot be where it is; the field is relative to the route.
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
            limits=structs.replace(route.limits, per_hand=caps),
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
                "the only hand on the rock cannot be lifted", field=f"moves[{number - 1}].limb"
            )
        given = dict(move.joints) if isinstance(move.joints, Mapping) else {}
        if joints is None and given:
            raise InvalidInputError(
                "requires stance.joints in the start stance, angles or 'solve'",
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
    """Return the error of a stage's question with its field as the route names it."""
    place = (error.field or "").removeprefix("stance.")
    for part, path in paths.items():
        rest = place.removeprefix(part)
        if place.startswith(part) and rest[:1] in ("", ".", "["):
            error.field = path + rest
    return error
