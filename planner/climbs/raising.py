"""Changes that raise the load factor of one stage: stronger rock, less mass, other placements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from msgspec import structs

from hand_models.base import InvalidInputError
from planner.climbs.outcome import Raise
from planner.question import Question
from planner.screening import StanceIndices, solve_stance
from planner.search import State, Wall
from planner.solving import plan

__all__ = ["raises"]


def raises(
    wall: Wall, state: State, stage: Question, factor: float
) -> tuple[tuple[Raise, Question], ...]:
    """Return changes of a stage that raise its load factor, the best first, and what is then asked.

    Parameters
    ----------
    wall : Wall
    state : State
        Of the stage.
    stage : Question
    factor : float
        Its load factor.

    Returns
    -------
    tuple of (Raise, Question)
        With another placement the joints are to be found.
    """
    found = list[tuple[Raise, Question]]()
    part = 0.1  # by which the rock under a hand is to be stronger, or the mass less
    for i, hand in enumerate(stage.stance.hands):
        hands = list(stage.stance.hands)
        hands[i] = replace(hand, surface=hand.surface.times(1.0 + part))
        stronger = replace(stage, stance=replace(stage.stance, hands=tuple(hands)))
        words = f"rock under {hand.limb} {100.0 * part:.0f} % stronger"
        found += _planned("strength", hand.limb, words, stronger)
    mass = stage.stance.robot.mass if stage.load.mass is None else stage.load.mass
    load = structs.replace(stage.load, mass=(1.0 - part) * mass)
    words = f"{part * mass:.1f} kg less mass"
    found += _planned("mass", None, words, replace(stage, load=load))
    found += _elsewhere(wall, state, stage)
    better = [each for each in found if each[0].load_factor > factor * (1.0 + 1e-6)]
    return tuple(sorted(better, key=lambda each: -each[0].load_factor))


def _planned(
    kind: str, limb: str | None, words: str, question: Question
) -> list[tuple[Raise, Question]]:
    try:
        factor = plan(question).load_factor
    except InvalidInputError:
        # a hand may close otherwise on stronger rock, and not at all
        return []
    if factor is None:
        return []
    return [(Raise(kind=kind, limb=limb, change=words, load_factor=factor), question)]


def _elsewhere(wall: Wall, state: State, stage: Question) -> list[tuple[Raise, Question]]:
    """Return the best other placement of each hand, by linear programs of those that look best."""
    found = list[tuple[Raise, Question]]()
    members, most = np.array(state.members), 8  # programs of a hand
    for limb, present in enumerate(state.members):
        others = np.delete(members, limb)
        fits = wall.reach.reached[:, state.body, limb] & wall.apart[:, others[others >= 0]].all(1)
        fits[members[members >= 0]] = False
        choices = np.flatnonzero(fits)
        if present < 0 or not len(choices):
            continue
        stances = np.repeat(members[None], len(choices), axis=0)
        stances[:, limb] = choices
        asked = StanceIndices(np.full(len(choices), state.body), stances)
        order = np.argsort(-wall.screening.bounds(asked), kind="stable")[:most]
        wrenches = wall.screening.needed(asked)
        factors = [
            solve_stance(wall.screening.hands, row[row >= 0], wrenches[i]).factor
            for i, row in zip(order, stances[order], strict=True)
        ]
        if not np.isnan(factors).all():
            k = int(np.nanargmax(factors))
            name, place = wall.robot.limbs[limb], int(choices[order[k]])
            x, y, z = wall.places[place].pose.position
            words = f"{name} at placement {place} instead, at ({x:.2f}, {y:.2f}, {z:.2f}) m"
            raised = Raise(kind="place", limb=name, change=words, load_factor=factors[k])
            moved = replace(wall.places[place], limb=name)
            hands = [moved if hand.limb == name else hand for hand in stage.stance.hands]
            stance = replace(stage.stance, hands=tuple(hands), joints="solve")
            found.append((raised, replace(stage, stance=stance)))
    return found
