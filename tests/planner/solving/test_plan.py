"""What a plan means: statuses, numbers that a caller can check, caps, load factors."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from hand_models.hand import FINGERS, HELD_DIRECTIONS
from hand_models.rock import Cylinder, Plane
from hand_models.tile import inner_half_planes
from planner.deadline import DeadlineError
from planner.prepare import settle_hand
from planner.programs import CAP_SLACK
from planner.question import Limits, Load, Question
from planner.result import Plan
from planner.solving import KnownStance, plan
from tests.suite.helpers import peer
from tests.suite.helpers.hands import limiting
from tests.suite.helpers.stances import SANDPAPER, ask, on_wall, random_answer

LIGHTER = Load(mass=95.0, com=(0.0, 0.0, 0.0))
"""That four pinches of rock hold with something to spare."""

FEW = range(13)

many = pytest.mark.parametrize(
    "seeds", [FEW, pytest.param(range(60), marks=pytest.mark.slow)], ids=["few", "many"]
)
PHALANGES = ("proximal", "middle", "distal")


def feasible(seeds: range) -> list[tuple[Question, Plan]]:
    pairs = [random_answer(seed) for seed in seeds]
    return [(question, answer) for question, answer in pairs if answer.hands is not None]


def test_optimal_has_everything_but_a_certificate():
    answer = plan(ask(on_wall()))
    assert answer.status == "optimal"
    assert answer.utilisation <= 1.0
    assert answer.verified
    assert answer.hands is not None
    assert answer.residual is not None
    assert answer.limiting is not None
    assert answer.certificate is None


def test_overloaded_has_the_plan_of_least_utilisation():
    question = ask(on_wall(Cylinder(0.7)))
    answer = plan(question)
    assert answer.status == "overloaded"
    assert answer.verified
    assert answer.utilisation == pytest.approx(peer.least_utilisation(question).fun, rel=1e-5)
    assert answer.utilisation > 1.0
    assert answer.hands is not None
    assert answer.certificate.utilisation == 1.0
    assert "would carry" in answer.reason


def test_infeasible_has_a_certificate_and_no_plan():
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0), "load_factor", "prices"))
    assert answer.status == "infeasible"
    assert answer.verified
    assert answer.certificate is not None
    for name in ("utilisation", "load_factor", "limiting", "hands", "prices", "residual"):
        assert getattr(answer, name) is None
    assert not answer.load_factor_unbounded


@many
def test_body_wrench_balances_when_it_is_added_up_from_the_tiles(seeds):
    for question, answer in feasible(seeds):
        total = np.zeros(6)
        for i, hand in enumerate(answer.hands):
            on_rock = np.zeros(6)
            for finger in hand.fingers:
                for tile in finger.tiles:
                    axes = np.array([tile.shear_axis, tile.normal_axis, tile.lateral_axis])
                    force = np.array([tile.shear, tile.normal, tile.lateral]) @ axes
                    np.testing.assert_allclose(force, tile.force, rtol=1e-9, atol=1e-9)
                    on_rock += [*force, *np.cross(tile.position, force)]
            palm = hand.palm
            on_rock += [*palm.force, *(palm.moment + np.cross(palm.position, palm.force))]
            size = max(1.0, np.abs(on_rock).max())
            np.testing.assert_allclose(on_rock, hand.wrench, rtol=0, atol=1e-9 * size)
            total += peer.reaction(question, i, on_rock)
        wrench = question.needed_wrench()
        np.testing.assert_allclose(
            total, wrench, rtol=0, atol=1e-6 * max(1.0, np.linalg.norm(wrench))
        )
        np.testing.assert_allclose(answer.residual, total - wrench, rtol=0, atol=1e-8)
        np.testing.assert_array_equal(answer.body_wrench, wrench)


@many
def test_every_hand_finger_and_tile_is_there_in_order(seeds):
    for question, answer in feasible(seeds):
        assert [h.limb for h in answer.hands] == [h.limb for h in question.stance.hands]
        for hand in answer.hands:
            assert tuple(finger.name for finger in hand.fingers) == FINGERS
            for finger in hand.fingers:
                base = ("base",) if finger.name.startswith("outer") else ()
                assert tuple(tile.phalanx for tile in finger.tiles) == base + PHALANGES
                for tile in finger.tiles:
                    axes = np.array([tile.shear_axis, tile.normal_axis, tile.lateral_axis])
                    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


@many
def test_hard_limits_hold_at_any_utilisation(seeds):
    for question, answer in feasible(seeds):
        tiny = 1e-6 * max(1.0, *(np.abs(hand.wrench).max() for hand in answer.hands))
        for hand, place in zip(answer.hands, question.stance.hands, strict=True):
            friction = place.surface.friction
            assert hand.palm.force[0] <= tiny
            assert hand.palm.force[1] == 0.0
            assert hand.palm.force[2] >= -tiny
            # with few spines on the rock a tile may be dragged back a little
            few = place.surface.shear_limit * (hand.limit_shares - hand.engagement)
            back = {(t.finger, t.phalanx): most for t, most in zip(hand.tiles, few, strict=True)}
            for finger in hand.fingers:
                assert finger.tendon_tension >= 0.0
                normals = [tile.normal for tile in finger.tiles]
                for i, tile in enumerate(finger.tiles):
                    # a base tile is pressed as the proximal phalanx after it is
                    pressed = max(normals[i + 1], 0.0) if tile.phalanx == "base" else tile.normal
                    assert (
                        tile.shear >= -friction * pressed - back[finger.name, tile.phalanx] - tiny
                    )
                    if tile.contact == "none":
                        assert not any(tile.force)


@many
def test_utilisations_follow_from_the_loads_and_none_exceeds_the_plans(seeds):
    for question, answer in feasible(seeds):
        robot_hand = question.stance.robot.hand
        used = []
        for hand, place in zip(answer.hands, question.stance.hands, strict=True):
            mine = [hand.palm.utilisation]
            mine.append((HELD_DIRECTIONS @ hand.wrench[:3]).max() / robot_hand.structure.hand_load)
            shares = _shares(place, question.stance)
            for finger in hand.fingers:
                mine.append(finger.tendon_tension / robot_hand.maximum_tension)
                mine += _parts(finger).values()
                mine.append(_sideways(place, shares[finger.name], finger))
                for tile, share in zip(finger.tiles, shares[finger.name], strict=True):
                    law = np.column_stack([tile.load_at_zero, tile.load_per_newton])
                    load = law @ [1.0, finger.tendon_tension]
                    np.testing.assert_allclose(
                        [tile.shear, tile.normal], load, rtol=1e-9, atol=1e-9
                    )
                    # a tile that is not on rock has the limits of a whole one
                    whole = inner_half_planes(place.surface)
                    limits = hand.limits_of(hand.tile(finger.name, tile.phalanx))
                    part = limiting(share) if share else 1.0
                    for own, p in zip(limits, whole, strict=True):
                        assert own[:4] == p[:4]
                        assert own.capacity == pytest.approx(part * p.capacity, rel=1e-12)
                    rows = [
                        (p.a_shear * load[0] + p.a_normal * load[1]) / p.capacity
                        + p.a_lateral * abs(tile.lateral) / p.capacity
                        for p in limits
                    ]
                    expected = max(0.0, *rows) if tile.contact in ("face", "edge") else 0.0
                    assert tile.utilisation == pytest.approx(expected, rel=1e-9, abs=1e-9)
                    mine.append(tile.utilisation)
            assert hand.utilisation == pytest.approx(max(mine), rel=1e-9)
            used.append(hand.utilisation)
        assert answer.utilisation == pytest.approx(max(used), rel=1e-9)


def _parts(finger) -> dict[str, float]:
    """Utilisations of a finger's motor and structure."""
    return {
        "motor_torque": finger.motor_torque / 0.0286,
        "motor_current": finger.motor_current / 1.24,
        "finger_shear": sum(tile.shear for tile in finger.tiles) / 500.0,
        "fingertip_force": finger.tiles[-1].normal / 600.0,
    }


