"""Plans of least hazard, against cutting planes by HiGHS, by hand, and against other objectives."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose, UnsupportedError
from hand_models.tile import Surface, weibull_modulus
from planner import programs
from planner.programs import CAP_SLACK
from planner.question import Load, Question
from planner.result import Plan
from planner.solving import plan
from planner.solving.objectives import LeastHazard
from tests.suite.helpers import peer
from tests.suite.helpers.fingernails import hung, one_hand, step
from tests.suite.helpers.stances import (
    ROCK,
    TILE_60N,
    ask,
    complying,
    moved,
    on_wall,
    random_question,
)

FEW, MANY = 6, 60
TOLERANCE = 0.02

LIGHT = Load(mass=60.0)


@cache
def held_questions(count: int) -> list[tuple[int, Question, Plan]]:
    """The first random questions that are held within the limits, and their plans."""
    found = []
    for seed in range(20 * count):
        question = random_question(seed)
        answer = plan(question)
        if answer.status == "optimal":
            found.append((seed, question, answer))
        if len(found) == count:
            break
    return found


def reliable(question: Question, **kwargs) -> Question:
    return replace(question, objective="max_reliability", **kwargs)


def law_of(surface: Surface) -> tuple[float, float]:
    """Weibull modulus; hazard of a tile at its strength: a sixth if that is a weakest of six."""
    m = weibull_modulus(surface.shear_scatter / surface.shear_limit)
    return m, math.gamma(1 + 1 / m) ** m / (6.0 if surface.name in ("rock", "sandpaper-36") else 1)


def least_hazard(question: Question, cap: float) -> tuple[float, float]:
    """Bounds of the least hazard, from tangents to each tile's power (HiGHS)."""
    sets = peer.spaces(question)
    r = peer.rows(question, sets)
    names, laws = [], []
    for hand, space in zip(question.stance.hands, sets, strict=True):
        for row in space.rows[: len(space.s)]:
            tile = row.limit in ("shear", "pull_off")
            names.append((hand.limb, row.finger, row.phalanx) if tile else None)
            laws.append(law_of(hand.surface))
    tiles = sorted({name for name in names if name is not None})
    n, count = r.L.shape[1], len(tiles)
    m, weights = np.array([laws[names.index(tile)] for tile in tiles]).T
    # unknowns: y, the tiles' uses and their hazards
    A, b = [], []
    L, l0 = r.L / r.s[:, None], r.l0 / r.s
    for name, row, rest in zip(names, L, l0, strict=True):
        line = np.zeros(n + 2 * count)
        line[:n] = row
        A.append(line.copy())
        b.append(cap - rest)
        if name is not None:
            line[n + tiles.index(name)] = -1.0
            A.append(line)
            b.append(-rest)
    A += list(np.column_stack([r.H, np.zeros((len(r.h), 2 * count))]))
    b += list(r.h)
    E = np.column_stack([r.B, np.zeros((6, 2 * count))])
    e = question.needed_wrench() - r.b
    cost = np.concatenate([np.zeros(n + count), np.ones(count)])
    low = [(None, None)] * n + [(0.0, None)] * (2 * count)

    def tangents(uses: np.ndarray) -> None:
        parts = weights * uses**m
        steep = m * weights * uses ** (m - 1.0)
        for i, (use, slope, part) in enumerate(zip(uses, steep, parts, strict=True)):
            line = np.zeros(n + 2 * count)
            line[n + i], line[n + count + i] = slope, -1.0
            A.append(line)
            b.append(slope * use - part)

    for share in np.linspace(0.1, 1.0, 8):
        tangents(np.full(count, share * cap))
    most = np.inf
    for _ in range(60):
        found = peer.solve(cost, np.array(A), np.array(b), E, e, low)
        assert found.status == 0, found.message
        uses = np.zeros(count)
        used = L @ found.x[:n] + l0
        for name, use in zip(names, used, strict=True):
            if name is not None:
                uses[tiles.index(name)] = max(uses[tiles.index(name)], use)
        most = min(most, float((weights * uses**m).sum()))
        if most - found.fun <= 2e-6 * max(most, 1e-3):
            break
        tangents(uses)
    return float(found.fun), most


@pytest.mark.parametrize(
    "count", [FEW, pytest.param(MANY, marks=pytest.mark.slow)], ids=["few", "all"]
)
def test_the_hazard_is_that_of_another_solver(count):
    for seed, question, before in held_questions(count):
        answer = plan(reliable(question))
        assert answer.status == "optimal", seed
        if answer.reliability is None:  # no tile is loaded
            continue
        least = peer.least_utilisation(question).fun
        cap = min(1.0, least + TOLERANCE * abs(least))
        low, high = least_hazard(question, cap + 0.5 * CAP_SLACK)
        found = answer.reliability.hazard
        assert found <= high * (1.0 + 1e-4), seed
        assert found >= low * (1.0 - 1e-4), seed
        assert answer.utilisation <= cap + 2.0 * CAP_SLACK, seed
        assert found <= answer.reliability.hazard_before * (1.0 + 1e-6), seed
        assert answer.reliability.utilisation_before == pytest.approx(before.utilisation, abs=1e-5)


