"""Replies that a caller can check with nothing but them and the request."""

from __future__ import annotations

import json
import math

import msgspec
import numpy as np
import pytest
from scipy.optimize import linprog

import planner
from hand_models.base import InvalidInputError, SolverError, UnsupportedError, wrench_transport
from hand_models.tile import Surface
from planner import solving
from service import answering
from service.answering import dispatch, hand_spaces, questions
from service.replies import WrenchSpaceReply
from service.requests import WrenchSpaceRequest
from tests.suite.helpers.replies import PLAN, departures, refusal, reply_to
from tests.suite.helpers.requests import (
    HEAVY,
    JOINTS,
    JSON,
    MSGPACK,
    flat_request,
    plan_request,
    pose_of,
    request_with_joints,
    wall_request,
)

WRENCH_SPACE = "crux/robosimian/wrench_space"


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_a_reply_can_be_checked_with_nothing_but_it_and_the_request(form: str) -> None:
    request = wall_request() | {"want": ["model", "load_factor", "prices"]}
    reply = reply_to(request, form)
    assert (reply.v, reply.id, reply.status, reply.verified) == (1, "wall", "optimal", True)
    body = pose_of(request["stance"]["body"]).inverse()
    balance = -np.array(reply.body_wrench)
    for asked, hand in zip(request["stance"]["hands"], reply.hands, strict=True):
        assert hand.limb == asked["limb"]
        palm = np.array(hand.palm.force)
        total = np.concatenate([palm, np.cross(hand.palm.position, palm) + hand.palm.moment])
        loads = {}
        for finger in hand.fingers:
            loads[f"{finger.name}/tension"] = finger.tendon_tension
            assert [t.phalanx for t in finger.tiles[-3:]] == ["proximal", "middle", "distal"]
            assert len(finger.tiles) == (4 if finger.name.startswith("outer") else 3)
            for tile in finger.tiles:
                force = (
                    tile.shear * np.array(tile.shear_axis)
                    + tile.normal * np.array(tile.normal_axis)
                    + tile.lateral * np.array(tile.lateral_axis)
                )
                np.testing.assert_allclose(tile.force, force, atol=1e-9)
                total += np.concatenate([tile.force, np.cross(tile.position, tile.force)])
                law = np.array(tile.load_at_zero) + finger.tendon_tension * np.array(
                    tile.load_per_newton
                )
                np.testing.assert_allclose([tile.shear, tile.normal], law, atol=1e-9)
                assert any(a[2] < 0 for a in tile.half_planes)
                if tile.contact != "none":
                    load = (tile.shear, tile.normal, tile.lateral)
                    used = max(np.dot(a[:3], load) / a[3] for a in tile.half_planes)
                    assert tile.utilisation == pytest.approx(max(used, 0.0), abs=1e-9)
                assert tile.utilisation <= hand.utilisation + 1e-9
        np.testing.assert_allclose(hand.wrench, total, atol=1e-6)
        assert hand.utilisation <= reply.utilisation + 1e-9
        balance -= wrench_transport(body @ pose_of(asked["pose"])) @ hand.wrench
        check_rows(hand, loads, reply.utilisation)
    np.testing.assert_allclose(balance, reply.residual, atol=1e-9)
    assert np.abs(balance).max() < 1e-3
    assert reply.load_factor > 1.0
    assert reply.limiting.limb in {hand.limb for hand in reply.hands}
    assert all(price.price > 0.0 for price in reply.prices)


