"""Why a plan is overloaded, and why a question has none: the certificates, against HiGHS."""

from __future__ import annotations

import io
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from msgspec import structs
from rich.console import Console

from hand_models.rock import Cylinder
from planner.explanation.infeasibility import HELD_WRENCH
from planner.programs import WRENCH_UNIT
from planner.question import ForceCap, Limits
from planner.result import LimitName
from planner.robots import robosimian
from planner.solving import plan
from service.answering import questions
from service.answering.answers import plan_reply
from service.replies import CertificateReply, PlanReply
from service.requests import PlanRequest
from service.tables import print_plan
from tests.suite.helpers import peer
from tests.suite.helpers.named_rows import distance, have_loads, miss, most_given, named_rows
from tests.suite.helpers.random_questions import explained, few_and_all
from tests.suite.helpers.requests import HEAVY, wall_request
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall
from tests.suite.helpers.stances_with_joints import at_joints

STATUSES = ("infeasible", "overloaded")
HEAVILY = structs.replace(CALIBRATION_LOAD, mass=150.0)


@pytest.mark.parametrize("status", STATUSES)
@few_and_all
def test_no_loads_give_what_is_needed_in_the_certificates_direction(status, seeds):
    for label, question, answer in explained(status, seeds):
        proof = answer.certificate
        assert (proof.utilisation is None) == (status == "infeasible"), label
        length = np.linalg.norm(proof.direction * WRENCH_UNIT)
        assert length == pytest.approx(1.0) or length == 0.0, label
        needed = proof.direction @ answer.body_wrench
        for hand in question.stance.hands:
            part = proof.held.get(hand.limb, np.zeros(6))
            given = hand.wrench or (None,) * 6
            assert all(c == 0.0 for c, v in zip(part, given, strict=True) if v is None)
            needed += sum(c * v for c, v in zip(part, given, strict=True) if v is not None)
        assert proof.needed == pytest.approx(needed, rel=1e-9, abs=1e-9), label
        assert proof.supremum < proof.needed, label
        most = most_given(named_rows(question, proof.utilisation), proof.direction, proof.held)
        if most is not None:
            assert most <= proof.supremum + 1e-6 * max(1.0, abs(most)), label
        if not np.any(proof.direction) and not any(part.any() for part in proof.held.values()):
            assert most is None, label


@pytest.mark.parametrize("status", STATUSES)
@few_and_all
def test_the_nearest_body_wrench_can_be_held_and_no_nearer_one(status, seeds):
    seen = 0
    for label, question, answer in explained(status, seeds):
        proof = answer.certificate
        parts = named_rows(question, proof.utilisation)
        if proof.nearest is None:
            assert proof.shortfall is None
            assert not have_loads(replaced(parts), parts.constraints), label
            continue
        seen += 1
        np.testing.assert_allclose(proof.nearest + proof.shortfall, answer.body_wrench, atol=1e-6)
        size = max(1.0, float(np.abs(answer.body_wrench).max()))
        assert miss(parts, proof.nearest) <= 1e-5 * size, label
        away = float(np.linalg.norm(proof.shortfall / WRENCH_UNIT))
        assert away == pytest.approx(distance(parts), rel=1e-4, abs=1e-5), label
    assert seen >= 5


def replaced(parts):
    """Without the body's balance."""
    return parts._replace(B=0.0 * parts.B, o=0.0 * parts.o, wrench=0.0 * parts.wrench)


def test_within_the_nearest_wrench_there_is_a_plan_and_beyond_it_none():
    question = ask(on_wall(Cylinder(0.7)))
    proof = plan(question).certificate
    at = plan(ask(question.stance, body_wrench=proof.nearest))
    assert at.utilisation == pytest.approx(1.0, abs=1e-5)
    beyond = plan(ask(question.stance, body_wrench=proof.nearest + 0.02 * proof.shortfall))
    assert beyond.status == "overloaded"


def test_a_cap_below_one_is_what_the_certificate_is_about():
    question = ask(on_wall(), limits=Limits(utilisation=0.5))
    answer = plan(question)
    assert answer.status == "overloaded"
    assert answer.utilisation < 1.0
    assert answer.certificate.utilisation == 0.5
    at = plan(ask(question.stance, body_wrench=answer.certificate.nearest))
    assert at.utilisation == pytest.approx(0.5, abs=1e-5)
    assert "up to a utilisation of 0.5" in answer.reason
    assert "would be missing" in answer.reason


def test_a_plan_within_its_limits_has_no_certificate():
    assert plan(ask(on_wall())).certificate is None


# What only one hand or joint is to blame for ----------------------------------------------------


def three_hands_and_a_weak_limb():
    """RoboSimian on three hands; the fourth limb, stretched out, is too heavy for its joints."""
    robot = robosimian()
    angles = {limb: np.full(7, 0.3) for limb in robot.limbs}
    stance = at_joints(robot, angles, robot.limbs[:3])
    return stance, robot.limbs[3]


