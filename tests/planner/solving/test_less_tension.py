"""Plans that give a little utilisation away for less tension, against other solvers."""

import math
from dataclasses import replace
from itertools import pairwise

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp

from hand_models.base import Pose
from hand_models.hand import Grasp
from hand_models.rock import Cylinder, Edge
from planner import programs
from planner.programs import tension_trade
from planner.question import HandOnHold, Limits, Load, Question, Stance
from planner.result import Plan
from planner.solving import KnownStance, plan
from planner.streaming import WrenchStream
from tests.suite.helpers import peer
from tests.suite.helpers.least import GIVEN_AWAY, WEIGHT, is_meant, most_meant
from tests.suite.helpers.named_programs import program_of
from tests.suite.helpers.stances import (
    PALM_TO_WALL,
    ROCK,
    ask,
    on_wall,
    program_data,
    random_question,
)

STRONGEST = 700.0
"""Of a tendon [N]."""

TOLERANCE = 1e-6


SLAB = np.array(
    [[math.cos(1.2217), 0, -math.sin(1.2217)], [0, 1, 0], [math.sin(1.2217), 0, math.cos(1.2217)]]
)
"""Axes of the body in W: up a slab of 20°."""


def wasteful(
    corner: float = math.pi / 2, fillet: float = 0.02, *, mirrored: bool = False
) -> Stance:
    """Hands on a slab; the spines of the first, on a square edge, find no rock."""
    edge = Edge(fillet, corner), 0.0
    holds = {
        "front_right": (Cylinder(0.25), math.pi) if mirrored else edge,
        "front_left": (Cylinder(0.25), math.pi),
        "rear_right": edge if mirrored else (Cylinder(0.3), math.pi),
        "rear_left": edge if mirrored else (Edge(0.03, 2.0), 0.0),
    }
    body = Pose(np.array([-0.422862, 0.0, 0.153909]), SLAB)
    hands = []
    for limb, (hold, turn) in holds.items():
        x, y = 0.6 if "front" in limb else -0.6, -0.45 if "right" in limb else 0.45
        place = Pose(np.array([x, y, -0.45]), PALM_TO_WALL)
        hands.append(HandOnHold(limb, body @ place, hold, ROCK, grasp=Grasp(turn)))
    return Stance(tuple(hands), body)


def asked_of(stance: Stance, mass: float = 90.0, **kwargs) -> Question:
    return Question(stance, load=Load(mass, (0.0, 0.0, -0.13)), **kwargs)


def tensions(answer: Plan) -> np.ndarray:
    by_limb = {hand.limb: [f.tendon_tension for f in hand.fingers] for hand in answer.hands}
    return np.array([by_limb[limb] for limb in sorted(by_limb)])


def squares(answer: Plan) -> float:
    return float(((tensions(answer) / STRONGEST) ** 2).sum())


def adding_nothing(answer: Plan) -> set[str]:
    """Return the limbs whose hands are left at their closing tensions."""
    found = [each for each in answer.findings if each.kind == "hand_adds_nothing"]
    return {answer.hands[int(each.field[len("stance.hands[") : -1])].limb for each in found}


def least_squares_within(question: Question, most: float) -> float:
    """Σ (tension / maximum)² of the least, in SI units by a program of its own."""
    sets = peer.spaces(question)
    r = peer.rows(question, sets)
    strength = question.limits.tendon_tension or STRONGEST
    weights = [
        1.0 / strength**2 if name.endswith("/tension") else 1e-10
        for each in sets
        for name in each.columns
    ]
    A = np.vstack([r.B, r.L / r.s[:, None], r.H / 100.0])
    b = np.concatenate([question.needed_wrench() - r.b, most - r.l0 / r.s, r.h / 100.0])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.ZeroConeT(6), clarabel.NonnegativeConeT(len(b) - 6)]
    P = sp.diags(2e4 * np.array(weights)).tocsc()
    found = clarabel.DefaultSolver(
        P, np.zeros(len(weights)), sp.csc_matrix(A * 100.0), b, cones, settings
    ).solve()
    assert str(found.status) in ("Solved", "AlmostSolved")
    loads = 100.0 * np.array(found.x)
    pulls = np.array([name.endswith("/tension") for each in sets for name in each.columns])
    return float(((loads[pulls] / strength) ** 2).sum())


