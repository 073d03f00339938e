"""Plans with floating hands: exact by the model, least nearby, and told whole."""

import math
import random
from dataclasses import replace
from functools import cache

import msgspec
import numpy as np
import pytest
from msgspec import structs

from hand_models.base import InvalidInputError, UnsupportedError, wrench_transport
from hand_models.finger import settle_finger
from planner.prepare import settle_hand
from planner.programs import TWIST_UNIT
from planner.question import Load, Question
from planner.result import Plan
from planner.solving import plan
from service.answering import handle, questions
from service.commands.stances import read_request
from service.requests import PlanRequest, WrenchSpaceRequest
from service.serving import CruxClient, PlanService
from service.wire import decode_request
from tests.suite.helpers.checks import problems
from tests.suite.helpers.floating_hands import NEAR, PAIR, REAR, body_wrench, floating, wrist_of
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.requests import LIGHT, spoil, wall_request
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall


@cache
def mixed() -> tuple[Question, Plan]:
    """The bundled stance, less laden: two hands with fixed wrists above two floating ones."""
    question = questions.question(read_request("wall-300-floating"))
    light = Load(mass=95.0)
    question = replace(question, load=light, want=frozenset(["load_factor", "prices"]))
    return question, plan(question)


@cache
def pair() -> tuple[Question, Plan]:
    """Two floating hands."""
    question = Question(PAIR, body_wrench=body_wrench(PAIR, [NEAR, NEAR]))
    return question, plan(question)


def test_set_is_tangent_to_the_model():
    wrist = wrist_of(PAIR.hands[0], PAIR)
    space = wrist.linearised(NEAR)
    steps = 1e-4 * np.diag(TWIST_UNIT)
    up, down = (wrist.hand.loads(NEAR + sign * steps).wrenches for sign in (1.0, -1.0))
    slopes = ((up - down) / (2.0 * np.diag(steps)[:, None])).T
    np.testing.assert_allclose(
        space.generators * TWIST_UNIT, slopes * TWIST_UNIT, atol=1e-5 * np.abs(slopes).max() * 1e-3
    )
    exact = wrist.hand.loads(NEAR[None]).wrenches[0]
    np.testing.assert_allclose(space.wrench(NEAR), exact, atol=1e-9)
    judged = wrist.evaluate(NEAR[None]).utilisation[0]
    assert space.utilisations(NEAR).max() == pytest.approx(judged, abs=1e-9)


@pytest.mark.parametrize("found", [mixed, pair])
def test_model_confirms_the_plan(found):
    question, answer = found()
    assert answer.status == "optimal"
    assert answer.verified
    body = question.stance.body.inverse()
    total = np.zeros(6)
    for place, hand in zip(question.stance.hands, answer.hands, strict=True):
        total -= wrench_transport(body @ place.pose) @ hand.wrench
        if hand.wrist is None:
            continue
        wrist = wrist_of(place, question.stance)
        loads = wrist.hand.loads(hand.wrist.twist[None])
        tiles = [tile for finger in hand.fingers for tile in finger.tiles]
        told = np.array([(t.shear, t.normal, t.lateral) for t in tiles])
        np.testing.assert_allclose(told, loads.tile_loads[0], atol=1e-9)
        tensions = [finger.tendon_tension for finger in hand.fingers]
        np.testing.assert_allclose(tensions, loads.tensions[0], atol=1e-9)
        np.testing.assert_allclose(hand.wrench, loads.wrenches[0], atol=1e-9)
        verdict = wrist.evaluate(hand.wrist.twist[None])
        assert verdict.utilisation[0] == pytest.approx(hand.utilisation, abs=1e-7)
        assert verdict.violation[0] <= 1e-6
    size = np.linalg.norm(answer.body_wrench)
    assert np.linalg.norm(total - answer.body_wrench) <= 1e-6 * size
    assert answer.utilisation == max(hand.utilisation for hand in answer.hands)


