"""Prove that a body wrench is infeasible: at any utilisation, or within a cap (Farkas certificate).

Limits at a cap are hard rows like any other, so both cases are one proof. Where the rows of one
hand contradict each other, or the wrench prescribed for that hand, the certificate's direction is
zero in the body's components: the stance is infeasible whatever the body needs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.fixed_wrist import TENDON_TENSION
from hand_models.wrench_spaces import WrenchSpace
from planner import programs
from planner.explanation.active_limits import TOLERANCES, LimitUse, limit_name
from planner.explanation.infeasibility import (
    BODY_ROWS,
    HELD_WRENCH,
    HardRowSystem,
    ranked,
)
from planner.explanation.irreducible_infeasible_set import (
    balance_alone,
    blocks_up_to,
    irreducible_set,
    sufficient_alone,
)
from planner.prepare import FORCE_CAP, PASSIVE_JOINT, TENSION_CHANGE, PreparedStance, Sets
from planner.programs import (
    JOINT_FORCE,
    JOINT_TORQUE,
    LOAD_UNIT,
    WRENCH_UNIT,
    Outcome,
    StanceData,
)
from planner.question import Limits
from planner.result import Certificate, LimitName

__all__ = ["certify", "certify_idle"]

LEAST_DIRECTION: Final = 1e-6
"""Length, in the body's six components, below which a direction counts as zero."""


def certify(
    prepared: PreparedStance,
    sets: Sets,
    known: Outcome,
    cap: float | None = None,
    *,
    nearest: Outcome | None = None,
) -> Certificate | None:
    """Return a verified infeasibility certificate for a body wrench.

    With a direction d and multipliers λ ≥ 0 of the hard rows, `HardRowSystem.bound` bounds what
    loads can exert along d; that bound must be below d · W for the body wrench W. If the question
    asks for no explanation, the irreducible infeasible subset is not searched, only whether it is
    empty.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    sets : Sets
        Wrench spaces of the hands, and their scaled rows.
    known : Outcome
        Outcome of the infeasible program. Its multipliers are the proof where the nearest loads
        give none, or the deadline has expired.
    cap : float, optional
        Cap on the utilisation within which the wrench is infeasible; by default at any utilisation.
    nearest : Outcome, optional
        Loads whose body wrench is nearest to W, with prescribed hand wrenches met; computed by
        default.

    Returns
    -------
    Certificate or None
        None if no multipliers prove infeasibility.
    """
    (spaces, data), limbs, held = sets, prepared.limbs, prepared.hands.held
    limits, explain = prepared.question.limits, prepared.question.explain
    # limit rows at a cap count as hard rows; without one they do not count
    rows = data if cap is None else data.capped(cap)
    system = _system(rows, limbs, spaces, held, capped=cap is not None)
    if nearest is None:
        nearest = programs.nearest_body(rows)
    missing: Array | None = None
    if nearest.solved:
        missing = data.wrench - programs.body_wrench(data, nearest.loads)
        missing[BODY_ROWS:] = 0.0
        found: tuple[Array, Array] | None = _polished(system, missing)
    else:
        found = _contradiction(system, limbs)
    if found is None or not system.proves(*found):
        found = _multipliers(known, capped=cap is not None)
    if found is None or not system.proves(*found):
        return None
    direction, multipliers = found
    weights = system.weights(direction, multipliers)
    if explain:
        irreducible = irreducible_set(system, weights)
    else:
        irreducible = () if balance_alone(system) else None
    up_to = None
    if irreducible is not None:
        size = LOAD_UNIT * blocks_up_to(system, irreducible)
        # [N] what is proven beyond is the reciprocal of a residual that is rounding alone
        up_to = min(size, max(1e9, LOAD_UNIT * system.box)) if math.isfinite(size) else None
        irreducible = _in_order(irreducible, limits, spaces)
    return Certificate(
        utilisation=cap,
        direction=direction[:BODY_ROWS] / WRENCH_UNIT,
        held={
            limb: mine.T @ direction[BODY_ROWS:] / WRENCH_UNIT
            for limb, mine in zip(limbs, held, strict=True)
            if mine.any()
        },
        supremum=system.bound(direction, multipliers),
        needed=float(direction @ data.wrench),
        shortfall=None if missing is None else missing[:BODY_ROWS] * WRENCH_UNIT,
        nearest=None if missing is None else (data.wrench - missing)[:BODY_ROWS] * WRENCH_UNIT,
        blocking=_in_order(
            (name for name in ranked(weights) if name.limit != HELD_WRENCH), limits, spaces
        ),
        irreducible=irreducible,
        irreducible_up_to=up_to,
        sufficient=sufficient_alone(system, irreducible),
        wrench_spaces=dict(zip(limbs, spaces, strict=True)),
    )


