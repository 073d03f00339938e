"""Plans of least effort of fixed hands, against other solvers, proofs and finite differences."""

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from msgspec import structs
from scipy.linalg import block_diag
from scipy.optimize import minimize

from planner.prepare import assemble, hand_space, posture
from planner.programs import HandData, StanceData, solvers
from planner.question import ForceCap, Limits, Load, Question
from planner.result import Price
from planner.robots import RobotFile, robot_of
from planner.solving import NAMED_OBJECTIVES, plan
from tests.suite.helpers import peer
from tests.suite.helpers.robots import arm
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall, random_question
from tests.suite.helpers.stances_with_joints import at_joints, random_question_with_joints

TENDON = 700.0
"""What a tendon holds [N]."""

UNIQUE = 2e-3
"""How much of the effort the small weights that make loads unique may cost at most."""


def least(question: Question) -> Question:
    return replace(question, objective="min_effort")


def solved_wall(off: float, **kwargs) -> Question:
    return Question(replace(on_wall(off=off), joints="solve"), **kwargs)


def held(question: Question) -> Question:
    """The question at the angles that inverse kinematics finds for it."""
    where = posture(question)
    return replace(question, stance=replace(question.stance, joints=dict(where.angles)))


class Quadratic:
    """‖E y + e₀‖² and the rows of a question in SI units, from the hands' sets and joints alone."""

    def __init__(self, question: Question) -> None:
        where = posture(question)
        wrench = question.needed_wrench(None if where is None else where.weights)
        _, self.hands = assemble(question, where, wrench)
        sets = list(self.hands.spaces)
        self.rows = peer.rows(question, sets)
        size = self.rows.L.shape[1]
        most = min(TENDON, question.limits.tendon_tension or TENDON)
        E, e0, start = [np.zeros((0, size))], [np.zeros(0)], 0
        for hand, space in zip(question.stance.hands, sets, strict=True):
            own = np.zeros((4, size))
            for i in range(4):
                own[i, start + i] = 1.0 / most
            E.append(own)
            e0.append(np.zeros(4))
            if where is not None:
                joints = where.joints[hand.limb]
                bears = np.zeros((len(joints.names), size))
                bears[:, start : start + len(space.columns)] = (
                    joints.jacobian.T @ space.generators / joints.limits[:, None]
                )
                E.append(bears)
                at_none = joints.gravity + joints.jacobian.T @ space.origin
                e0.append(at_none / joints.limits)
            start += len(space.columns)
        self.E, self.e0 = np.vstack(E), np.concatenate(e0)
        self.goal = wrench - self.rows.b
        self.cap = question.limits.utilisation

    def value(self, y: np.ndarray) -> float:
        return float(np.sum((self.E @ y + self.e0) ** 2))

    def slope(self, y: np.ndarray) -> np.ndarray:
        return 2.0 * self.E.T @ (self.E @ y + self.e0)

    def gap(self, y: np.ndarray) -> float:
        """How far a plan may be above the least effort, by a linear program of HiGHS.

        f is convex, so no plan x is below f(y) + ∇f · (x − y), whose least is a linear program.
        """
        r, slope = self.rows, self.slope(y)
        found = peer.solve(
            slope,
            np.vstack([r.L, r.H]),
            np.concatenate([self.cap * r.s - r.l0, r.h]),
            r.B,
            self.goal,
            bounds=(-1e4, 1e4),
        )
        assert found.status == 0, found.message
        return float(slope @ y - found.fun)

    @cached_property
    def data(self) -> StanceData:
        return self.hands.sets(self.hands.at_rest()).data

    def solved(self) -> np.ndarray:
        """Loads of all hands by `solvers.effort`, proven with its small weights."""
        outcome = solvers.effort(self.data, self.cap)
        assert outcome.solved, outcome.status
        value, gap = effort_gap(self.data, self.cap, outcome.loads)
        assert -1e-6 <= gap <= 1e-6 * max(1.0, value)
        return np.concatenate(outcome.loads)


def pressing_wrench(stance, tension: float, palm: float) -> np.ndarray:
    """The body wrench of hands with equal tensions whose palms drag and press."""
    question = Question(stance, body_wrench=np.zeros(6))
    total = np.zeros(6)
    for i, hand in enumerate(stance.hands):
        _, space = hand_space(stance, hand.limb)
        y = [
            tension if name.endswith("/tension") else palm * name.startswith("palm")
            for name in space.columns
        ]
        total += peer.reaction(question, i, space.wrench(y))
    return total