def check_rows(hand, loads: dict[str, float], utilisation: float) -> None:
    """The reply's own loads satisfy the rows of its wrench space, and give its wrench."""
    space = hand.wrench_space
    loads["palm_shear"], loads["palm_pressing"] = -hand.palm.force[0], hand.palm.force[2]
    lateral = {
        f"{finger.name}/lateral": sum(tile.lateral for tile in finger.tiles)
        for finger in hand.fingers
    }
    y = np.array([(loads | lateral)[generator.name] for generator in space.generators])
    V = np.array([generator.wrench for generator in space.generators]).T
    np.testing.assert_allclose(np.array(space.origin) + V @ y, hand.wrench, atol=1e-6)
    for row in space.rows:
        load = np.dot(row.coefficients, y) + row.constant
        allowed = row.capacity * utilisation if row.kind == "limit" else row.capacity
        assert load <= allowed + 1e-5, row.name
    assert len({row.name for row in space.rows}) == len(space.rows)


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_what_is_asked_of_joints_forces_and_tensions_is_in_the_reply(form: str) -> None:
    request = request_with_joints()
    reply = reply_to(request, form)
    assert (reply.status, reply.verified) == ("optimal", True)
    assert reply.utilisation <= 0.95
    assert reply.effort > 0.0
    assert reply.effort_prices is not None
    limits = {limb: [200.0] * 7 for limb in JOINTS}
    limits |= {"front_left": [150.0] * 7, "rear_left": [180.0] * 7}
    assert reply.joint_torque_limit == limits
    for limb, torques in reply.joint_torque.items():
        assert (np.abs(torques) <= np.multiply(0.95 + 1e-6, limits[limb])).all()
        np.testing.assert_allclose(reply.joints[limb], JOINTS[limb])
    hands = {hand.limb: hand for hand in reply.hands}
    assert hands["rear_right"].wrench[2] == pytest.approx(20.0, abs=1e-3)
    assert np.linalg.norm(hands["rear_left"].wrench[:3]) <= 400.0
    places = {hand["limb"]: pose_of(hand["pose"]) for hand in request["stance"]["hands"]}
    body = pose_of(request["stance"]["body"])
    force = body.rotation.T @ places["front_left"].rotation @ hands["front_left"].wrench[:3]
    assert abs(force[0]) <= 0.95 * 300.0 + 1e-3
    assert -0.95 * 250.0 - 1e-3 <= force[2] <= 0.95 * 300.0 + 1e-3
    for limb, present in request["present"].items():
        tensions = [finger.tendon_tension for finger in hands[limb].fingers]
        assert np.abs(np.subtract(tensions, present)).max() <= 60.0 + 1e-3


def test_every_field_of_the_contract_is_there_and_nothing_of_the_model_unasked() -> None:
    answer = dispatch.handle(PLAN, msgspec.json.encode(wall_request()))
    reply = json.loads(answer.payload)
    assert set(reply) >= {
        "v", "id", "status", "body_wrench", "utilisation", "load_factor",
        "load_factor_unbounded", "survival_probability", "limiting", "hands", "joint_torque",
        "prices", "certificate", "residual", "verified", "solver", "time", "reason",
    }  # fmt: skip
    finger = reply["hands"][0]["fingers"][0]
    assert set(finger) == {
        "name", "closure", "tendon_tension", "motor_torque", "motor_current", "winch_angle", "tiles"
    }  # fmt: skip
    assert finger["closure"] == "laid"
    assert reply["survival_probability"] is reply["joint_torque"] is reply["prices"] is None
    assert "load_at_zero" not in finger["tiles"][0]
    assert "wrench_space" not in reply["hands"][0]


def test_an_infeasible_stance_comes_with_its_certificate() -> None:
    request = flat_request()
    request["stance"]["hands"][0]["grasp"]["palm"] = False
    reply = reply_to(request)
    assert reply.status == "infeasible"
    assert reply.hands is None
    assert reply.utilisation is None
    proof = reply.certificate
    asked = np.dot(proof.direction, reply.body_wrench)
    assert proof.needed == pytest.approx(asked)
    assert proof.supremum < proof.needed
    np.testing.assert_allclose(np.add(proof.nearest, proof.shortfall), reply.body_wrench)


def test_an_overloaded_stance_still_has_its_best_plan() -> None:
    reply = reply_to(wall_request(HEAVY))
    assert reply.status == "overloaded"
    assert reply.utilisation > 1.0
    assert reply.hands


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (InvalidInputError("no", field="stance.hands[0]"), "invalid"),
        (UnsupportedError("no", field="stance"), "unsupported"),
        (SolverError("no"), "internal"),
        (RuntimeError("no"), "internal"),
        (RecursionError("no"), "internal"),
    ],
)
def test_whatever_the_planner_does_the_caller_gets_an_error(
    error: Exception, kind: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_: object) -> None:
        raise error

    monkeypatch.setattr(planner, "plan", fail)
    got, _, message = refusal(wall_request())
    assert got == kind
    assert ("Traceback" in caplog.text) == (kind == "internal")
    if kind == "internal":
        assert type(error).__name__ in message