def _system(
    data: StanceData,
    limbs: Sequence[str],
    spaces: Sequence[WrenchSpace],
    held: Sequence[Array],
    *,
    capped: bool,
) -> HardRowSystem:
    """Stack the hands' rows, with their names."""
    owners = {
        int(row): limb
        for limb, mine in zip(limbs, held, strict=True)
        for row in np.flatnonzero(np.abs(mine).any(axis=1))
    }
    rows, balance = data.rows, len(data.wrench)
    return HardRowSystem(
        G=rows.whole[:balance],
        g=np.asarray(sum(hand.g for hand in data.hands)),
        wrench=data.wrench,
        H=rows.whole[balance + rows.limits :],
        h=rows.rest[rows.limits :],
        names=tuple(
            limit_name(limb, row)
            for limb, space in zip(limbs, spaces, strict=True)
            for row in space.rows[0 if capped else len(space.s) :]
        ),
        given=tuple(LimitName(owners[row], None, None, HELD_WRENCH) for row in range(len(owners))),
        box=programs.load_box(data.wrench),
    )


def certify_idle(used: LimitUse, cap: float, alone: bool | None) -> Certificate:
    """Return the certificate that a joint of a limb without a hand exceeds its limit at a cap.

    Parameters
    ----------
    used : LimitUse
        Load and capacity of the joint.
    cap : float
        Cap on the utilisation.
    alone : bool or None
        Whether everything else is within the cap; None if unknown.
    """
    return Certificate(
        utilisation=cap,
        direction=np.zeros(6),
        held={},
        supremum=cap - used.utilisation,
        needed=0.0,
        shortfall=None,
        nearest=None,
        blocking=(used.name,),
        irreducible=(used.name,),
        irreducible_up_to=None,
        sufficient=None if alone is None else (used.name,) * alone,
        wrench_spaces={},
    )


def _in_order(
    names: Iterable[LimitName], limits: Limits, spaces: Sequence[WrenchSpace]
) -> tuple[LimitName, ...]:
    """Return what a caller can change first: own caps, then other limits, then hard rows.

    Within each of these the order stays.
    """
    capacities = {row.limit for space in spaces for row in space.rows if row.kind == "limit"}

    def rank(name: LimitName) -> int:
        if _is_own(name, limits):
            return 0
        return 1 if name.limit in capacities else 2

    return tuple(sorted(names, key=rank))


def _is_own(name: LimitName, limits: Limits) -> bool:
    """Return whether the caller has set a limit."""
    if name.limit == TENDON_TENSION:
        return limits.tendon_tension is not None
    if name.limit in (JOINT_TORQUE, JOINT_FORCE, PASSIVE_JOINT):
        own = limits.joint_torque
        return name.limb in own if isinstance(own, Mapping) else own is not None
    return name.limit in (FORCE_CAP, HELD_WRENCH, TENSION_CHANGE)


def _contradiction(system: HardRowSystem, limbs: Sequence[str]) -> tuple[Array, Array] | None:
    """Return d and λ that show that one hand's rows and given wrench have no loads, if so."""
    for limb in limbs:
        mine = [name for name in system.constraints if name.limb == limb]
        found = system.least_violation(mine, balance=False)
        if found is not None and found.gain > TOLERANCES.broken:
            return found.direction, found.multipliers
    return None


def _multipliers(outcome: Outcome, *, capped: bool) -> tuple[Array, Array] | None:
    """Return a unit d and λ from the multipliers of a program without a plan.

    Where d is next to none, rows contradict each other whatever the body needs.
    """
    if outcome.balance_dual is None:
        return None
    parts = [
        part
        for limit, hard in zip(outcome.limit_duals, outcome.hard_duals, strict=True)
        for part in ((limit, hard) if capped else (hard,))
    ]
    direction, multipliers = -outcome.balance_dual, np.maximum(np.concatenate(parts), 0.0)
    length, weight = float(np.linalg.norm(direction[:6])), float(multipliers.sum())
    if length > LEAST_DIRECTION * weight:
        return direction / length, multipliers / length
    direction[:6] = 0.0
    return (direction / weight, multipliers / weight) if weight > 0.0 else None


def _polished(system: HardRowSystem, missing: Array) -> tuple[Array, Array]:
    """Return a unit d near that of ``missing``, and λ ≥ 0, that prove the most.

    A vertex of max d·(W − g) − λ·h − X Σ|Gᵀd − Hᵀλ|, less a tenth of what is missing for turning d
    away: the error of an interior-point solution would be magnified by a box as large as X. The
    parts of d for given wrenches are free.
    """
    length = float(np.linalg.norm(missing))
    turning = 0.1  # part of what is missing that a turn by a unit must gain
    if length > 1e-9:  # nearer there is nothing to prove
        # in smaller units of the gain the box costs more than solvers have digits for
        found = system.program.near(
            missing[:BODY_ROWS] / length, turning * length, max(length, 1e-3)
        )
        if found is not None:
            size = float(np.linalg.norm(found.direction[:BODY_ROWS]))
            if size >= LEAST_DIRECTION:
                return found.direction / size, found.multipliers / size
    return np.zeros(len(missing)), np.zeros(len(system.h))