PAIR = on_wall(limbs=("rear_left", "front_right"))
SINGLE = on_wall(limbs=("front_left",))

QUESTIONS = {
    "wall": ask(on_wall()),
    "wall with a margin": ask(on_wall(off=0.2), limits=Limits(utilisation=0.85)),
    "weak tendons": ask(on_wall(), limits=Limits(tendon_tension=120.0)),
    "joints": held(solved_wall(0.2)),
    "joints with a margin": held(solved_wall(0.45, limits=Limits(utilisation=0.9))),
    "two hands": Question(PAIR, body_wrench=pressing_wrench(PAIR, 90.0, 40.0)),
    "one hand": Question(SINGLE, body_wrench=pressing_wrench(SINGLE, 90.0, 40.0)),
    "three hands": ask(
        on_wall(off=0.15, limbs=("rear_right", "rear_left", "front_left")),
        load=structs.replace(CALIBRATION_LOAD, mass=90.0),
    ),
    "forces capped": ask(on_wall(), limits=Limits(per_hand={"front_left": ForceCap(250.0)})),
}


@pytest.mark.parametrize("name", QUESTIONS)
def test_no_plan_within_the_cap_has_less_effort(name):
    question = least(QUESTIONS[name])
    answer = plan(question)
    assert answer.status == "optimal", answer.reason
    by_hand = Quadratic(question)
    y = by_hand.solved()
    assert answer.effort == pytest.approx(by_hand.value(y), rel=1e-6)
    assert by_hand.gap(y) <= UNIQUE * by_hand.value(y)
    assert answer.utilisation <= question.limits.utilisation + 1e-6
    margin = plan(replace(question, objective="max_margin"))
    assert answer.effort <= margin.effort + 1e-9
    assert answer.utilisation >= margin.utilisation - 1e-6
    assert by_hand.gap(y) >= -1e-7


def test_questions_have_one_to_four_hands():
    assert {len(question.stance.hands) for question in QUESTIONS.values()} == {1, 2, 3, 4}


@pytest.mark.parametrize("name", ["one hand", "two hands"])
def test_least_effort_is_that_of_sequential_quadratic_programming(name):
    """Scipy's SLSQP from the plan of least utilisation."""
    by_hand = Quadratic(least(QUESTIONS[name]))
    r, cap = by_hand.rows, by_hand.cap
    start = peer.least_utilisation(QUESTIONS[name], list(by_hand.hands.spaces)).x[:-1]
    scale = 100.0
    found = minimize(
        lambda x: by_hand.value(scale * x),
        start / scale,
        jac=lambda x: scale * by_hand.slope(scale * x),
        constraints=[
            {
                "type": "ineq",
                "fun": lambda x: np.concatenate(
                    [(cap * r.s - r.l0 - r.L @ x * scale) / r.s, (r.h - r.H @ x * scale) / scale]
                ),
                "jac": lambda x: np.vstack([-r.L * scale / r.s[:, None], -r.H]),
            },
            {
                "type": "eq",
                "fun": lambda x: (r.B @ x * scale - by_hand.goal) / scale,
                "jac": lambda x: r.B,
            },
        ],
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 300},
    )
    assert found.success, found.message
    assert by_hand.value(by_hand.solved()) == pytest.approx(found.fun, rel=UNIQUE, abs=1e-9)


def test_random_stances_within_their_caps_have_the_least_effort():
    proven = 0
    for seed in (6,):
        question = least(random_question_with_joints(seed))
        answer = plan(question)
        assert answer.status == "optimal", answer.reason
        by_hand = Quadratic(question)
        assert by_hand.gap(by_hand.solved()) <= UNIQUE * answer.effort
        proven += 1
    for seed in (1, 9):
        question = least(random_question(seed))
        answer = plan(question)
        if answer.status == "optimal":
            by_hand = Quadratic(question)
            assert by_hand.gap(by_hand.solved()) <= UNIQUE * answer.effort
            proven += 1
    assert proven == 3


def test_beyond_the_cap_the_plan_is_that_of_least_utilisation():
    question = ask(on_wall(overhang=0.9, off=0.5), limits=Limits(utilisation=0.4))
    answer, margin = plan(least(question)), plan(question)
    assert answer.status == "overloaded"
    assert answer.utilisation == pytest.approx(margin.utilisation, abs=1e-9)
    assert answer.effort == pytest.approx(margin.effort, abs=1e-9)
    assert answer.effort_prices is None