def _shares(place, stance) -> dict[str, list[float]]:
    """How much of its spines each tile has on rock, by finger."""
    settled = settle_hand(place, stance)
    return {
        name: settled.engagement[settled.finger_of == i].tolist() for i, name in enumerate(FINGERS)
    }


def _sideways(place, shares: list[float], finger) -> float:
    """Utilisation of what a finger's tiles hold sideways together."""
    aside = abs(sum(tile.lateral for tile in finger.tiles))
    return aside / (place.surface.lateral_limit * sum(shares)) if aside else 0.0


@many
def test_limiting_names_a_row_at_the_plans_utilisation(seeds):
    for question, answer in feasible(seeds):
        name = answer.limiting
        hand = next(hand for hand in answer.hands if hand.limb == name.limb)
        if name.limit == "hand_load":
            part = (HELD_DIRECTIONS @ hand.wrench[:3]).max() / (50.0 * 9.80665)
        elif name.limit == "finger_lateral":
            place = next(each for each in question.stance.hands if each.limb == name.limb)
            shares = _shares(place, question.stance)[name.finger]
            finger = next(f for f in hand.fingers if f.name == name.finger)
            part = _sideways(place, shares, finger)
        elif name.limit in ("motor_torque", "motor_current", "finger_shear", "fingertip_force"):
            part = _parts(next(f for f in hand.fingers if f.name == name.finger))[name.limit]
        elif name.phalanx is not None:
            finger = next(f for f in hand.fingers if f.name == name.finger)
            part = next(tile for tile in finger.tiles if tile.phalanx == name.phalanx).utilisation
        elif name.finger is not None:
            finger = next(f for f in hand.fingers if f.name == name.finger)
            part = finger.tendon_tension / 700.0
        else:
            part = hand.palm.utilisation
        assert part == pytest.approx(
            answer.utilisation, abs=2.0 * CAP_SLACK * max(1.0, answer.utilisation)
        )
        assert name.limb in answer.reason
        assert "\n" not in answer.reason


