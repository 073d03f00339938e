"""The check of a bound: against exhaustion by linear programs, and with changed certificates."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models.base import LimitError
from planner.certification import check_bound
from tests.suite.helpers.certificates import (
    at_end,
    best_climb,
    every_state,
    is_move,
    proof_of,
    random_climb,
    solved_state,
)

SEEDS = st.integers(0, 10_000)


@cache
def solved(seed, **sizes):
    """A random climb, the answers of all its states, and its best least load factor."""
    climb = random_climb(seed, **sizes)
    answers = {state: solved_state(climb, state) for state in every_state(climb)}
    return climb, answers, *best_climb(climb, {s: factor for s, (factor, _) in answers.items()})


def small(seed):
    return solved(seed, placements=5, bodies=2, reach=0.75)


def open_climb():
    """A climb of seven states at best, and its answers."""
    found = solved(34, placements=5, bodies=3, reach=0.6)
    assert len(found[3]) == 7
    return found


@pytest.mark.parametrize("sizes", [(5, 2, 0.75), pytest.param((5, 3, 0.7), marks=pytest.mark.slow)])
@settings(max_examples=2)
@given(seed=SEEDS, multiple=st.floats(0.1, 4.0))
def test_agrees_with_exhaustion(sizes, seed, multiple):
    placements, bodies, reach = sizes
    climb, answers, best, _ = solved(seed, placements=placements, bodies=bodies, reach=reach)
    multiples = [multiple, *((best * (1.0 - 1e-9), best * (1.0 + 1e-7)) if best > 0.0 else ())]
    for each in multiples:
        for backward in (False, True):
            proof = replace(proof_of(climb, each, answers), backward=backward)
            assert check_bound(proof).proven == (each > best)


@settings(max_examples=4)
@given(seed=SEEDS, share=st.floats(0.1, 1.0))
def test_accepts_nothing_where_there_is_a_route(seed, share):
    """Whatever the directions are: those of this very climb, axes, at random, and none."""
    climb, answers, best, _ = small(seed)
    if best <= 0.0:
        return
    rng = np.random.default_rng(seed)
    members = [members for _, members in answers]
    guessed = replace(
        climb,
        multiple=share * best * (1.0 - 1e-9),
        directions=np.vstack([climb.directions, rng.normal(size=(30, 6))]),
        own_members=np.array(members * 2),
        own_directions=np.vstack(
            [[direction for _, direction in answers.values()], rng.normal(size=(len(members), 6))]
        ),
    )
    found = check_bound(guessed)
    assert not found.proven
    body, *members = found.open_end.tolist()
    assert at_end((body, tuple(members)), climb.goal_bodies, climb.goal_members)


@settings(max_examples=4)
@given(seed=SEEDS)
def test_does_not_depend_on_the_order(seed):
    climb, answers, best, _ = small(seed)
    proof = proof_of(climb, 1.0, answers)
    rng = np.random.default_rng(seed)
    places, bodies = rng.permutation(len(climb.base)), rng.permutation(len(climb.wrenches))
    limbs = rng.permutation(len(climb.limbs))
    now = np.append(np.argsort(places), -1)
    corners = [np.arange(climb.parts[i], climb.parts[i + 1]) for i in range(len(climb.parts) - 1)]
    order = [part for p in places for part in range(climb.hands[p], climb.hands[p + 1])]
    vertices = np.concatenate([corners[part] for part in order])
    moved = replace(
        proof,
        points=climb.points[vertices],
        rows=climb.rows[vertices],
        parts=np.cumsum([0, *(len(corners[part]) for part in order)]),
        hands=np.cumsum([0, *np.diff(climb.hands)[places]]),
        base=climb.base[places],
        room=climb.room[places],
        wrenches=climb.wrenches[bodies],
        moments=climb.moments[np.ix_(bodies, limbs, places)],
        reached=climb.reached[np.ix_(places, bodies, limbs)],
        apart=climb.apart[np.ix_(places, places)],
        shifts=np.argsort(bodies)[climb.shifts][:, ::-1],
        start_bodies=climb.start_bodies[bodies],
        goal_bodies=climb.goal_bodies[bodies],
        own_members=now[proof.own_members][:, limbs],
        own_directions=proof.own_directions,
    )
    one, other = check_bound(proof), check_bound(moved)
    assert one.proven == other.proven == (best < 1.0)
    if one.proven:
        assert one[:3] == other[:3]


def test_counts_the_states_that_are_connected():
    climb, answers, best, _ = open_climb()
    multiple = best * 1.001
    found = check_bound(proof_of(climb, multiple, answers))
    held = {state for state, (factor, _) in answers.items() if factor >= multiple}
    connected = {s for s in held if at_end(s, climb.start_bodies, climb.start_members)}
    waiting = list(connected)
    while waiting:
        state = waiting.pop()
        more = {other for other in held - connected if is_move(climb, state, other)}
        connected |= more
        waiting += more
    assert found.proven
    assert found.connected == len(connected)
    assert found.ruled_out > 0


def bottleneck():
    """A proof a little above the best climb, and a state that the best climb cannot do without."""
    climb, answers, best, route = open_climb()
    proof = proof_of(climb, best * 1.01, answers)
    assert check_bound(proof).proven
    return proof, route, min(route, key=lambda state: answers[state][0])


def test_notices_that_a_direction_is_gone():
    proof, _, (_, members) = bottleneck()
    kept = (proof.own_members != members).any(axis=1)
    for others in (kept, np.zeros(len(kept), dtype=bool)):
        less = replace(
            proof,
            own_members=proof.own_members[others],
            own_directions=proof.own_directions[others],
        )
        assert not check_bound(less).proven


def test_a_direction_of_huge_numbers_rules_out_no_less_than_none():
    climb, answers, best, _ = open_climb()
    claimed = proof_of(climb, 1.01 * best, answers)
    huge = claimed.directions.copy()
    huge[len(huge) // 2, 0] = 1e200
    less = np.delete(claimed.directions, len(huge) // 2, axis=0)
    found = [check_bound(replace(claimed, directions=each)).proven for each in (huge, less)]
    assert found[0] >= found[1]


def test_notices_a_lower_multiple():
    proof, _, _ = bottleneck()
    assert not check_bound(replace(proof, multiple=proof.multiple / 1.011)).proven


def test_notices_that_hands_hold_more():
    proof, _, (_, members) = bottleneck()
    base = proof.base.copy()
    base[[p for p in members if p >= 0], 2] += 1.0
    stronger = replace(proof, base=base)
    assert not check_bound(stronger).proven


def test_notices_another_reach_shift_or_distance():
    """A proof for a wall that has no climb is none for a wall on which there is one."""
    climb, answers, best, route = open_climb()
    multiple = best * 0.99
    assert not check_bound(proof_of(climb, multiple, answers)).proven
    reached, apart = climb.reached.copy(), climb.apart.copy()
    goal, members = route[-1]
    reached[list(members), goal] = False
    apart[members[0], :] = apart[:, members[0]] = False
    for less in ({"reached": reached}, {"shifts": climb.shifts[:0]}, {"apart": apart}):
        closed = replace(climb, **less)
        proof = proof_of(closed, multiple, answers)
        assert check_bound(proof).proven
        (name,) = less
        assert not check_bound(replace(proof, **{name: getattr(climb, name)})).proven


def test_a_climb_from_a_stance():
    """From given placements fewer climbs are left, and only these count."""
    climb, answers, best, route = open_climb()
    fixed = replace(climb, start_members=np.array(route[0][1]))
    factors = {state: factor for state, (factor, _) in answers.items()}
    assert best_climb(fixed, factors)[0] == best
    proof = proof_of(fixed, best * 1.001, answers)
    assert check_bound(proof).proven
    assert not check_bound(proof_of(fixed, best * 0.999, answers)).proven
    # a placement that is out of reach begins no climb
    reached = climb.reached.copy()
    reached[route[0][1][0], route[0][0], 0] = False
    assert check_bound(replace(proof_of(fixed, 0.1, answers), reached=reached)).proven


def test_a_climb_by_hand():
    """Two limbs on three hands that pull straight up: 0.8 times the body's weight is the best.

    From (0, 1) to (2, 1) the left hand has to leave the right one alone on the second. Else (0, ·),
    (0, 2), (·, 2) and (1, 2) are left; (·, 1) and (1, ·) are ruled out.
    """
    up = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    climb = replace(
        random_climb(0, placements=3, bodies=1, limbs=2, reach=2.0),
        multiple=0.9,
        points=np.array([0.0, 1.2, 0.0, 0.8, 0.0, 1.5])[:, None] * up,
        rows=np.zeros((6, 0)),
        parts=np.array([0, 2, 4, 6]),
        hands=np.arange(4),
        base=np.zeros((3, 6)),
        room=np.zeros((3, 0)),
        wrenches=up[None],
        moments=np.zeros((1, 2, 3, 3)),
        apart=~np.eye(3, dtype=bool),
        start_members=np.array([0, 1]),
        goal_members=np.array([2, 1]),
        directions=up[None],
    )
    assert check_bound(climb) == (True, 5, 2, None)
    # what is exactly held counts as held
    for multiple, proven in ((0.8 + 1e-9, True), (0.8, False), (0.7, False)):
        assert check_bound(replace(climb, multiple=multiple)).proven == proven


def test_refuses_more_states_than_it_can_number():
    climb = random_climb(1, placements=700, bodies=2, limbs=7, reach=0.0)
    with pytest.raises(LimitError, match="700 placements, 2 bodies and 7 limbs"):
        check_bound(climb)


@pytest.mark.slow
@settings(max_examples=18)
@given(seed=SEEDS, multiple=st.floats(0.1, 3.0))
def test_agrees_with_exhaustion_on_larger_walls(seed, multiple):
    climb, answers, best, _ = solved(seed, placements=6, bodies=3, limbs=4, reach=0.5)
    for each in (multiple, *((best * (1.0 - 1e-9), best * (1.0 + 1e-7)) if best > 0.0 else ())):
        assert check_bound(proof_of(climb, each, answers)).proven == (each > best)