def test_at_the_least_utilisation_itself_as_the_cap_there_is_a_plan():
    margin = plan(ask(on_wall()))
    answer = plan(least(ask(on_wall(), limits=Limits(utilisation=margin.utilisation))))
    assert answer.status == "optimal"
    assert answer.effort <= margin.effort + 1e-6


def test_more_utilisation_allows_less_effort():
    caps = (0.6, 0.7, 0.8, 0.9, 1.0)
    answers = [plan(least(ask(on_wall(off=0.15), limits=Limits(utilisation=c)))) for c in caps]
    efforts = [answer.effort for answer in answers if answer.status == "optimal"]
    assert len(efforts) >= 3
    assert efforts == sorted(efforts, reverse=True)


# --- any number of hands


def random_hand(rng: np.random.Generator, balance: int = 6) -> HandData:
    """A polyhedron about zero with four tensions, and loads that are none."""
    m, limits = 7, 24
    L = rng.normal(size=(limits, m))
    tie = np.where(np.arange(m) < 4, 1.0, 1e-4)
    H = -np.eye(m)[:4]
    E = np.vstack([np.eye(m)[:4] / 7.0, 0.3 * rng.normal(size=(2, m))])
    return HandData(
        G=rng.normal(size=(balance, m)),
        g=0.1 * rng.normal(size=balance),
        L=L / np.linalg.norm(L, axis=1, keepdims=True),
        l0=-rng.uniform(0.0, 0.3, limits),
        H=H,
        h=np.full(4, 0.05),
        E=E,
        e0=np.concatenate([np.zeros(4), rng.normal(size=2) * 0.3]),
        tie=tie,
        rest=np.where(np.arange(m) < 4, 0.0, 1e-4),
        unit=np.full(m, 100.0),
    )


def effort_gap(data: StanceData, cap: float, loads) -> tuple[float, float]:
    """Value with the small weights, and how far it may be above the least, by HiGHS."""
    hands = data.hands
    z = [y / hand.unit for hand, y in zip(hands, loads, strict=True)]
    value, slope = 0.0, []
    for hand, part in zip(hands, z, strict=True):
        effort, small = hand.E @ part + hand.e0, hand.rest * part
        value += float(effort @ effort + small @ part)
        slope.append(2.0 * (hand.E.T @ effort + small))
    g = np.concatenate(slope)
    found = peer.solve(
        g,
        np.vstack([block_diag(*(hand.L for hand in hands)), block_diag(*(h.H for h in hands))]),
        np.concatenate([*(cap - hand.l0 for hand in hands), *(hand.h for hand in hands)]),
        np.hstack([hand.G for hand in hands]),
        data.wrench - sum(hand.g for hand in hands),
        bounds=(-1e3, 1e3),
    )
    assert found.status == 0, found.message
    return value, float(g @ np.concatenate(z) - found.fun)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 8, 16])
@pytest.mark.parametrize("seed", range(3))
def test_the_program_of_any_number_of_hands_is_proven_by_highs(count, seed):
    rng = np.random.default_rng(100 * count + seed)
    hands = tuple(random_hand(rng) for _ in range(count))
    inside = [rng.uniform(0.0, 0.1, len(hand.unit)) for hand in hands]
    wrench = sum(hand.G @ z + hand.g for hand, z in zip(hands, inside, strict=True))
    data = StanceData.of(hands, wrench)
    outcome = solvers.effort(data, 1.0)
    assert outcome.solved
    value, gap = effort_gap(data, 1.0, outcome.loads)
    assert value == pytest.approx(outcome.value, abs=1e-7)
    assert -1e-6 <= gap <= 1e-5 * max(1.0, value)
    bound = NAMED_OBJECTIVES["min_effort"].bound(data, outcome, 1.0)
    assert value - 1e-5 * max(1.0, value) <= bound <= value + 1e-6
    assert solvers.used_effort(data, outcome.loads) <= value


def test_sixteen_limbs_of_a_robot_of_its_own():
    """Sixteen arms of four joints on the same trunk, each with its hand on a plane of its own."""
    limbs = tuple(f"arm{i}" for i in range(16))
    toml, urdf = arm(4, limbs)
    robot = robot_of(RobotFile("arms", toml, urdf))
    rng = np.random.default_rng(3)
    angles = {limb: rng.uniform(-1.0, 1.0, 4) for limb in limbs}
    question = Question(at_joints(robot, angles, limbs))
    margin = plan(question)
    answer = plan(least(question))
    assert margin.status == answer.status == "optimal", (margin.reason, answer.reason)
    assert len(answer.hands) == 16
    assert answer.effort <= margin.effort + 1e-9
    by_hand = Quadratic(least(question))
    assert by_hand.gap(by_hand.solved()) <= UNIQUE * answer.effort


