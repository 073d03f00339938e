"""Check a plan that is executed as it is: its equilibrium on displaced hands, from its numbers.

Nothing is shared with the search for the equilibrium. Tile loads, tendons and wrenches of all hands
are recomputed from the poses of the wrists, law by law, as of any plan. The hands must balance the
body wrench, and each limb must pull its hand as the hand pulls the rock. Limits may be exceeded:
the reported utilisation, and the force by which a tile is dragged, are compared with the
recomputed ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces import WRENCH_SCALE
from planner.result import HandPlan, OpenLoopSample, PlanArrays
from planner.verification.check import Check
from planner.verification.residuals import TOLERANCES, allowed_errors

__all__ = ["execution_problems"]


def execution_problems(
    check: Check, hands: Sequence[HandPlan], sample: OpenLoopSample, body_wrench: Array
) -> list[str]:
    """Check an equilibrium of displaced hands; return an error message for each failure.

    Parameters
    ----------
    check : Check
        Check of plans on the hands as they have closed, displaced.
    hands : sequence of HandPlan
        Loads of the hands in equilibrium, and their wrists with twists and pose targets.
    sample : OpenLoopSample
        The reported outcome.
    body_wrench : ndarray, shape (6,)
        Wrench that the rock must exert on the robot, in B [N, N·m].
    """
    found, arrays = list[str](), PlanArrays.of(hands)
    with np.errstate(invalid="ignore", over="ignore"):
        joints = check.joints(found, arrays.wrenches, body_wrench)
        residuals, again, used = check.recompute(found, arrays, joints)
        allowed = allowed_errors(check.known, arrays)
        for residual in residuals:
            if residual.kind == "zero":
                found.extend(residual.off(allowed))
    worst, said = max(float(used.max()), check.idle(joints), 0.0), sample.utilisation
    if said is None or not abs(worst - said) <= TOLERANCES.utilisation * max(1.0, worst):
        found.append(f"utilisation is {worst:.8g}, not {said}")
    rubs = check.settled.tiles.holding(again.loads)[0].values
    dragged = max(-float(rubs.min()), 0.0)
    if sample.dragged is None or not abs(dragged - sample.dragged) <= TOLERANCES.dragged:
        found.append(f"a tile is dragged backwards by {dragged:.6g} N, not {sample.dragged}")
    found.extend(check.unbalanced(arrays.wrenches, body_wrench))
    found.extend(_unequal_pulls(check, arrays, np.array(sample.body_twist, dtype=float)))
    return found


def _unequal_pulls(check: Check, arrays: PlanArrays, body: Array) -> Iterator[str]:
    """Yield hands whose limb does not pull as they pull the rock, with B displaced by a twist."""
    stiffness = check.question.stance.limb_stiffness
    carried = -(check.carry.T @ body).reshape(-1, len(body))
    hands = zip(check.limbs, arrays.wrists, arrays.wrenches, carried, strict=True)
    for limb, wrist, wrench, step in hands:
        off = np.inf
        if stiffness is not None and wrist is not None and wrist.pose_target is not None:
            pull = np.array(stiffness.each) * (wrist.pose_target + step - wrist.twist)
            off = np.abs((pull - wrench) * WRENCH_SCALE).max()
        if not off <= TOLERANCES.pull:
            yield f"{limb}: its limb pulls with {off:.3g} N more or less than it pulls the rock"