def test_fingers_are_where_they_settle_from_the_displaced_base():
    """Contacts on a cylinder, found by the search that closes a finger on any rock.

    Of wrists that stay so near that no contact runs off its tile's face. Forces act where the bed
    of springs presses in the middle that is between the face and the rock.
    """
    question, answer = pair()
    place, hand = question.stance.hands[1], answer.hands[1]
    settled = settle_hand(place, question.stance)
    turn = np.cross(np.eye(3), hand.wrist.twist[3:])
    for name, frame, finger in zip(
        ("outer_left", "inner_left"),
        [settled.hand.frames(place.grasp.outer_rotation)[i] for i in (0, 1)],
        [hand.fingers[i] for i in (0, 1)],
        strict=True,
    ):
        step = hand.wrist.twist[:3] + turn @ frame.joint + 0.5 * turn @ turn @ frame.joint
        section = settled.hand.section(name, place.hold, place.grasp, settled.seating.pose)
        model = replace(settled.hand.finger, joint_lower=(-1.6,) * 3)
        anew = settle_finger(model, section, (float(step @ frame.along), float(step[2])))
        depths = model.depths(name.startswith("outer")) * settled.closing_tension
        for tile, contact, depth in zip(finger.tiles[-3:], anew.contacts, depths, strict=True):
            x, z = pressed(model, section, contact, depth).point(model.tile_height)
            expected = frame.joint + x * frame.along + z * np.array([0.0, 0.0, 1.0])
            np.testing.assert_allclose(tile.position, expected, atol=2e-8)


def pressed(model, section, contact, depth):
    """A contact at the middle of the pressures, summed up along the tile's face."""
    near, far = model.tile_range
    places = np.linspace(near, far, 20001)
    u = np.array([math.cos(contact.angle), math.sin(contact.angle)])
    face = np.outer(places, u) + contact.joint + model.tile_height * np.array([-u[1], u[0]])
    away = np.array([section.centre.real, section.centre.imag]) - face
    # up to the fourth order the distance from the circle, of parabolas
    heights = (away @ u) ** 2 / (2.0 * section.radius)
    pressures = np.maximum(depth - heights, 0.0)
    return replace(contact, along=float(np.trapezoid(pressures * places) / np.trapezoid(pressures)))


@pytest.mark.slow
def test_nothing_near_a_plan_is_better():
    """Other poses that balance, found with the hands' stiffness alone, use at least as much."""
    question, answer = pair()
    stance, chance = question.stance, np.random.default_rng(3)
    wrists = [wrist_of(hand, stance) for hand in stance.hands]
    body = stance.body.inverse()
    carried = [-wrench_transport(body @ hand.pose) for hand in stance.hands]
    best = np.concatenate([hand.wrist.twist for hand in answer.hands])
    unit = np.tile(TWIST_UNIT, 2)
    balanced = 0
    for size in np.geomspace(1e-3, 1.0, 16):
        x = best + size * unit * chance.normal(size=12)
        for _ in range(8):
            parts = np.split(x, 2)
            total = sum(
                A @ w.hand.loads(p[None]).wrenches[0]
                for A, w, p in zip(carried, wrists, parts, strict=True)
            )
            slopes = np.hstack(
                [A @ w.hand.stiffness(p) for A, w, p in zip(carried, wrists, parts, strict=True)]
            )
            x = x + unit * np.linalg.lstsq(slopes * unit, question.body_wrench - total)[0]
        if not np.abs(total - question.body_wrench).max() <= 1e-6:
            continue
        verdicts = [w.evaluate(p[None]) for w, p in zip(wrists, np.split(x, 2), strict=True)]
        if max(float(v.violation[0]) for v in verdicts) <= 0.0:
            balanced += 1
            used = max(float(v.utilisation[0]) for v in verdicts)
            assert used >= answer.utilisation * (1.0 - 1e-5)
    assert balanced >= 5