# --- prices


def price_of(prices: tuple[Price, ...], limit: str, limb: str) -> float:
    return sum(p.price for p in prices if p.name.limit == limit and p.name.limb == limb)


def effort_of(question: Question) -> float:
    answer = plan(least(question))
    assert answer.status == "optimal", answer.reason
    return answer.effort


def between(price: float, ahead: float, behind: float) -> bool:
    """Whether a price is between the one-sided differences, as far as small weights let it be."""
    room = 0.02 * max(abs(ahead), abs(behind)) + 1e-9
    return ahead - room <= price <= behind + room


@pytest.mark.parametrize("limb", ["front_left", "rear_right"])
def test_the_price_of_a_capped_force_is_what_a_newton_more_takes_off_the_effort(limb):
    light = ask(on_wall(), load=Load(mass=95.0, com=(0.0, 0.0, 0.0)))

    def capped(most: float) -> Question:
        return replace(light, limits=Limits(per_hand={limb: ForceCap(most)}))

    free = plan(least(light))
    used = next(np.linalg.norm(h.wrench[:3]) for h in free.hands if h.limb == limb)
    most, step = 0.9 * float(used), 0.2
    answer = plan(least(capped(most)))
    price = price_of(answer.effort_prices, "force_cap", limb)
    assert price > 1e-6
    at = answer.effort
    ahead = (at - effort_of(capped(most + step))) / step
    behind = (effort_of(capped(most - step)) - at) / step
    assert between(price, ahead, behind), (price, ahead, behind)


def test_prices_of_all_limits_together_are_what_more_utilisation_takes_off_the_effort():
    """A unit of the cap is worth Σ price · capacity / cap over the limits that bind."""

    def within(cap: float) -> Question:
        return replace(QUESTIONS["joints"], limits=Limits(utilisation=cap))

    cap, step = 0.8, 1e-3
    answer = plan(least(within(cap)))
    hands = {hand.limb: hand for hand in answer.hands}
    worth = 0.0
    for price in answer.effort_prices:
        space, name = hands[price.name.limb].space, price.name
        capacity = next(
            s
            for row, s in zip(space.rows, space.s, strict=False)
            if (row.finger, row.phalanx, row.limit, row.joint)
            == (name.finger, name.phalanx, name.limit, name.joint)
        )
        worth += price.price * capacity / cap
    at = answer.effort
    ahead = (at - effort_of(within(cap + step))) / step
    behind = (effort_of(within(cap - step)) - at) / step
    assert worth > 1e-3
    assert between(worth, ahead, behind), (worth, ahead, behind)


def test_prices_of_limits_are_those_of_their_rows_while_efforts_are_measured_alike():
    """Each dear limit a little higher in the program's rows, effort measured as before."""
    question = least(QUESTIONS["wall with a margin"])
    answer = plan(question)
    by_hand = Quadratic(question)
    data, cap = by_hand.data, by_hand.cap
    at = solvers.used_effort(data, solvers.effort(data, cap).loads)
    limbs = [hand.limb for hand in question.stance.hands]
    assert answer.effort_prices
    for price in answer.effort_prices[:6]:
        index, name = limbs.index(price.name.limb), price.name
        space, hand = by_hand.hands.spaces[index], data.hands[index]
        mine = [
            (row.finger, row.phalanx, row.limit) == (name.finger, name.phalanx, name.limit)
            for row in space.rows[: len(space.s)]
        ]
        gained = []
        for sign in (1.0, -1.0):
            step = sign * 2e-3 * float(space.s[mine][0])
            weaker = np.where(mine, space.s / (space.s + step), 1.0)
            other = hand._replace(L=hand.L * weaker[:, None], l0=hand.l0 * weaker)
            hands = (*data.hands[:index], other, *data.hands[index + 1 :])
            outcome = solvers.effort(StanceData.of(hands, data.wrench), cap)
            assert outcome.solved
            gained.append((at - solvers.used_effort(data, outcome.loads)) / step)
        assert between(price.price, gained[0], gained[1]), (name, price.price, gained)