CASES = {
    **{
        f"corner {corner:.2f}, fillet {fillet:g}": asked_of(wasteful(corner, fillet))
        for corner in (math.pi / 2, 1.65)
        for fillet in (0.01, 0.02, 0.03)
    },
    "lighter": asked_of(wasteful(), mass=50.0),
    "two of them": asked_of(wasteful(mirrored=True)),
    "two of them, lighter": asked_of(wasteful(mirrored=True), mass=60.0),
    "sharp edges, pinched": ask(on_wall(Edge(0.03, 1.2))),
    "long lever": ask(on_wall(), load=Load(60.0, (0.0, 0.0, 0.4))),
    "to the side": ask(on_wall(Cylinder(0.4)), load=Load(50.0, (0.0, 0.3, 0.0))),
    "weak tendons": ask(on_wall(), load=Load(50.0), limits=Limits(tendon_tension=110.0)),
}


def check(question: Question, answer: Plan) -> None:
    """Check a plan against linear and quadratic programs of other hands."""
    least = peer.least_utilisation(question).fun
    cap = question.limits.utilisation
    assert is_meant(answer.utilisation, least, cap, TOLERANCE)
    strength = question.limits.tendon_tension or STRONGEST
    spare = adding_nothing(answer)
    kept = [limb not in spare for limb in sorted(hand.limb for hand in answer.hands)]
    pulled = float(((tensions(answer)[kept] / strength) ** 2).sum())
    most = most_meant(least, cap)
    if most - least < TOLERANCE:
        # nothing is given away, and at the very least HiGHS' digits may leave no plan
        return
    # what is left to gain is worth less than what may be given away
    assert pulled <= least_squares_within(question, most) + (most - least) / WEIGHT + 1e-6


@pytest.mark.parametrize("question", CASES.values(), ids=CASES.keys())
def test_no_plan_nearly_as_good_has_noticeably_less_tension(question):
    answer = plan(question)
    assert answer.verified
    check(question, answer)


@pytest.mark.parametrize(
    "seeds", [range(8), pytest.param(range(8, 100), marks=pytest.mark.slow)], ids=["few", "many"]
)
def test_random_plans_have_no_noticeable_tension_too_much(seeds):
    count = 0
    for seed in seeds:
        question = random_question(seed)
        answer = plan(replace(question, explain=False))
        if answer.hands is not None and answer.utilisation < 100.0:
            check(question, answer)
            count += 1
    assert count > 0.3 * len(seeds)


def test_a_hand_without_a_spine_on_rock_is_not_pulled_for_next_to_nothing():
    """Least utilisation alone pulls one tendon of it twice as far."""
    question = asked_of(wasteful())
    answer = plan(question)
    alone = tensions_of(program_data(question))
    assert alone.max() > 1.5 * tensions(answer).max()
    least = peer.least_utilisation(question).fun
    assert answer.utilisation <= (1.0 + GIVEN_AWAY) * least + TOLERANCE
    assert squares(answer) < 0.6 * float(((alone / STRONGEST) ** 2).sum())


def tensions_of(data) -> np.ndarray:
    return np.array([y[:4] for y in programs.unique(data).loads])


@pytest.mark.parametrize("name", ["lighter", "sharp edges, pinched", "long lever"])
def test_it_is_the_program_that_cvxpy_defines(name):
    question = CASES[name]
    data = program_data(question)
    least = program_of(programs.margin, data).by_definition()[0].value
    trade = tension_trade(least, question.limits.utilisation)
    defined, _ = program_of(programs.less_tension, data, trade).by_definition()
    mine = {h.limb: [f.tendon_tension for f in h.fingers] for h in plan(question).hands}
    for hand, loads in zip(question.stance.hands, defined.loads, strict=True):
        np.testing.assert_allclose(mine[hand.limb], loads[:4], atol=0.5)


@pytest.mark.parametrize("name", CASES)
def test_the_order_of_hands_does_not_matter(name):
    question = CASES[name]
    stance = question.stance
    turned = replace(question, stance=replace(stance, hands=stance.hands[::-1]))
    one, other = plan(question), plan(turned)
    assert other.utilisation == pytest.approx(one.utilisation, rel=1e-8)
    np.testing.assert_allclose(tensions(one), tensions(other), atol=1e-4)