def test_hand_asked_for_its_wrench_at_rest_stays_there():
    stance = floating(on_wall(limbs=("rear_left",)), "rear_left")
    answer = plan(Question(stance, body_wrench=body_wrench(stance, [np.zeros(6)])))
    assert answer.status == "optimal"
    np.testing.assert_allclose(answer.hands[0].wrist.twist, 0.0, atol=1e-9)
    settled = settle_hand(stance.hands[0], stance)
    told = [t.shear for f in answer.hands[0].fingers for t in f.tiles]
    at_rest = settled.loads[:, 0] @ [1.0, settled.closing_tension]
    np.testing.assert_allclose(told, at_rest, atol=1e-6)


@pytest.mark.slow
def test_symmetric_stance_has_a_symmetric_plan():
    answer = plan(ask(floating(on_wall(), *REAR, preload=np.full(4, 60.0)), load=CALIBRATION_LOAD))
    right, left = (hand.wrist.twist for hand in answer.hands if hand.wrist is not None)
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(right / TWIST_UNIT, mirror * left / TWIST_UNIT, atol=2e-3)


def test_preload_holds_at_rest_and_limits_count_it():
    preload = np.array([45.0, 50.0, 55.0, 60.0])
    stance = floating(on_wall(limbs=("rear_left",)), "rear_left", preload=preload)
    question = Question(stance, body_wrench=body_wrench(stance, [np.zeros(6)]))
    answer = plan(question)
    tensions = [finger.tendon_tension for finger in answer.hands[0].fingers]
    np.testing.assert_allclose(tensions, preload, atol=1e-6)
    capped = plan(replace(question, limits=structs.replace(question.limits, tendon_tension=30.0)))
    assert capped.status == "overloaded"
    assert capped.utilisation == pytest.approx(2.0, rel=1e-6)
    assert capped.limiting.finger == "outer_right"


def test_load_factor_is_where_utilisation_is_one():
    question, answer = mixed()
    factor = answer.load_factor
    assert factor > 1.0
    more = plan(replace(question, body_wrench=factor * answer.body_wrench, want=frozenset()))
    assert more.utilisation == pytest.approx(1.0, abs=2e-5)


@pytest.mark.parametrize(
    ("change", "error", "field"),
    [
        ({"wrist": "limp"}, InvalidInputError, "wrist"),
        ({"tendon_preload": np.ones(4)}, InvalidInputError, "tendon_preload"),
        ({"wrist": "floating", "tendon_preload": np.ones(3)}, InvalidInputError, "tendon_preload"),
    ],
)
def test_impossible_wrists_are_refused(change, error, field):
    with pytest.raises(error) as caught:
        replace(on_wall().hands[0], **change)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("grasp", "preload", "error", "field"),
    [
        ({"fingernail": True, "outer_rotation": 0.0}, None, UnsupportedError, "wrist"),
        ({}, np.full(4, -1.0), InvalidInputError, "tendon_preload"),
        ({}, np.full(4, 1e4), InvalidInputError, "tendon_preload"),
    ],
)
def test_hands_that_cannot_float_are_refused(grasp, preload, error, field):
    stance = floating(on_wall(**grasp), "rear_left", preload=preload)
    with pytest.raises(error) as caught:
        plan(ask(stance))
    assert caught.value.field == f"stance.hands[2].{field}"


@pytest.mark.parametrize("spoilt", ["twist", "shear", "tension", "palm", "wrist"])
def test_check_finds_what_is_wrong(spoilt):
    question, answer = mixed()
    hand = answer.hands[1]
    palm = hand.palm
    if spoilt == "twist":
        aside = hand.wrist.twist + np.array([0.0, 0.0, 1e-6, 0.0, 0.0, 0.0])
        hand = replace(hand, wrist=replace(hand.wrist, twist=aside))
    elif spoilt == "palm":
        hand = replace(
            hand, palm=structs.replace(palm, force=palm.force + np.array([0.0, 0.0, 0.1]))
        )
    elif spoilt == "wrist":
        hand = replace(hand, wrist=None)
    else:
        # the first tile of inner_left, and its tendon
        name, index = {"shear": ("loads", (4, 0)), "tension": ("tensions", 1)}[spoilt]
        numbers = getattr(hand, name).copy()
        numbers[index] += 0.01
        hand = replace(hand, **{name: numbers})
    hands = (answer.hands[0], hand, *answer.hands[2:])
    assert problems(question, replace(answer, hands=hands))
    assert not problems(question, answer)