def test_status_follows_the_utilisation_cap_and_the_plan_does_not():
    light = ask(on_wall(), load=LIGHTER)
    free = plan(light)
    loose = plan(replace(light, limits=Limits(utilisation=0.95)))
    tight = plan(replace(light, limits=Limits(utilisation=0.8)))
    assert 0.8 < free.utilisation < 0.95
    assert (loose.status, tight.status) == ("optimal", "overloaded")
    assert loose.utilisation == tight.utilisation == free.utilisation
    assert "0.8" in tight.reason


def test_a_utilisation_just_at_the_cap_is_optimal():
    used = plan(ask(on_wall())).utilisation
    assert plan(ask(on_wall(), limits=Limits(utilisation=used))).status == "optimal"
    just_less = used - 10.0 * CAP_SLACK
    assert plan(ask(on_wall(), limits=Limits(utilisation=just_less))).status == "overloaded"


def test_tension_cap_takes_the_place_of_the_hands_own_maximum():
    light = ask(on_wall(), load=LIGHTER)
    answer = plan(replace(light, limits=Limits(tendon_tension=85.0)))
    tensions = [finger.tendon_tension for hand in answer.hands for finger in hand.fingers]
    assert answer.status == "optimal"
    assert max(tensions) <= 85.0
    assert answer.utilisation >= max(tensions) / 85.0 - 1e-9
    assert answer.utilisation > plan(light).utilisation + 0.01
    below = plan(replace(light, limits=Limits(tendon_tension=40.0)))
    assert below.status == "overloaded"
    assert below.limiting.limit == "tendon_tension"
    above = plan(replace(light, limits=Limits(tendon_tension=1e4)))
    assert above.utilisation == plan(light).utilisation


