"""Loads recovered and checked, by what is made for that before there are loads."""

from __future__ import annotations

from collections.abc import Hashable
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, BoundedStore
from planner import programs
from planner.explanation import LimitUse, joint_name, joint_sentences, off_sentences, warnings
from planner.floating import WristSolution
from planner.prepare import HandBatch, PreparedStance, Sets
from planner.result import (
    Finding,
    HandPlan,
    LoadRecovery,
    PlanArrays,
    WristPlan,
    recover_floating_hand,
)
from planner.scene import findings, link_findings, scene_of, unit_findings
from planner.verification import Check

__all__ = [
    "PreparedChecks",
    "Reading",
    "idle_joints",
    "prepare_checks",
    "read_loads",
    "scene_findings",
]


class PreparedChecks(NamedTuple):
    """What is known of reading and checking before there are loads.

    Attributes
    ----------
    recovery : LoadRecovery or None
        Reads loads; None where a wrist floats.
    check : Check
        What every plan must pass.
    idle : tuple of LimitUse
        How much of their joints' torque limbs without a hand use.
    findings : tuple of Finding
        What is odd about the stance as a scene, and about the sizes of the question's numbers.
    oddities : tuple of str
        What is odd about it, these included, in words.
    """

    recovery: LoadRecovery | None
    check: Check
    idle: tuple[LimitUse, ...]
    findings: tuple[Finding, ...]
    oddities: tuple[str, ...]


RECOVERIES: Final[BoundedStore[Hashable, LoadRecovery]] = BoundedStore("load recoveries", 64)
"""What reads loads, by the hands and the cap on tensions: those asked for last."""


def prepare_checks(prepared: PreparedStance) -> PreparedChecks:
    """Return what reading and checking plans of a stance needs.

    It changes nothing but a store that threads may share, so it may run beside a solver.

    Raises
    ------
    InvalidInputError
        If the stance cannot be; the field is relative to the question.
    """
    hands, stance, batch = prepared.hands, prepared.question.stance, prepared.batch
    odd = (*scene_findings(prepared), *unit_findings(prepared.question))
    where = prepared.where
    return PreparedChecks(
        recovery=None if hands.floating else _recovery(prepared),
        check=Check(prepared.question, batch, where),
        idle=idle_joints(prepared),
        findings=odd,
        oddities=(
            *(each.message for each in odd),
            *warnings(stance, batch),
            *off_sentences(where),
            *joint_sentences(prepared.question, where),
        ),
    )


def scene_findings(prepared: PreparedStance) -> tuple[Finding, ...]:
    """Return what is odd about a stance as a scene, and about its links where joints are known.

    Raises
    ------
    InvalidInputError
        If the stance cannot be; the field is relative to the question.
    """
    scene, where = scene_of(prepared.question.stance, prepared.batch.hands), prepared.where
    odd = findings(scene)
    return odd if where is None else (*odd, *link_findings(scene, where.angles))


def _recovery(prepared: PreparedStance) -> LoadRecovery:
    batch, hands = prepared.batch, prepared.hands
    made = partial(LoadRecovery, batch, hands.spaces, hands.scaled)
    cap = prepared.question.limits.tendon_tension
    return made() if hands.own else RECOVERIES.get((batch.hands, cap), made)


def idle_joints(prepared: PreparedStance) -> tuple[LimitUse, ...]:
    """Return how much of their joints' torque limbs without a hand use."""
    where = prepared.where
    idle = {} if where is None else where.idle(prepared.question.stance)
    return tuple(
        LimitUse(joint_name(limb, *joint), abs(float(torque)), float(most))
        for limb, loads in idle.items()
        for joints in (loads.driven,)
        for *joint, torque, most in zip(
            joints.names, joints.sliding, joints.gravity, joints.limits, strict=True
        )
    )


class Reading(NamedTuple):
    """What loads do, recovered and checked.

    Attributes
    ----------
    loads : tuple of ndarray
        y of each hand.
    arrays : PlanArrays
        The plan's numbers.
    hands : tuple of HandPlan
        The same hand by hand, where a wrist floats; none yet where none does.
    used : ndarray, shape (sum of nl,)
        Utilisation of every limit row, hand by hand.
    effort : float
    utilisation : float
        The largest of the hands.
    whole : float
        The largest of these, and of the joints of limbs without a hand.
    wrong : tuple of str
        What the check says is wrong with it.
    """

    loads: tuple[Array, ...]
    arrays: PlanArrays
    hands: tuple[HandPlan, ...]
    used: Array
    effort: float
    utilisation: float
    whole: float
    wrong: tuple[str, ...]


def read_loads(
    prepared: PreparedStance,
    checks: PreparedChecks,
    sets: Sets,
    loads: tuple[Array, ...],
    search: WristSolution | None = None,
) -> Reading:
    """Return what loads do, recovered and checked.

    Parameters
    ----------
    prepared : PreparedStance
    checks : PreparedChecks
    sets : Sets
        That the loads are of.
    loads : tuple of ndarray
        y of each hand.
    search : WristSolution, optional
        Where floating wrists are.
    """
    hands: tuple[HandPlan, ...] = ()
    if checks.recovery is None:
        hands = tuple(_read_hand(prepared, sets, i, y, search) for i, y in enumerate(loads))
        arrays, used = PlanArrays.of(hands), programs.used(sets.data, loads)
        effort = programs.used_effort(sets.data, loads)
    else:
        arrays, used, effort = checks.recovery.read(loads)
    utilisation = float(np.maximum.reduce(arrays.utilisations))
    whole = max([utilisation, *(each.utilisation for each in checks.idle)])
    wrong = checks.check.problems(arrays, whole, prepared.wrench, effort)
    return Reading(loads, arrays, hands, used, effort, utilisation, whole, tuple(wrong))


def _read_hand(
    prepared: PreparedStance, sets: Sets, index: int, y: Array, search: WristSolution | None
) -> HandPlan:
    """Read one hand of a stance of which some float."""
    limb, settled = prepared.limbs[index], prepared.batch.hands[index]
    space, wrist = sets.spaces[index], prepared.hands.wrists[index]
    if wrist is None or search is None:
        alone, own = HandBatch.of((settled,)), (space,)
        return LoadRecovery(alone, own).read((y,))[0].hands((limb,), alone, own)[0]
    pose = WristPlan(y, search.point.palms[index] or "off", search.rounds, search.error)
    return recover_floating_hand(limb, settled, wrist.hand, space, pose)
