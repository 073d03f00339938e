"""Other poses of the body for a move that has no plan where the search has put it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.climbs.move_checks import MoveChecks
from planner.climbs.routing import ClimbStep
from planner.screening import StanceIndices, solve_stance
from planner.search import State, Wall

__all__ = ["detours"]


def detours(
    wall: Wall, checks: MoveChecks, states: Sequence[State], step: ClimbStep
) -> Iterator[list[State]]:
    """Yield climbs in which one move is made from another pose of the body, the best first.

    Parameters
    ----------
    wall : Wall
    checks : MoveChecks
    states : sequence of State
        The climb.
    step : ClimbStep
        The move.
    """
    if step.lift is None or step.place is None:
        return
    at, most = list(states).index(step.lift), 6  # climbs
    before, limb = step.shifts[-1], step.limb
    used = [*before.members, step.place.members[limb]]
    there = wall.reach.reached[used][:, :, [*range(len(before.members)), limb]]
    fits = np.logical_and.reduce([there[i, :, i] for i in range(len(used))])
    fits[before.body] = False
    origins = np.array([body.position for body in wall.bodies])
    away = np.linalg.norm(origins - origins[before.body], axis=1)
    bodies = np.flatnonzero(fits)
    near = bodies[np.argsort(away[bodies], kind="stable")][: 4 * most]
    rated = list[tuple[float, list[State]]]()
    for body in near.tolist():
        moved = [state._replace(body=body) for state in (before, step.lift, step.place)]
        if not (checks.passes(moved[0], moved[1]) and checks.passes(moved[1], moved[2])):
            continue
        members = np.array([state.members for state in moved])
        asked = StanceIndices(np.full(len(moved), body), members)
        wrenches = wall.screening.needed(asked)
        factors = [
            solve_stance(wall.screening.hands, row[row >= 0], wrench).factor
            for row, wrench in zip(members, wrenches, strict=True)
        ]
        if np.isfinite(factors).all():
            first = at - len(step.shifts)
            climb = [*states[: first + 1], *moved, *states[at + 1 :]]
            rated.append((min(factors), climb))
    for _, climb in sorted(rated, key=lambda each: -each[0])[:most]:
        yield climb
