"""Evaluate a route: plan every stage, in this process or in parallel worker processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from hand_models.base import Array, InvalidInputError, errors_under
from planner.explanation import ONE_OF_A_PLAN
from planner.prepare import settle_hand
from planner.processes import by_index, cores
from planner.result import Finding, Plan
from planner.robots import UnreachableError
from planner.route.climb import OutOfReach, Route, RouteResult, RouteStage, in_route, stages
from planner.route.knots import Climb
from planner.solving import plan

__all__ = ["evaluate", "must_touch"]


def evaluate(
    route: Route,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    climb: Climb | None = None,
) -> RouteResult:
    """Plan every stage of a route.

    Parameters
    ----------
    route : Route
        Climb whose stages are planned.
    workers : int, optional
        Number of worker processes. By default the number of cores for routes of at least 100
        stages, else one. With one, this process plans all stages itself.
    progress : callable, optional
        Called after each stage with (number of stages planned, number of stages).
    climb : Climb, optional
        Knots of the same route: stages are planned with its `Climb.stage_joints`.

    Returns
    -------
    RouteResult
        A plan for each stage, or `OutOfReach` if inverse kinematics finds no joint angles. Kinds
        of findings that a plan has at most once remain only in the stage with the largest value.
        A stage that the climb fails to reach has none about links whose joints were solved for.

    Raises
    ------
    InvalidInputError
        If a stance is not valid, or a move ends without contact; the field names the move.
    """
    found_joints = {} if climb is None else climb.stage_joints
    todo = tuple(_in_posture(each, found_joints.get(each.index)) for each in stages(route))
    if workers is None:
        # fewer stages are planned faster here than in processes that must first start
        workers = cores() if len(todo) >= 100 else 1
    plans: dict[int, Plan | OutOfReach] = {}
    make, count = partial(_planning, todo), min(workers, len(todo))
    for i, answer in by_index(make, lambda i: _plan_stage(todo[i]), len(todo), count):
        if isinstance(answer, InvalidInputError):
            raise answer
        plans[i] = answer
        if progress is not None:
            progress(len(plans), len(todo))
    found = [plans[i] for i in range(len(todo))]
    if climb is not None and climb.fails:
        found = [
            answer if i in found_joints else _without_guessed_posture(answer)
            for i, answer in enumerate(found)
        ]
    for kind in ONE_OF_A_PLAN:
        found = _said_once(found, kind)
    return RouteResult(route, todo, tuple(found))


def _in_posture(stage: RouteStage, joints: Mapping[str, Array] | None) -> RouteStage:
    """Return a stage with the joint angles of a climb, if the climb has come there."""
    if joints is None:
        return stage
    stance = replace(stage.question.stance, joints=joints)
    return replace(stage, question=replace(stage.question, stance=stance))


def _said_once(plans: Sequence[Plan | OutOfReach], kind: str) -> list[Plan | OutOfReach]:
    """Return plans of which only the one with the largest value has a finding of a kind."""
    said = {
        i: finding
        for i, answer in enumerate(plans)
        for finding in answer.findings
        if finding.kind == kind
    }
    # of stages alike but for rounding, to a micrometre, the first
    worst = max(said, key=lambda i: round(said[i].value, 6), default=-1)
    said.pop(worst, None)
    return [_without(answer, said[i]) if i in said else answer for i, answer in enumerate(plans)]


def _without_guessed_posture(answer: Plan | OutOfReach) -> Plan | OutOfReach:
    """Return an answer without findings about where links are in a posture that no climb has."""
    for finding in answer.findings:
        guessed = finding.field == "stance.joints"
        if guessed and finding.kind in ("link_in_rock", "links_collide"):
            answer = _without(answer, finding)
    return answer


def _without(answer: Plan | OutOfReach, finding: Finding) -> Plan | OutOfReach:
    """Return an answer without a finding and its warning."""
    return replace(
        answer,
        findings=tuple(each for each in answer.findings if each != finding),
        warnings=tuple(text for text in answer.warnings if text != finding.message),
    )


Answer = Plan | OutOfReach | InvalidInputError


def _planning(todo: Sequence[RouteStage]) -> Callable[[int], Answer]:
    """Return the function that plans a stage by its index; called in each process."""
    return lambda index: _plan_stage(todo[index])


def _plan_stage(stage: RouteStage) -> Answer:
    try:
        if stage.phase == "place":
            must_touch(stage)
        return plan(stage.question)
    except UnreachableError as error:
        return OutOfReach(error.message)
    except InvalidInputError as error:
        return in_route(error, stage.paths)


def must_touch(stage: RouteStage) -> None:
    """Refuse a move that ends in the air."""
    stance = stage.question.stance
    i = next(i for i, hand in enumerate(stance.hands) if hand.limb == stage.limb)
    with errors_under(f"hands[{i}]"):
        settled = settle_hand(stance.hands[i], stance)
        if not (settled.holding.any() or settled.palm.engaged):
            raise InvalidInputError(
                f"{stage.limb} does not touch this hold: move the hand closer to it", field="hold"
            )