def test_a_lack_of_memory_is_for_the_process_to_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(planner, "plan", fail)
    with pytest.raises(MemoryError):
        refusal(wall_request())


# Wrench spaces ------------------------------------------------------------------------------------


def wrench_space_request(limb: str = "front_left") -> dict:
    return {"v": 1, "stance": flat_request()["stance"], "limb": limb}


def test_a_wrench_space_and_its_views_agree() -> None:
    answer = dispatch.handle(WRENCH_SPACE, msgspec.json.encode(wrench_space_request()))
    assert answer.good, answer.payload
    assert answer.encoding == "application/json;crux.WrenchSpaceReply@1"
    reply = msgspec.json.decode(answer.payload, type=WrenchSpaceReply)
    assert (reply.robot, reply.limb) == ("robosimian", "front_left")
    assert reply.seating.rule == "pinch"
    assert reply.seating.pose.position[2] == pytest.approx(2.3e-3, abs=1e-4)
    assert [limit.finger for limit in reply.tension_limits] == [
        "outer_left", "inner_left", "inner_right", "outer_right",
    ]  # fmt: skip
    assert len(reply.contacts) == 14
    vertices = np.array(reply.vertices)
    faces = reply.half_spaces
    assert (vertices @ np.array(faces.normals).T <= np.array(faces.offsets) + 1e-6).all()
    flat = vertices @ np.array(faces.equations.normals).T
    np.testing.assert_allclose(
        flat, np.tile(faces.equations.offsets, (len(vertices), 1)), atol=1e-6
    )
    assert reply.dimension == 6 - len(faces.equations.offsets)
    axes = ("fx", "fy", "fz", "mx", "my", "mz")
    assert set(reply.capability) == {sign + axis for sign in "+-" for axis in axes}
    for i, axis in enumerate(axes):
        for sign, factor in (("+", 1.0), ("-", -1.0)):
            reach = reply.capability[sign + axis]
            extent = (factor * vertices[:, i]).max()
            assert reach.extent == pytest.approx(extent, abs=1e-6)
            assert reach.pure is None or reach.pure <= reach.extent + 1e-6
    for way in ("-fz", "-fx", "+fx", "-fy", "+fy"):
        able = reply.capability[way].pure is not None and reply.capability[way].pure >= 0.1
        assert (way in reply.cannot) != able
    assert {row.kind for row in reply.rows} == {"limit", "hard"}
    assert all(row.constant == 0.0 for row in reply.rows if row.kind == "hard")


def test_an_axis_that_meets_a_set_on_its_far_side_alone_is_told_below_zero() -> None:
    below = 0
    for shape, diameter, surface, rotation in (
        ("cylinder", 0.3, "concrete-fine", 0.0),
        ("sphere", 0.25, "rock", math.pi),
    ):
        stance = flat_request()["stance"]
        stance["hands"][0] |= {
            "hold": {"shape": shape, "diameter": diameter},
            "surface": surface,
            "grasp": {"outer_rotation": rotation, "lateral": False},
        }
        request = {"v": 1, "stance": stance, "limb": stance["hands"][0]["limb"]}
        answer = dispatch.handle(WRENCH_SPACE, msgspec.json.encode(request))
        assert answer.good, answer.payload
        reply = msgspec.json.decode(answer.payload, type=WrenchSpaceReply)
        vertices = np.array(reply.vertices)
        for i, axis in enumerate(("fx", "fy", "fz", "mx", "my", "mz")):
            for sign, factor in (("+", 1.0), ("-", -1.0)):
                # the farthest mixture of vertices on the line through zero along the axis
                others = np.delete(vertices, i, axis=1).T
                found = linprog(
                    -factor * vertices[:, i],
                    A_eq=np.vstack([others, np.ones(len(vertices))]),
                    b_eq=np.append(np.zeros(5), 1.0),
                )
                pure = reply.capability[sign + axis].pure
                if pure is None:
                    assert found.status == 2
                    continue
                assert pure == pytest.approx(-found.fun, abs=1e-5)
                below += pure < -1e-3
    assert below > 0


