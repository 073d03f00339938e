"""Plans whose tensions serve all samples of the parameters."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose, UnsupportedError
from hand_models.rock import Plane
from planner import deadline, programs
from planner.prepare import prepare_stance
from planner.programs import Outcome, Robust, feedback_price, sample_value
from planner.question import Limits, Question
from planner.result import Plan
from planner.solving import MaxRobust, plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.planner.solving.test_spread import STRENGTHS, drawn, entry, seat, with_wrists
from tests.suite.helpers.checks import problems
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, moved, on_wall
from tests.suite.helpers.unseen_samples import both_plans, sent, unseen_samples

SEEN = (
    drawn(55.0, finger=seat(0.0241)),
    drawn(70.0, tile={"contact_stiffness": entry([5500.0, 6500.0, 9500.0], "N/m")}),
    drawn(85.0, finger=seat(0.0254)),
)
LOAD = structs.replace(CALIBRATION_LOAD, mass=90.0)
ASKED = ask(on_wall(), objective="max_robust", draws=SEEN, load=LOAD)


@cache
def planned() -> Plan:
    return plan(ASKED)


def tensions(answer: Plan) -> np.ndarray:
    return np.array([hand.tensions for hand in answer.hands])


@cache
def bound() -> MaxRobust:
    prepared = prepare_stance(ASKED)
    sets = prepared.at_rest
    found = MaxRobust().within(prepared, sets, programs.unique(sets.data).loads)
    assert found is not None
    return found


def test_its_blocks_are_what_is_defined_and_its_value_what_the_samples_have():
    data = bound().own.data
    program = Robust(bound().own, bound().samples, feedback_price(), 1.0)
    fast, (defined, _) = program.solve(), program.by_definition()
    assert fast.value == pytest.approx(defined.value, rel=1e-7)
    places = bound().own.tensions
    found = [np.concatenate(outcome.loads)[places] for outcome in (fast, defined)]
    assert found[0] == pytest.approx(found[1], abs=0.2)
    assert bound().value(data, fast.loads) == pytest.approx(fast.value, abs=1e-7)


def test_slopes_are_differences_of_the_value():
    data, rng = bound().own.data, np.random.default_rng(0)
    loads = [hand.unit * (0.8 + 0.2 * rng.random(len(hand.unit))) for hand in data.hands]
    slopes = bound().slopes(data, loads)
    for i in rng.choice(len(slopes), 6, replace=False):
        step = np.zeros(len(slopes))
        step[i] = 1e-4
        apart = [
            bound().value(data, np.split(np.concatenate(loads) + sign * 100.0 * step, 4))
            for sign in (1.0, -1.0)
        ]
        assert (apart[0] - apart[1]) / 2e-4 == pytest.approx(slopes[i], rel=1e-3, abs=1e-4)


def test_without_a_price_of_feedback_a_sample_has_its_least_utilisation():
    for sample, draw in zip(bound().samples, SEEN, strict=True):
        rows = sample.data.rows
        balance, limits = len(sample.data.wrench), rows.limits
        A = np.hstack([rows.whole[balance:], np.zeros((len(rows.rest), 1))])
        A[:limits, -1] = -1.0
        other = linprog(
            np.append(np.zeros(len(rows.unit)), 1.0),
            A_ub=A,
            b_ub=rows.rest,
            A_eq=np.hstack([rows.whole[:balance], np.zeros((balance, 1))]),
            b_eq=sample.data.offset,
            bounds=(None, None),
        )
        value, _ = sample_value(sample, np.full(len(sample.tensions), 0.5), 1e-9)
        assert value == pytest.approx(other.fun, abs=1e-6), draw
        dear, _ = sample_value(sample, np.full(len(sample.tensions), 0.5), 1.0)
        assert dear > value


def test_its_plan_is_verified_and_better_for_the_samples_than_that_of_least_utilisation():
    least = plan(replace(ASKED, objective="max_margin", want=frozenset({"spread"})))
    assert planned().status == "optimal"
    assert problems(ASKED, planned()) == []
    assert least.utilisation <= planned().utilisation * 1.001001
    data = bound().own.data
    values = []
    for answer in (least, planned()):
        z = np.zeros(len(data.rows.unit))
        z[bound().own.tensions] = tensions(answer).ravel()
        values.append(bound().value(data, np.split(z, 4)))
    assert values[1] < values[0]


def test_on_samples_that_are_the_usual_hands_it_is_the_plan_of_least_utilisation():
    usual = plan(ask(on_wall(), load=LOAD))
    same = plan(replace(ASKED, draws=(drawn(68.1),)))
    assert same.utilisation == pytest.approx(usual.utilisation, rel=2e-3)


@pytest.mark.slow
def test_tensions_that_stay_hold_in_more_samples_of_the_overhang():
    found = []
    for objective in ("max_margin", "max_robust"):
        asked = replace(question(read_request("overhang")), objective=objective)
        found.append(plan(replace(asked, want=frozenset({"spread"}))).spread)
    least, robust = found
    assert robust.kept.holds >= 2 * least.kept.holds
    assert robust.kept.without < least.kept.without / 2
    assert robust.feedback.holds >= least.feedback.holds


@pytest.mark.slow
@pytest.mark.parametrize("stance", ["slab", "overhang"])
def test_where_samples_are_new_its_tensions_stay_in_balance(stance):
    asked = replace(question(read_request(stance)), want=frozenset())
    least, robust = sent(asked, both_plans(asked), unseen_samples(asked, 3, 40))
    assert robust.kept >= least.kept + 0.15
    assert robust.kept_without <= least.kept_without / 3
    assert robust.feedback >= least.feedback - 0.05


def test_neither_place_nor_order_matters():
    by = Pose(np.array([3.0, -2.0, 5.0]), Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix())
    there = plan(replace(ASKED, stance=moved(on_wall(), by)))
    assert tensions(there) == pytest.approx(tensions(planned()), abs=0.05)
    turned = replace(ASKED.stance, hands=ASKED.stance.hands[::-1])
    back = plan(replace(ASKED, stance=turned, draws=SEEN[::-1]))
    assert tensions(back)[::-1] == pytest.approx(tensions(planned()), abs=0.05)


def test_it_keeps_to_the_cap_and_beyond_it_is_the_plan_of_least_utilisation():
    assert planned().utilisation > 0.85
    capped = replace(ASKED, limits=Limits(utilisation=0.85))
    assert plan(capped).utilisation == pytest.approx(0.85, abs=1e-5)
    weak = replace(question(read_request("wall-700")), objective="max_robust", want=frozenset())
    least = plan(replace(weak, objective="max_margin"))
    assert plan(weak).status == "overloaded"
    assert tensions(plan(weak)) == pytest.approx(tensions(least))


def test_a_spread_plans_each_sample_anew_without_regard_to_the_others():
    found = plan(replace(ASKED, want=frozenset({"spread"}))).spread
    least = plan(ask(on_wall(), "spread", draws=SEEN, load=LOAD)).spread
    assert found.utilisations == pytest.approx(least.utilisations)
    assert found.feedback.utilisations != pytest.approx(least.feedback.utilisations, rel=1e-3)


def test_what_cannot_be_is_refused():
    with pytest.raises(UnsupportedError, match="requires fixed wrists") as caught:
        plan(
            replace(
                with_wrists(
                    "overhang",
                    "compliant",
                ),
                objective="max_robust",
            )
        )
    assert caught.value.message.endswith("fix these, or ask for max_margin or min_effort")
    some = on_wall()
    mixed = replace(some, hands=(replace(some.hands[0], wrist="floating"), *some.hands[1:]))
    with pytest.raises(UnsupportedError, match=f"others have {some.hands[0].limb}: fix these"):
        Question(mixed, load=LOAD, objective="max_robust")
    weak = drawn(tendon={"maximum_tension": entry(50.0, "N")})
    none = Question(on_wall(closing_tension=60.0), objective="max_robust", draws=(weak,))
    with pytest.raises(UnsupportedError, match="there is none; valid is max_margin"):
        plan(none)
    with pytest.raises(InvalidInputError, match="requires 'spread' in want"):
        Question(on_wall(), draws=STRENGTHS)
    assert plan(Question(on_wall(Plane(), outer_rotation=0.0), objective="max_robust")).status == (
        "infeasible"
    )


def test_a_program_that_is_not_solved_is_no_answer(monkeypatch):
    nothing = Outcome(False, "solver_error", 0, float("nan"))
    monkeypatch.setattr(Robust, "solve", lambda self: nothing)
    answer = plan(ASKED)
    assert answer.status == "failed"
    assert "least mean utilisation over samples: solver_error" in answer.reason


def test_a_solver_that_lies_about_tensions_is_found_out(monkeypatch):
    honest = programs.kept

    def lies(data, held):
        found = honest(data, [1.02 * y for y in held])
        return replace(found, value=0.5)

    monkeypatch.setattr(programs, "kept", lies)
    assert plan(ASKED).unfinished == ("robust_tensions",)


def test_a_deadline_leaves_the_plan_of_least_utilisation(monkeypatch):
    def late(self, *_):
        monkeypatch.setattr(deadline, "expired", lambda: True)
        return self

    least = plan(ask(on_wall(), load=LOAD))
    monkeypatch.setattr(MaxRobust, "within", late)
    answer = plan(replace(ASKED, deadline=100.0))
    assert answer.unfinished == ("robust_tensions",)
    assert answer.warnings[-1].endswith("before the tensions that serve all samples were found")
    assert tensions(answer) == pytest.approx(tensions(least))


def test_tensions_that_are_not_proven_to_be_best_are_not_returned(monkeypatch):
    least = plan(ask(on_wall(), load=LOAD))
    monkeypatch.setattr(MaxRobust, "bound", lambda *_: float("-inf"))
    answer = plan(ASKED)
    assert answer.unfinished == ("robust_tensions",)
    assert answer.verified
    assert tensions(answer) == pytest.approx(tensions(least))
