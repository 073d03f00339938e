"""How long a plan takes, and its solver against its peers on the same data.

``pytest benchmarks --benchmark-enable -m slow`` measures; else each runs once, as a test.
"""

import pytest

from hand_models.rock import Cylinder
from planner.prepare import HandBatch, assemble
from planner.programs import solvers, unique_bound
from planner.result import LoadRecovery
from planner.solving import plan
from planner.verification import Check
from service.answering.answers import plan_reply
from tests.suite.helpers import peer
from tests.suite.helpers.stances import PLACES, ask, on_wall, program_data

pytestmark = pytest.mark.slow

LIMBS = tuple(PLACES)
HOLDS = {"held": Cylinder(0.3), "overloaded": Cylinder(0.7)}


def question_of(hands: int = 4, *want: str, hold=HOLDS["held"]):
    return ask(on_wall(hold, limbs=LIMBS[:hands]), *want)


@pytest.mark.benchmark(group="plan, from holds to a verified plan")
@pytest.mark.parametrize("hands", [1, 2, 3, 4])
def test_plan(benchmark, hands):
    answer = benchmark(plan, question_of(hands))
    assert len(answer.hands) == hands
    assert answer.verified


@pytest.mark.benchmark(group="plan, from holds to a verified plan")
def test_plan_with_its_spread(benchmark):
    answer = benchmark(plan, question_of(4, "spread"))
    assert answer.spread.without == 0


@pytest.mark.benchmark(group="least utilisation of four hands")
@pytest.mark.parametrize("hold", HOLDS.values(), ids=HOLDS.keys())
def test_margin_with_new_data(benchmark, hold):
    question = question_of(hold=hold)
    outcome = benchmark(solvers.margin, program_data(question))
    assert outcome.value == pytest.approx(peer.least_utilisation(question).fun, rel=1e-6)


@pytest.mark.benchmark(group="other programs of four hands")
def test_tie_break(benchmark):
    data = program_data(question_of())
    least = solvers.margin(data).value
    assert benchmark(solvers.tie_break, data, least + 1e-6).solved


@pytest.mark.benchmark(group="other programs of four hands")
def test_load_factor(benchmark):
    assert benchmark(solvers.load_factor, program_data(question_of())).value > 1.0


@pytest.mark.benchmark(group="other programs of four hands")
def test_certificate(benchmark):
    """A whole plan that ends as infeasible, the certificate included."""
    answer = benchmark(plan, ask(on_wall(palm=False)))
    assert answer.status == "infeasible"


# After the solver ---------------------------------------------------------------------------------


def solved_stance():
    """A question of four hands, its settled hands, sets and data, and the loads of its plan."""
    question = question_of()
    wrench = question.needed_wrench()
    batch, hands = assemble(question, None, wrench)
    spaces, data = hands.sets(hands.at_rest())
    return question, batch, spaces, data, solvers.unique(data), wrench


@pytest.mark.benchmark(group="after the solver, four hands")
def test_reading_and_checking_hands_that_are_new(benchmark):
    question, batch, spaces, _, outcome, wrench = solved_stance()

    def after():
        new = HandBatch.of(batch.hands)
        carried, _, effort = LoadRecovery(new, spaces).read(outcome.loads)
        used = float(carried.utilisations.max())
        return Check(question, new).problems(carried, used, wrench, effort)

    assert benchmark(after) == []


@pytest.mark.benchmark(group="after the solver, four hands")
def test_reading_and_checking_hands_that_are_known(benchmark):
    question, batch, spaces, _, outcome, wrench = solved_stance()
    reader, check = LoadRecovery(batch, spaces), Check(question, batch)

    def after():
        carried, _, effort = reader.read(outcome.loads)
        return check.problems(carried, float(carried.utilisations.max()), wrench, effort)

    assert benchmark(after) == []


@pytest.mark.benchmark(group="after the solver, four hands")
def test_proving_that_nothing_uses_less(benchmark):
    _, _, _, data, outcome, _ = solved_stance()
    assert benchmark(unique_bound, data, outcome) == pytest.approx(outcome.value, rel=1e-5)


@pytest.mark.benchmark(group="after the solver, four hands")
def test_reply(benchmark):
    answer = plan(question_of())
    reply = benchmark(plan_reply, answer, None, model=False)
    assert [hand.utilisation for hand in reply.hands] == [hand.utilisation for hand in answer.hands]