def test_no_plan_is_dressed_up():
    """Two hands at their closing tension cannot hang the robot; what is said of it is checked."""
    answer = plan(ask(floating(on_wall(limbs=REAR), *REAR)))
    assert answer.status in ("infeasible", "failed", "overloaded")
    if answer.status == "infeasible":
        proof = answer.certificate
        assert proof.direction @ answer.body_wrench > proof.supremum
    elif answer.status == "failed":
        assert answer.hands is None
        assert not answer.verified


# As it travels ----------------------------------------------------------------------------------


@pytest.mark.slow
def test_reply_over_zenoh_tells_the_wrists(alone):
    bundled, light = read_request("wall-300-floating"), Load(mass=95.0)
    request = msgspec.structs.replace(bundled, load=light, want=["model"])
    with PlanService(alone, workers=1):
        reply = CruxClient(alone, timeout=PATIENCE).plan(request)
    assert reply.status == "optimal"
    assert [hand.wrist.mode for hand in reply.hands] == ["fixed", "floating", "floating", "fixed"]
    for hand in reply.hands:
        space = hand.wrench_space
        if hand.wrist.mode == "fixed":
            assert hand.wrist.twist is None
            continue
        generators = np.array([column.wrench for column in space.generators]).T
        wrench = np.array(space.origin) + generators @ np.array(hand.wrist.twist)
        np.testing.assert_allclose(wrench, hand.wrench, atol=1e-6)
        for row in space.rows:
            load = np.array(row.coefficients) @ hand.wrist.twist + row.constant
            room = reply.utilisation if row.kind == "limit" else 1.0
            assert load <= room * row.capacity + 1e-5
        for tile in (tile for finger in hand.fingers for tile in finger.tiles):
            axes = np.array([tile.shear_axis, tile.normal_axis, tile.lateral_axis])
            force = np.array([tile.shear, tile.normal, tile.lateral]) @ axes
            np.testing.assert_allclose(force, tile.force, atol=1e-9)


def test_wrench_space_of_a_floating_hand():
    request = read_request("wall-300-floating")
    question = msgspec.json.encode(WrenchSpaceRequest(v=1, stance=request.stance, limb="rear_left"))
    answer = handle("crux/robosimian/wrench_space", question)
    reply = msgspec.json.decode(answer.payload)
    assert answer.good
    assert reply["wrist"]["mode"] == "floating"
    assert reply["wrist"]["error"] > 0.0
    assert [column["name"] for column in reply["generators"]][:2] == ["wrist/vx", "wrist/vy"]
    assert reply["dimension"] == 6


@pytest.mark.slow
def test_spoilt_requests_get_an_answer():
    request = wall_request(LIGHT, limbs=("rear_left",))
    request["stance"]["hands"][0] |= {"wrist": "floating", "tendon_preload": [40, 50, 50, 40]}
    assert decode_request(msgspec.json.encode(request), PlanRequest).stance.hands[0].tendon_preload
    chance = random.Random(7)
    for _ in range(15):
        payload, encoding = spoil(request, chance)
        answer = handle("crux/robosimian/plan", payload, encoding)
        if not answer.good:
            decode = msgspec.msgpack if "msgpack" in answer.encoding else msgspec.json
            error = decode.decode(answer.payload)["error"]
            assert error["kind"] != "internal", error


def test_a_wrench_that_a_floating_hand_is_not_found_to_give_is_not_proven_impossible():
    stance = on_wall(limbs=("front_left", "rear_right"))
    first, second = stance.hands
    given = replace(first, wrist="floating", wrench=(None, None, 1e5, None, None, None))
    answer = plan(ask(replace(stance, hands=(given, second))))
    assert answer.status == "failed"
    assert answer.certificate is None
    assert "does not prove that there is none" in answer.reason