def test_a_joint_of_a_limb_without_a_hand_is_to_blame_alone():
    stance, limb = three_hands_and_a_weak_limb()
    limits = Limits(joint_torque={limb: 1e-3})
    answer = plan(ask(stance, body_wrench=np.zeros(6), limits=limits))
    proof = answer.certificate
    assert answer.status == "overloaded"
    assert answer.limiting.limb == limb
    assert proof.irreducible == proof.blocking == (answer.limiting,)
    # all seven are that weak
    assert proof.sufficient == ()
    assert proof.needed - proof.supremum == pytest.approx(answer.utilisation - 1.0)
    assert proof.nearest is None
    assert "it holds nothing on, so no plan changes that" in answer.reason


def test_of_the_joints_of_a_limb_without_a_hand_the_only_weak_one_would_do():
    stance, limb = three_hands_and_a_weak_limb()
    limits = Limits(joint_torque={limb: (1e3, 1e-3, *[1e3] * 5)})
    proof = plan(ask(stance, body_wrench=np.zeros(6), limits=limits)).certificate
    assert proof.sufficient == proof.irreducible
    assert proof.irreducible[0].joint == stance.robot.chains[limb].joints[1]


def test_closing_too_hard_leaves_no_loads_whatever_the_body_needs():
    stance = on_wall(Cylinder(0.7), closing_tension=400.0)
    answer = plan(ask(stance))
    proof = answer.certificate
    assert answer.status == "overloaded"
    assert not proof.direction.any()
    assert proof.shortfall is None
    limbs = {name.limb for name in proof.irreducible}
    assert len(limbs) == 1
    assert "whatever the body needs, no loads keep within all limits" in answer.reason
    # with nothing to hold, the same
    assert plan(ask(stance, body_wrench=np.zeros(6))).status == "overloaded"


def test_a_wrench_that_a_hand_cannot_exert_is_a_barrier():
    stance = on_wall(palm=False)
    first = replace(stance.hands[0], wrench=(None, None, 900.0, None, None, None))
    answer = plan(ask(replace(stance, hands=(first, *stance.hands[1:]))))
    proof = answer.certificate
    assert answer.status == "infeasible"
    constraint = LimitName(first.limb, None, None, HELD_WRENCH)
    assert constraint in proof.irreducible
    assert constraint not in proof.blocking
    assert proof.held[first.limb][2] > 0.0
    assert "must exert the wrench that it is given" in answer.reason


def test_tensions_that_may_not_change_enough_are_named():
    """At 10 to 15 N the springs drag the tiles backwards."""
    stance = on_wall()
    limb = stance.hands[0].limb
    answer = plan(ask(stance, limits=Limits(tension_change=5.0), present={limb: np.full(4, 10.0)}))
    assert answer.status == "infeasible"
    assert "tension_change" in {name.limit for name in answer.certificate.irreducible}
    assert {name.limb for name in answer.certificate.irreducible} == {limb}
    assert f"no loads at any utilisation, whatever the body needs: {limb}: " in answer.reason
    assert "may not change that much" in answer.reason


def test_a_cap_on_a_force_is_named():
    stance = on_wall()
    limb = stance.hands[0].limb
    question = ask(stance, load=HEAVILY, limits=Limits(per_hand={limb: ForceCap(20.0)}))
    answer = plan(question)
    assert answer.status == "overloaded"
    assert LimitName(limb, None, None, "force_cap") in answer.certificate.irreducible


def test_the_callers_own_limit_comes_first_and_is_told_if_it_alone_is_in_the_way():
    stance = on_wall()
    limb, load = stance.hands[0].limb, structs.replace(CALIBRATION_LOAD, mass=105.0)
    assert plan(ask(stance, load=load)).status == "optimal"
    answer = plan(ask(stance, load=load, limits=Limits(per_hand={limb: ForceCap(20.0)})))
    own = LimitName(limb, None, None, "force_cap")
    proof = answer.certificate
    assert answer.status == "overloaded"
    assert proof.irreducible[0] == proof.blocking[0] == own
    parts = named_rows(ask(stance, load=load, limits=Limits(per_hand={limb: ForceCap(20.0)})), 1.0)
    alone = {n for n in proof.irreducible if have_loads(parts, parts.constraints - {n})}
    assert own in alone
    assert set(proof.sufficient) == alone
    assert f"would make it feasible: {limb} force_cap" in printed(answer)


def test_limits_come_before_what_hands_cannot_do():
    answer = plan(ask(on_wall(Cylinder(0.7)), limits=Limits(tendon_tension=40.0)))
    names = [name.limit for name in answer.certificate.irreducible]
    own = [i for i, name in enumerate(names) if name == "tendon_tension"]
    hard = [i for i, name in enumerate(names) if name.endswith(("_reversed", "_backwards"))]
    assert own == list(range(len(own)))
    assert hard == list(range(len(names) - len(hard), len(names)))
    assert own
    assert hard