def test_a_hand_that_is_not_there() -> None:
    kind, field, message = refusal(wrench_space_request("rear_left"), WRENCH_SPACE)
    assert (kind, field) == ("invalid", "limb")
    assert "front_left" in message


def test_numbers_that_do_not_exist_are_null(monkeypatch: pytest.MonkeyPatch) -> None:
    from hand_models.fixed_wrist import TensionLimit

    endless = (TensionLimit("inner_left", math.inf, None),)
    monkeypatch.setattr(hand_spaces, "tension_limits", lambda _: endless)
    request = msgspec.msgpack.encode(wrench_space_request())
    answer = dispatch.handle(WRENCH_SPACE, request, MSGPACK)
    reply = msgspec.msgpack.decode(answer.payload, type=WrenchSpaceReply)
    assert reply.tension_limits[0].tension is None


def test_a_hand_that_can_carry_nothing_still_tells_its_seating_and_rows() -> None:
    request = wrench_space_request()
    for hand in request["stance"]["hands"]:
        hand["surface"] = {"shear_limit": 0.5}
    answer = dispatch.handle(WRENCH_SPACE, json.dumps(request).encode())
    assert answer.good
    reply = msgspec.json.decode(answer.payload, type=WrenchSpaceReply)
    assert reply.vertices == []
    assert reply.half_spaces is None
    assert reply.dimension is None
    assert reply.capability is None
    assert reply.cannot is None
    assert reply.rows


@pytest.mark.usefixtures("few_places")
def test_a_wrench_space_tells_what_is_left_where_the_hand_is_a_little_elsewhere():
    request = WrenchSpaceRequest(
        v=1, stance=plan_request(wall_request()).stance, limb="front_left", want=["robust"]
    )
    reply = answering.answer_wrench_space(request)
    robust = reply.robust
    assert (robust.draws, robust.without, robust.seed) == (8, 0, 0)
    assert set(robust.hundredth) == set(robust.tenth) == set(reply.capability)
    assert robust.worst == robust.hundredth
    assert set(robust.pure_tenth) == set(robust.share) == {f"{s}f{a}" for s in "+-" for a in "xyz"}
    assert robust.force == 0.1
    for way, share in robust.share.items():
        assert (robust.pure_tenth[way] >= robust.force) == (share > 0.9)
        assert robust.pure_tenth[way] <= max(robust.tenth[way], 0.0)
    for axis, nominal in reply.capability.items():
        assert robust.hundredth[axis] <= robust.tenth[axis]
        assert robust.hundredth[axis] < nominal.extent
    plain = answering.answer_wrench_space(msgspec.structs.replace(request, want=[]))
    assert "robust" not in msgspec.to_builtins(plain)


@pytest.mark.usefixtures("few_places")
def test_a_plan_tells_its_load_factor_where_the_hands_are_a_little_elsewhere():
    asked = flat_request() | {"want": ["load_factor", "robust"]}
    reply = answering.answer_plan(plan_request(asked))
    robust = reply.robust
    assert (robust.draws, robust.position, robust.angle, robust.seed) == (128, 0.002, 0.02, 0)
    assert robust.worst == robust.hundredth <= robust.tenth < reply.load_factor
    low, high = robust.tenth_interval
    assert low <= robust.tenth <= high
    assert robust.without >= max(robust.refused.values(), default=0)
    assert departures("PlanRequest", asked) == []
    assert departures("PlanReply", msgspec.to_builtins(reply)) == []
    plain = answering.answer_plan(plan_request(flat_request()))
    assert "robust" not in msgspec.to_builtins(plain)


def own_draw(value: float, unit: str = "N") -> dict:
    entry = {"value": value, "unit": unit, "source": "measured"}
    return {"surfaces": {"rock": {"shear_limit": entry}}}