@pytest.mark.parametrize(
    "name", ["two of them", "two of them, lighter", "weak tendons", "long lever"]
)
def test_a_symmetric_stance_has_a_symmetric_plan(name):
    by_limb = {
        hand.limb: [f.tendon_tension for f in hand.fingers] for hand in plan(CASES[name]).hands
    }
    for limb, found in by_limb.items():
        side, _, way = limb.partition("_")
        other = by_limb[f"{side}_{'left' if way == 'right' else 'right'}"]
        np.testing.assert_allclose(found, other[::-1], atol=1e-4)


def largest_step(questions) -> float:
    """Return by how much a tension changes at most from one question to the next [N]."""
    found = [tensions(plan(each)) for each in questions]
    return max(np.abs(after - before).max() for before, after in pairwise(found))


@pytest.mark.parametrize("way", range(3))
def test_tensions_follow_the_centre_of_mass_without_a_jump(way):
    """Steps of an eighth are about an eighth as long: a jump would stay as it is."""
    stance = wasteful()

    def moved(share: float) -> Question:
        com = np.array([0.0, 0.0, -0.13])
        com[way] += 0.002 * share
        return Question(stance, load=Load(90.0, tuple(com)))

    coarse, fine = (largest_step(map(moved, np.linspace(0.0, 1.0, n))) for n in (6, 81))
    assert 0.01 < fine < 0.3 * coarse


def test_tensions_follow_the_cap_without_a_jump_and_plans_keep_to_it():
    question = asked_of(wasteful(), mass=60.0)
    least = peer.least_utilisation(question).fun

    def capped(above: float) -> Question:
        return replace(question, limits=Limits(utilisation=(1.0 + above) * least))

    coarse, fine = (largest_step(map(capped, np.linspace(1e-6, 1.2e-3, n))) for n in (6, 81))
    assert 0.01 < fine < 0.3 * coarse
    for above in (1e-8, 1e-6, 1e-4, 5e-4, 9e-4, 2e-3):
        answer = plan(capped(above))
        assert answer.status == "optimal"
        assert answer.utilisation <= (1.0 + above) * least + TOLERANCE
    beyond, within = plan(capped(-1e-5)), plan(capped(1e-7))
    assert (beyond.status, within.status) == ("overloaded", "optimal")
    assert beyond.utilisation == pytest.approx(least, abs=TOLERANCE)
    np.testing.assert_allclose(tensions(beyond), tensions(within), atol=0.5)


@pytest.mark.parametrize("name", CASES)
def test_a_known_stance_and_a_stream_pull_as_a_plan_does(name):
    question = CASES[name]
    known, answer = KnownStance(question), plan(question)
    if answer.hands is None:
        return
    rng = np.random.default_rng(1)
    wrench = known.prepared.wrench
    for _ in range(6):
        known.plan(wrench * (1.0 + 0.01 * rng.standard_normal(6)))
    again = known.plan(wrench)
    np.testing.assert_allclose(tensions(again), tensions(answer), atol=1e-4)
    assert again.utilisation == pytest.approx(answer.utilisation, rel=1e-8)
    with WrenchStream(question) as stream:
        points = stream.set_points(wrench)
        order = np.argsort(stream.limbs)
        np.testing.assert_allclose(points.tensions[order], tensions(answer), atol=1e-3)
        assert points.gap <= GIVEN_AWAY * points.utilisation + 1e-5


def test_fixed_hands_beside_a_floating_one_pull_no_more_than_alone():
    stance = wasteful()
    first, second, *others = stance.hands
    floating = replace(second, wrist="floating", tendon_preload=np.full(4, 60.0))
    mixed = replace(stance, hands=(first, floating, *others))
    answer = plan(asked_of(mixed, mass=50.0))
    assert answer.verified
    there = next(hand for hand in answer.hands if hand.limb == second.limb)
    # what the floating hand gives is given: the others' own question
    fixed = replace(stance, hands=(first, *others))
    carried = peer.reaction(asked_of(mixed), 1, there.wrench)
    alone = Question(fixed, body_wrench=asked_of(mixed, mass=50.0).needed_wrench() - carried)
    kept = np.array([[f.tendon_tension for f in h.fingers] for h in answer.hands if h is not there])
    pulled = float(((kept / STRONGEST) ** 2).sum())
    most = answer.utilisation
    assert pulled <= least_squares_within(alone, most) + GIVEN_AWAY * most / WEIGHT + 1e-6