def test_what_no_single_limit_is_to_blame_for_is_told_so_in_words():
    answer = plan(ask(on_wall(palm=False)))
    assert answer.status == "infeasible"
    assert answer.certificate.sufficient == ()
    told = printed(answer)
    assert "removing no single one of them would make it feasible" in told
    assert "dragged_backwards: tile cannot be dragged away from the finger's base" in told


def printed(answer) -> str:
    out = io.StringIO()
    print_plan(plan_reply(answer, None, model=False), Console(file=out, width=80, markup=False))
    return " ".join(out.getvalue().split())


def test_weak_joints_are_named():
    robot = robosimian()
    angles = {limb: np.full(7, 0.3) for limb in robot.limbs}
    stance = at_joints(robot, angles, robot.limbs)
    answer = plan(ask(stance, body_wrench=np.zeros(6), limits=Limits(joint_torque=5.0)))
    assert answer.status == "overloaded"
    assert answer.limiting.limit == "joint_torque"
    assert f"{answer.limiting.limb}: joint {answer.limiting.joint} would bear" in answer.reason
    joints = {name.joint for name in answer.certificate.irreducible}
    assert joints & {joint for chain in robot.chains.values() for joint in chain.joints}


# As it travels ----------------------------------------------------------------------------------


def reply_of(request: dict) -> tuple[PlanReply, CertificateReply]:
    question = questions.question(msgspec.convert(request, PlanRequest))
    reply = plan_reply(plan(question), None, model=True)
    read = msgspec.json.decode(msgspec.json.encode(reply), type=PlanReply)
    assert read.certificate is not None
    return read, read.certificate


def test_a_reply_alone_proves_itself():
    """Multipliers are not needed: the sets and the direction are."""
    request = wall_request(HEAVY)
    reply, proof = reply_of(request)
    assert reply.status == "overloaded"
    assert proof.utilisation == 1.0
    assert proof.needed == pytest.approx(np.dot(proof.direction, reply.body_wrench))
    assert isinstance(proof.wrench_spaces, msgspec.UnsetType)
    question = questions.question(msgspec.convert(request, PlanRequest))
    body = question.stance.body
    most = 0.0
    for place, hand in zip(question.stance.hands, reply.hands, strict=True):
        most += support_in_body(proof, hand.wrench_space, body, place.pose, 1.0)
    assert most == pytest.approx(proof.supremum, abs=1e-6)
    named = {(name.limb, name.finger, name.phalanx, name.limit) for name in proof.irreducible}
    rows = {
        (hand.limb, row.finger, row.phalanx, row.limit)
        for hand in reply.hands
        for row in hand.wrench_space.rows
    }
    assert named <= rows


def palmless_request() -> dict:
    request = wall_request(HEAVY)
    for hand in request["stance"]["hands"]:
        hand["grasp"]["palm"] = False
    return request


@pytest.mark.parametrize("request_of", [lambda: wall_request(HEAVY), palmless_request])
def test_a_person_reads_what_is_missing_and_what_is_in_the_way_in_80_columns(request_of):
    reply, proof = reply_of(request_of())
    out = io.StringIO()
    print_plan(reply, Console(file=out, width=80, markup=False))
    lines = out.getvalue().splitlines()
    assert max(len(line) for line in lines) <= 80
    for name, wrench in (("nearest held", proof.nearest), ("missing", proof.shortfall)):
        (row,) = (line for line in lines if line.strip().startswith(f"{name} "))
        told = [float(cell) for cell in row.split()[-6:]]
        np.testing.assert_allclose(told, wrench, atol=0.051)
    words = {word.strip(",") for line in lines for word in line.split()}
    assert {name.limit for name in proof.irreducible} <= words


def test_a_reply_without_a_plan_carries_the_sets():
    request = palmless_request()
    reply, proof = reply_of(request)
    assert reply.status == "infeasible"
    assert proof.utilisation is None
    question = questions.question(msgspec.convert(request, PlanRequest))
    most = sum(
        support_in_body(
            proof, proof.wrench_spaces[place.limb], question.stance.body, place.pose, None
        )
        for place in question.stance.hands
    )
    assert most == pytest.approx(proof.supremum, abs=1e-6)
    assert most < np.dot(proof.direction, reply.body_wrench)


def support_in_body(proof, space, body, pose, cap) -> float:
    """The most of direction · body wrench that one hand gives, from a reply's numbers."""
    force, moment = np.array(proof.direction[:3]), np.array(proof.direction[3:])
    lever = body.rotation.T @ (pose.position - body.position)
    turn = body.rotation.T @ pose.rotation
    row = -np.concatenate([turn.T @ (force + np.cross(moment, lever)), turn.T @ moment])
    generators = np.array([column.wrench for column in space.generators]).T
    kept = [row for row in space.rows if row.kind == "hard" or cap is not None]
    A = np.array([each.coefficients for each in kept])
    b = np.array(
        [
            each.capacity if each.kind == "hard" else cap * each.capacity - each.constant
            for each in kept
        ]
    )
    result = peer.solve(-(row @ generators), A, b, bounds=(-peer.HUGE, peer.HUGE))
    assert result.status == 0
    return float(row @ space.origin - result.fun)