def test_a_plan_tells_its_spread_over_draws():
    asked = flat_request() | {"want": ["load_factor", "spread"]}
    reply = answering.answer_plan(plan_request(asked))
    spread = reply.spread
    assert spread.draws == len(spread.load_factors) >= 30
    assert spread.holds == sum(used <= 1.0 for used in spread.utilisations if used is not None)
    assert spread.load_factor.low < reply.load_factor < spread.load_factor.high
    assert departures("PlanRequest", asked) == []
    assert departures("PlanReply", msgspec.to_builtins(reply)) == []
    plain = answering.answer_plan(plan_request(flat_request()))
    assert "spread" not in msgspec.to_builtins(plain)


def test_a_plans_spread_over_draws_of_the_callers_own_travels():
    rock = Surface.named("rock").shear_limit
    draws = [own_draw(strength) for strength in (0.7 * rock, rock, 1.35 * rock)]
    asked = flat_request() | {"want": ["load_factor", "spread"], "draws": draws}
    assert departures("PlanRequest", asked) == []
    for encoding, coder in (("application/json", msgspec.json), (MSGPACK, msgspec.msgpack)):
        answer = dispatch.handle(PLAN, coder.encode(asked), encoding)
        assert answer.good, answer.payload
        reply = coder.decode(answer.payload)
        low, usual, high = reply["spread"]["load_factors"]
        assert low < usual < high
        assert usual == pytest.approx(reply["load_factor"], rel=1e-6)
        assert reply["spread"]["sensitive_to"] == [
            {"quantity": "rock.shear_limit", "share": 1.0, "source": "measured"}
        ]
        assert reply["spread"]["hangs_on"] == reply["spread"]["sensitive_to"]


@pytest.mark.parametrize("detail", ["set_points", "hands"])
def test_what_brief_replies_do_not_tell_is_not_found(monkeypatch, detail):
    asked, planned = [], solving.plan(questions.question(plan_request(flat_request())))
    monkeypatch.setattr(
        dispatch.planner, "plan", lambda question: asked.append(question) or planned
    )
    want = ["load_factor", "spread", "prices"]
    draws = [own_draw(Surface.named("rock").shear_limit)]
    request = flat_request() | {"want": want, "draws": draws, "detail": detail}
    answering.answer_plan(plan_request(request))
    assert asked[0].want == ({"load_factor"} if detail == "hands" else set())


def test_draws_that_cannot_be_are_refused_by_their_field():
    for draws, field in [
        ([own_draw(60.0), own_draw(60.0, "kN")], "draws[1].surfaces.rock.shear_limit"),
        ([own_draw(-1.0)], "draws[0].surfaces.rock.shear_limit"),
        ([own_draw(0.0)], "draws[0].surfaces.rock.shear_limit"),
        ([{"hand": {"finger": {"reach": 1.0}}}], "draws[0].hand.finger.reach"),
        ([{"hand": 3}], "draws[0].hand"),
        ([{"stance": {}}], "draws[0].stance"),
        ([{}], "draws[0]"),
        ([own_draw(60.0)] * 101, "draws"),
    ]:
        asked = flat_request() | {"want": ["spread"], "draws": draws}
        answer = dispatch.handle(PLAN, json.dumps(asked).encode())
        assert not answer.good
        error = json.loads(answer.payload)["error"]
        assert error["kind"] == "invalid"
        assert error["field"] == field
        assert "\n" not in error["message"]


def test_robust_is_told_of_fixed_wrists_only():
    request = plan_request(wall_request())
    first, *others = request.stance.hands
    floating = msgspec.structs.replace(first, wrist="floating")
    stance = msgspec.structs.replace(request.stance, hands=[floating, *others])
    asked = WrenchSpaceRequest(v=1, stance=stance, limb=first.limb, want=["robust"])
    with pytest.raises(InvalidInputError, match="requires fixed wrists") as caught:
        answering.answer_wrench_space(asked)
    assert caught.value.field == "want"
    with pytest.raises(InvalidInputError, match="requires fixed or compliant") as caught:
        answering.answer_plan(msgspec.structs.replace(request, stance=stance, want=["robust"]))
    assert caught.value.field == "want"
