"""Set-points relative to present tensions: largest changes, and whether the way there is safe."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from planner.explanation import TOLERANCES, limit_name, unsafe_sentence
from planner.prepare import assemble, posture
from planner.question import Limits, Load, Question
from planner.result import LimitName, Plan, TensionPath
from planner.solving import plan
from service.answering.answers import plan_reply
from service.tables import print_plan
from tests.suite.helpers import peer
from tests.suite.helpers.stances import ask, on_wall, random_question
from tests.suite.helpers.stances_with_joints import random_question_with_joints

ROOM = 0.1
"""What is no room on the way [N]."""

LIMBS = ("front_right", "rear_right", "rear_left", "front_left")


def tensions(answer: Plan) -> dict[str, np.ndarray]:
    return {hand.limb: np.array([f.tendon_tension for f in hand.fingers]) for hand in answer.hands}


class Peer:
    """The least utilisation at given tensions, by HiGHS in SI units."""

    def __init__(self, question: Question) -> None:
        where = posture(question)
        self.question = question
        wrench = question.needed_wrench(None if where is None else where.weights)
        _, hands = assemble(question, where, wrench)
        self.sets = list(hands.spaces)
        rows = peer.rows(question, self.sets)
        n = rows.L.shape[1]
        self.cost = np.append(np.zeros(n), 1.0)
        self.A = np.vstack(
            [np.column_stack([rows.L, -rows.s]), np.column_stack([rows.H, np.zeros(len(rows.h))])]
        )
        self.b = np.concatenate([-rows.l0, rows.h + TOLERANCES.tension_change])
        pairs = list(zip(question.stance.hands, self.sets, strict=True))
        self.names = [
            limit_name(hand.limb, row)
            for kind in ("limit", "hard")
            for hand, space in pairs
            for row in space.rows
            if row.kind == kind
        ]
        self.E, self.e = np.column_stack([rows.B, np.zeros(6)]), wrench - rows.b
        starts = np.cumsum([0, *(len(each.columns) for each in self.sets)])
        self.start = {h.limb: s for h, s in zip(question.stance.hands, starts, strict=False)}

    def least(self, at: dict[str, np.ndarray]) -> float:
        """Infinite where nothing balances the body."""
        result = self._solve(self.cost, self.A, self.b, at)
        return float(result.fun) if result.status == 0 else math.inf

    def slack(self, at: dict[str, np.ndarray], row: int) -> float:
        """The most that a row leaves within utilisation 1 [N]."""
        A, b = np.vstack([self.A, self.cost]), np.append(self.b, 1.0 + 1e-6)
        result = self._solve(self.A[row], A, b, at)
        assert result.status == 0, result.message
        return float(self.b[row] - result.fun)

    def _solve(self, cost, A, b, at: dict[str, np.ndarray]):
        picked, goal = [], []
        for limb, values in at.items():
            for i in range(4):
                row = np.zeros(len(self.cost))
                row[self.start[limb] + i] = 1.0
                picked.append(row)
                goal.append(values[i])
        # a hair of room, as tensions of a plan are rounded
        return peer.solve(
            cost,
            np.vstack([A, picked, -np.array(picked)]),
            np.concatenate([b, np.array(goal) + 1e-5, 1e-5 - np.array(goal)]),
            self.E,
            self.e,
            bounds=(-peer.HUGE, peer.HUGE),
        )


def check(question: Question, answer: Plan, there: Peer | None = None) -> TensionPath:
    """Check what a plan says of its way against points of it."""
    path, planned, there = answer.path, tensions(answer), there or Peer(question)
    cap = question.limits.utilisation

    def at(s: float) -> float:
        return there.least(
            {k: planned[k] + s * (present - planned[k]) for k, present in question.present.items()}
        )

    changes = [np.abs(planned[k] - present).max() for k, present in question.present.items()]
    assert path.largest_change == pytest.approx(max(changes), abs=1e-4)
    least = at(1.0)
    if path.largest_change <= TOLERANCES.tension_change:
        assert path.utilisation_at_present == pytest.approx(answer.utilisation, abs=1e-6)
    elif path.utilisation_at_present is None:
        assert least == math.inf
    else:
        assert path.utilisation_at_present == pytest.approx(least, rel=1e-4, abs=1e-4)
    assert path.safe == (path.safe_part >= 1.0 - 1e-6)
    if answer.status != "optimal":
        assert path.safe_part == 0.0
        return path
    if path.largest_change <= TOLERANCES.tension_change:
        assert path.safe
        return path
    for part in (0.0, 0.3, 0.7, 0.999):
        assert at(part * path.safe_part) <= cap + 1e-4
    if not path.safe:
        assert at(min(path.safe_part + 0.01, 1.0)) > cap
        assert any("straight way" in warning for warning in answer.warnings)
    else:
        assert not any("straight way" in warning for warning in answer.warnings)
    return path


def test_without_present_tensions_there_is_no_way():
    assert plan(ask(on_wall())).path is None


def test_the_plan_itself_is_a_safe_start():
    for objective in ["max_margin", "min_effort"]:
        question = ask(on_wall(), objective=objective)
        answer = plan(question)
        again = plan(replace(question, present=tensions(answer)))
        path = check(replace(question, present=tensions(answer)), again)
        assert path.safe
        assert path.safe_part == 1.0
        assert path.largest_change < 0.05
        assert path.utilisation_at_present == pytest.approx(answer.utilisation, abs=1e-4)


def test_absurd_tensions_are_no_safe_start():
    question = ask(on_wall(), present={limb: np.full(4, 690.0) for limb in LIMBS})
    path = check(question, plan(question))
    assert not path.safe
    assert 0.0 < path.safe_part < 1.0


def test_slack_tendons_are_no_safe_start_at_any_utilisation():
    """Slackened below the closing tension they stick: that is a hard row."""
    question = ask(on_wall(), present={limb: np.zeros(4) for limb in LIMBS})
    answer = plan(question)
    path = check(question, answer)
    assert not path.safe
    assert path.utilisation_at_present is None


def test_points_of_the_way_are_those_of_the_peer():
    """From unequal tensions, more and more of them given."""
    for cap in [0.9, 1.0]:
        for share in [0.2, 0.6, 1.0]:
            rng = np.random.default_rng(7)
            question = ask(on_wall(off=0.2), limits=Limits(utilisation=cap))
            planned = tensions(plan(question))
            present = {
                limb: np.maximum(planned[limb] + rng.uniform(-60.0, 120.0, 4) * share, 38.0)
                for limb in LIMBS[: 1 + round(3 * share)]
            }
            question = replace(question, present=present)
            check(question, plan(question))


def test_tendons_without_a_present_tension_are_free():
    """What one hand alone must not do, it may while the others give way."""
    question = ask(on_wall(off=0.2))
    planned = tensions(plan(question))
    one = {"front_left": planned["front_left"] + 25.0}
    others = {limb: planned[limb] for limb in LIMBS if limb != "front_left"}
    free = check(replace(question, present=one), plan(replace(question, present=one)))
    both = replace(question, present=one | others)
    pinned = check(both, plan(both))
    assert free.utilisation_at_present <= pinned.utilisation_at_present + 1e-6
    assert free.safe_part >= pinned.safe_part - 1e-6


def test_an_overloaded_plan_has_no_safe_way():
    question = ask(on_wall(overhang=0.9, off=0.5), limits=Limits(utilisation=0.4))
    question = replace(question, present=tensions(plan(question)))
    answer = plan(question)
    assert answer.status == "overloaded"
    assert not answer.path.safe
    assert answer.path.safe_part == 0.0
    assert answer.path.limiting[0].limb in unsafe_sentence(answer.path)
    assert answer.limiting in answer.path.limiting


@pytest.mark.parametrize(
    ("with_joints", "plain"),
    [((1, 4), (1, 9)), pytest.param((6, 14), (10, 11), marks=pytest.mark.slow)],
    ids=["few", "more"],
)
def test_ways_of_random_stances(with_joints, plain):
    seen = {_checked(random_question_with_joints(seed), seed) for seed in with_joints}
    seen |= {_checked(random_question(seed), seed) for seed in plain}
    assert seen == {True, False}


def _checked(question: Question, seed: int) -> bool:
    rng = np.random.default_rng(seed)
    planned = tensions(plan(question))
    spread = rng.choice([1.0, 30.0])
    present = {
        limb: np.maximum(values + rng.uniform(0.0, spread, 4), 0.0)
        for limb, values in planned.items()
        if rng.random() < 0.7
    }
    question = replace(question, present=present or planned)
    return check(question, plan(question)).safe


def test_the_sentence_tells_the_safe_part_and_not_more():
    palm = LimitName("front_left", None, None, "palm_pressing_reversed")
    way = "of the straight way from the present tensions is safe"
    for part, much in ((0.6299, "only the last 62 %"), (0.9999, "only the last 99 %")):
        sentence = unsafe_sentence(TensionPath(False, part, 1.2, 40.0, (palm,)))
        assert sentence == f"{much} {way}: front_left: palm cannot pull"
    for part in (0.0, 3e-6, 0.0099):
        assert unsafe_sentence(TensionPath(False, part, None, 40.0, ())) == f"no part {way}"


@pytest.mark.parametrize("off", [0.0, 0.2])
@pytest.mark.parametrize("tension", [0.0, 300.0, 690.0])
def test_what_ends_the_way_is_used_up_there_and_alone_leaves_no_balance_beyond(off, tension):
    """Whatever the loads at the end, a row of each name is at its limit; by HiGHS."""
    question = ask(on_wall(off=off), present={limb: np.full(4, tension) for limb in LIMBS[::2]})
    answer = plan(question)
    path, planned = answer.path, tensions(answer)
    assert not path.safe
    assert path.limiting

    def at(s: float) -> dict[str, np.ndarray]:
        return {k: v + s * (question.present[k] - v) for k, v in planned.items() if k in LIMBS[::2]}

    named = Peer(question)
    # rows of other names are moved far away
    others = np.array([name not in path.limiting for name in named.names])
    named.b = named.b + 1e6 * others
    assert named.least(at(path.safe_part + 0.002)) > 1.0
    for name in path.limiting:
        there = Peer(question)
        rows = [i for i, other in enumerate(there.names) if other == name]
        assert min(there.slack(at(path.safe_part), row) for row in rows) < ROOM, name


def test_hands_with_floating_wrists_stay_as_planned():
    """The others balance what these leave of the body wrench."""
    stance = on_wall(off=0.2)
    hands = list(stance.hands)
    hands[0] = replace(hands[0], wrist="floating")
    light = Load(mass=80.0, com=(0.0, 0.0, 0.0))
    question = ask(replace(stance, hands=tuple(hands)), load=light)
    planned = plan(question)
    assert planned.status == "optimal"
    rng = np.random.default_rng(2)
    for most in (1.0, 150.0):
        present = {
            limb: values + rng.uniform(0.0, most, 4)
            for limb, values in tensions(planned).items()
            if limb != hands[0].limb
        }
        asked = replace(question, present=present)
        answer = plan(asked)
        left = asked.needed_wrench() - peer.reaction(asked, 0, answer.hands[0].wrench)
        others = replace(
            asked, stance=replace(asked.stance, hands=tuple(hands[1:])), body_wrench=left
        )
        check(asked, answer, Peer(others))


def test_components_of_a_wrench_that_are_given_hold_all_the_way():
    stance = on_wall(off=0.2)
    hands = list(stance.hands)
    hands[1] = replace(hands[1], wrench=(None, 3.0, None, None, None, None))
    question = ask(replace(stance, hands=tuple(hands)))
    planned = tensions(plan(question))
    question = replace(question, present={limb: v + 60.0 for limb, v in planned.items()})
    there = Peer(question)
    row = np.zeros(there.E.shape[1])
    first, space = there.start[hands[1].limb], there.sets[1]
    row[first : first + len(space.columns)] = space.generators[1]
    there.E, there.e = np.vstack([there.E, row]), np.append(there.e, 3.0 - space.origin[1])
    check(question, plan(question), there)


def test_the_way_is_told_in_the_reply_and_to_a_person():
    question = ask(on_wall(off=0.2), present={"front_left": np.full(4, 300.0)})
    answer = plan(question)
    reply = plan_reply(answer, None, model=False)
    assert reply.path.safe is False
    assert reply.path.safe_part == answer.path.safe_part
    assert reply.path.largest_change == answer.path.largest_change
    said = io.StringIO()
    print_plan(reply, Console(file=said, width=80, highlight=False, markup=False))
    words = " ".join(said.getvalue().split())
    share = math.floor(100.0 * answer.path.safe_part)
    assert f"only the last {share} % of the straight way from the present tensions is safe" in words
    assert answer.path.limiting[0].limb in words
    assert [(n.limb, n.finger, n.phalanx, n.limit) for n in reply.path.limiting] == [
        (n.limb, n.finger, n.phalanx, n.limit) for n in answer.path.limiting
    ]
    assert plan_reply(plan(ask(on_wall())), None, model=False).path is None


# --- largest changes


def test_tensions_change_by_no_more_than_is_allowed():
    free = plan(ask(on_wall(off=0.2)))
    present = {limb: values + 20.0 for limb, values in tensions(free).items()}
    for most in (10.0, 15.0, 25.0):
        limits = Limits(tension_change=most)
        answer = plan(ask(on_wall(off=0.2), limits=limits, present=present))
        assert answer.verified
        if answer.hands is None:
            continue
        for limb, values in tensions(answer).items():
            assert np.abs(values - present[limb]).max() <= most + 1e-5
        assert answer.utilisation >= free.utilisation - 1e-6
    assert answer.utilisation == pytest.approx(free.utilisation, abs=1e-5)


def test_a_change_that_is_too_small_is_infeasible_and_named():
    """Tendons that stick at the closing tension cannot be near zero."""
    present = {"front_left": np.zeros(4)}
    answer = plan(ask(on_wall(), limits=Limits(tension_change=5.0), present=present))
    assert answer.status == "infeasible"
    assert answer.verified
    blocking = answer.certificate.blocking
    assert any(name.limit == "tension_change" and name.limb == "front_left" for name in blocking), (
        blocking
    )
    assert answer.path is None


def test_the_largest_change_is_that_of_the_peer():
    question = ask(on_wall(off=0.2))
    present = {limb: values + 20.0 for limb, values in tensions(plan(question)).items()}
    question = replace(question, limits=Limits(tension_change=12.0), present=present)
    _, hands = assemble(question, None, question.needed_wrench())
    found = peer.least_utilisation(question, list(hands.spaces))
    answer = plan(question)
    assert found.status == 0
    assert answer.utilisation == pytest.approx(found.fun, abs=1e-5)