def test_the_hazard_is_the_tiles_own():
    """Recomputed from what the reply says of each tile."""
    question = reliable(ask(on_wall()))
    answer = plan(question)
    assert answer.hands is not None
    used = [
        tile.utilisation
        for hand in answer.hands
        for finger in hand.fingers
        for tile in finger.tiles
        if tile.contact in ("face", "edge")
    ]
    found, (m, *others) = answer.reliability, answer.reliability.moduli
    assert others == [m] * 3
    assert found.hazard == pytest.approx(sum((u * math.gamma(1 + 1 / m)) ** m for u in used) / 6)
    assert found.no_slip == pytest.approx(math.exp(-found.hazard))
    assert found.hazard < 0.99 * found.hazard_before


def test_the_hazard_stays_where_the_world_turns_and_hands_change_places():
    stance = on_wall(off=0.35)
    hand = replace(stance.hands[0], surface=TILE_60N)
    stance = replace(stance, hands=(hand, *stance.hands[1:]))
    first = plan(reliable(ask(stance, load=LIGHT))).reliability
    turn = Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix()
    other = moved(stance, Pose(np.array([1.0, 2.0, 3.0]), turn))
    other = replace(other, hands=other.hands[::-1])
    second = plan(reliable(ask(other, load=LIGHT))).reliability
    assert second.hazard == pytest.approx(first.hazard, rel=1e-5)
    assert second.moduli == first.moduli[::-1]


def test_more_tolerance_brings_less_hazard():
    question = ask(on_wall(off=0.35), load=LIGHT)
    hazards_of = [plan(reliable(question, tolerance=t)).reliability.hazard for t in (0.01, 0.05, 1)]
    assert hazards_of[0] > hazards_of[1] * 1.001
    assert hazards_of[1] > hazards_of[2] * (1.0 - 1e-9)
    assert plan(reliable(question, tolerance=1.0)).utilisation <= 1.0 + CAP_SLACK


@pytest.mark.parametrize("name", ["tol", "max_iter"])
def test_a_program_that_is_not_proven_is_solved_with_the_solvers_own_scaling(name, monkeypatch):
    question = reliable(ask(on_wall()))
    right, tries = plan(question).reliability, []
    rough = {"tol": dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 0.1)}
    rough["max_iter"] = {"max_iter": 3}
    first, *later = programs.Hazard.settings
    monkeypatch.setattr(programs.Hazard, "settings", ({**first, **rough[name]}, *later))
    honest = programs.Hazard.run
    monkeypatch.setattr(programs.Hazard, "run", lambda each: tries.append(each) or honest(each))
    found = plan(question)
    assert found.status == "optimal"
    assert found.reliability.hazard == pytest.approx(right.hazard, rel=1e-5)
    assert len(tries) == (2 if name == "tol" else 1)


def test_a_plan_that_says_another_hazard_is_refused(monkeypatch):
    monkeypatch.setattr(LeastHazard, "_hazard", lambda each, arrays: 1.01 * each.before)
    answer = plan(reliable(ask(on_wall())))
    assert (answer.status, answer.reliability) == ("failed", None)
    assert "relative hazard" in answer.reason


def test_an_overloaded_stance_keeps_the_plan_of_least_utilisation():
    question = ask(on_wall(), load=Load(mass=150.0))
    answer = plan(reliable(question))
    assert (answer.status, answer.reliability) == ("overloaded", None)
    assert answer.utilisation == pytest.approx(plan(question).utilisation)


def test_nails_are_no_tiles():
    question = hung(one_hand(hold=step(0.004)), 50.0)
    answer = plan(reliable(question))
    assert answer.reliability is None
    assert (answer.status, answer.utilisation) == ("optimal", plan(question).utilisation)


def test_what_cannot_be_had_is_refused():
    question = ask(on_wall())
    with pytest.raises(UnsupportedError, match="fixed wrists on all hands") as caught:
        reliable(complying(question, ("rear_left",)))
    assert caught.value.field == "objective"
    with pytest.raises(InvalidInputError, match="requires the objective") as caught:
        replace(question, tolerance=0.1)
    assert caught.value.field == "tolerance"
    for tolerance in (0.0, 1.5, math.nan):
        with pytest.raises(InvalidInputError, match=r"must be 0\.001 to 1"):
            reliable(question, tolerance=tolerance)
    sure = replace(ROCK, shear_scatter=0.0)
    with pytest.raises(InvalidInputError, match=r"0\.05 to 0\.9 times shear_limit") as caught:
        reliable(ask(on_wall(surface=sure)))
    assert caught.value.field == "stance.hands[0].surface.shear_scatter"