def test_load_factor_times_the_wrench_is_just_held():
    for stance in (on_wall(), on_wall(Cylinder(0.7)), on_wall(surface=SANDPAPER, overhang=-0.5)):
        answer = plan(ask(stance, "load_factor"))
        wrench = answer.body_wrench
        at = plan(ask(stance, body_wrench=answer.load_factor * wrench))
        beyond = plan(ask(stance, body_wrench=1.001 * answer.load_factor * wrench))
        assert at.utilisation == pytest.approx(1.0, abs=1e-5)
        assert beyond.utilisation > 1.0 + 1e-5
        assert (answer.load_factor >= 1.0) == (answer.utilisation <= 1.0)


def test_load_factor_is_given_only_where_it_is_wanted():
    assert plan(ask(on_wall())).load_factor is None
    assert plan(ask(on_wall(), "load_factor")).load_factor > 0.0


def test_load_factor_of_no_wrench_at_all_has_no_end():
    answer = plan(ask(on_wall(), "load_factor", body_wrench=np.zeros(6)))
    assert answer.status == "optimal"
    assert answer.load_factor is None
    assert answer.load_factor_unbounded


def test_load_factor_is_null_where_closing_alone_is_too_much():
    for wrench in (np.zeros(6), None):
        stance = on_wall(surface=SANDPAPER, closing_tension=300.0)
        answer = plan(ask(stance, "load_factor", body_wrench=wrench))
        assert answer.status == "overloaded"
        assert answer.load_factor is None
        assert not answer.load_factor_unbounded


def test_an_infeasible_wrench_may_have_a_load_factor():
    """A small part of a load can be held although the whole of it balances at no utilisation."""
    answer = plan(ask(on_wall(palm=False), "load_factor"))
    assert answer.status == "infeasible"
    assert 0.0 < answer.load_factor < 1.0
    part = answer.load_factor * answer.body_wrench
    assert plan(ask(on_wall(palm=False), body_wrench=0.999 * part)).status == "optimal"
    assert plan(ask(on_wall(palm=False), body_wrench=1.001 * part)).status == "infeasible"


@pytest.mark.parametrize("pairs", [4, pytest.param(12, marks=pytest.mark.slow)])
def test_utilisation_is_convex_in_the_body_wrench(pairs):
    rng = np.random.default_rng(5)
    for stance in (on_wall(), on_wall(Cylinder(0.5), overhang=-0.4, outer_rotation=2.0)):
        weight = ask(stance).needed_wrench()
        for _ in range(pairs):
            size = np.array([300.0] * 3 + [60.0] * 3)
            ends = [weight + rng.uniform(-1.0, 1.0, 6) * size for _ in range(2)]
            first, last = (plan(ask(stance, body_wrench=end)).utilisation for end in ends)
            middle = plan(ask(stance, body_wrench=0.5 * (ends[0] + ends[1]))).utilisation
            if first is not None and last is not None:
                assert middle <= 0.5 * (first + last) + 3e-6 * max(1.0, first, last)


def test_times_add_up():
    time = plan(ask(on_wall())).time
    assert time.model > 0.0
    assert time.solve > 0.0
    assert time.model + time.solve <= time.total


@pytest.mark.parametrize("want", [{"loadfactor"}, "prices", ["prices", "price"]])
def test_extras_that_there_are_not_are_refused(want):
    with pytest.raises(InvalidInputError, match="known are load_factor, prices, model") as caught:
        Question(on_wall(), want=want)
    assert caught.value.field == "want"
    assert Question(on_wall(), want=["prices"]).want == {"prices"}


@pytest.mark.parametrize("asks", [plan, KnownStance])
def test_a_stance_alone_is_no_question(asks):
    with pytest.raises(InvalidInputError, match="a Question is needed, got a Stance"):
        asks(on_wall())


def test_a_deadline_before_a_plan_is_looked_for_says_where_the_time_went():
    words = (
        r"1e-06 s expired before a plan was looked for; ([0-9.e-]+) s had gone by then, of "
        r"which closing the hands on their holds took ([0-9.e-]+) s; give a longer deadline"
    )
    with pytest.raises(DeadlineError, match=words) as caught:
        plan(ask(on_wall(), deadline=1e-6))
    found = re.search(words, str(caught.value))
    gone, closing = map(float, found.groups())
    assert gone >= max(closing, 1e-6)
