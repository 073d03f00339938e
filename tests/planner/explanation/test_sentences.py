"""What a plan says in words: the limit that counts, what is missing, and what is odd."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from hand_models.base import Pose
from hand_models.hand import FINGERS, Grasp
from hand_models.rock import Cylinder, Edge, Plane
from hand_models.tile import Surface
from planner.explanation import overload_sentence, shortfall_sentence, warnings
from planner.prepare import prepare_stance, settle_hand
from planner.programs import WRENCH_UNIT
from planner.question import Limits, Question, Stance
from planner.solving import plan
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.hands import changed_hand
from tests.suite.helpers.robots import with_hand
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall


def bundled(name: str) -> Question:
    question = questions.question(read_request(name))
    return replace(question, want=frozenset({"prices", "load_factor"}))


def test_of_limits_that_tie_the_dearest_is_named():
    for name in ["wall-300", "overhang", "slab"]:
        answer = plan(bundled(name))
        assert answer.limiting == answer.prices[0].name


def test_of_a_tendon_and_a_motor_as_strong_as_it_the_tendon_is_named():
    stance = on_wall()
    motor = stance.robot.hand.drive.torque(60.0)
    robot = with_hand(stance.robot, changed_hand("motor", "maximum_torque", motor))
    question = ask(replace(stance, robot=robot), limits=Limits(tendon_tension=60.0))
    answer = plan(question)
    assert answer.limiting.limit == "tendon_tension"
    assert f"would carry {60.0 * answer.utilisation:.0f} N of 60 N" in answer.reason


def test_what_a_hand_holds_is_told_with_what_it_would_hold_in_that_direction():
    rock = Surface.from_values({"shear_limit": 100.0})
    answer = plan(ask(on_wall(surface=rock), load=structs.replace(CALIBRATION_LOAD, mass=112.0)))
    assert answer.limiting.limit == "hand_load"
    hand = next(h for h in answer.hands if h.limb == answer.limiting.limb)
    force = float(np.linalg.norm(np.minimum(hand.wrench[:3], [np.inf, np.inf, 0.0])))
    most = force / answer.utilisation
    assert f"the hand holds {force:.0f} N of {most:.0f} N" in answer.reason
    assert most <= 50.0 * 9.80665


def test_a_tiles_force_is_told_with_what_it_holds_in_that_direction():
    answer = plan(bundled("wall-700"))
    name = answer.limiting
    hand = next(h for h in answer.hands if h.limb == name.limb)
    finger = next(f for f in hand.fingers if f.name == name.finger)
    tile = next(t for t in finger.tiles if t.phalanx == name.phalanx)
    force = float(np.linalg.norm(tile.force))
    assert answer.status == "overloaded"
    assert f"would carry {force:.0f} N of {force / tile.utilisation:.0f} N" in answer.reason


def test_what_is_missing_begins_with_the_largest_part():
    answer = plan(ask(on_wall(Plane(), outer_rotation=0.0)))
    assert answer.status == "infeasible"
    axes = ("fx", "fy", "fz", "mx", "my", "mz")
    size = np.abs(answer.certificate.shortfall) / np.array([300.0] * 3 + [30.0] * 3)
    assert f"missing {axes[int(size.argmax())]} " in answer.reason
    assert "palm cannot pull" in answer.reason or "cannot be dragged" in answer.reason


def test_what_is_in_the_way_is_told_of_the_irreducible_set_the_foremost_first():
    answer = plan(ask(on_wall(palm=False)))
    first, second, *others = answer.certificate.irreducible
    assert first.limb == second.limb
    told = [f"{name.phalanx} tile of {name.finger} cannot be dragged" for name in (first, second)]
    assert f"; {first.limb}: {told[0]} away from the finger's base, {told[1]}" in answer.reason
    assert answer.reason.endswith(f", and {len(others)} more")


def test_an_overloaded_stance_says_what_would_be_missing_within_its_limits():
    answer = plan(bundled("wall-700"))
    limit, missing = answer.reason.split("; within the limits ")
    assert "would carry" in limit
    worst = int(np.argmax(np.abs(answer.certificate.shortfall / WRENCH_UNIT)))
    assert missing.startswith(("fx", "fy", "fz", "mx", "my", "mz")[worst])
    assert missing.endswith(" (in B) would be missing")


@pytest.mark.parametrize("grasp", [{"palm": False}, {"closing_tension": 400.0}])
def test_that_floating_hands_give_way_is_said_where_one_of_them_is_to_blame(grasp):
    proof = plan(ask(on_wall(Cylinder(0.7), **grasp))).certificate
    limbs = {name.limb for name in proof.irreducible}
    others = {hand.limb for hand in on_wall().hands} - limbs

    def said(floating) -> str:
        if proof.utilisation is None:
            return shortfall_sentence(proof, True, floating=floating)
        return overload_sentence(proof, floating=floating)

    assert others
    assert said(others) == said(())
    for limb in limbs:
        assert said({limb}).startswith(said(()))
        assert "the wrists" in said({limb})


def test_a_stance_in_the_air_says_so():
    away = Pose(np.array([0.0, 0.0, 0.5]), np.eye(3))
    stance = on_wall()
    stance = replace(stance, hands=tuple(replace(h, hold_in_hand=away) for h in stance.hands))
    answer = plan(ask(stance))
    assert answer.status == "infeasible"
    assert "no spine of any hand is on rock" in answer.reason
    assert len(answer.warnings) == len(stance.hands)
    assert all("touches nothing" in warning for warning in answer.warnings)


def test_a_hand_on_bare_phalanges_is_not_said_to_touch_nothing():
    stance = on_wall()
    hand = replace(stance.hands[1], hold=Edge(fillet_radius=0.02, angle=1.5), grasp=Grasp())
    hands = (stance.hands[0], hand, *stance.hands[2:])
    prepared = prepare_stance(ask(replace(stance, hands=hands)))
    contacts = {tile.contact for tile in prepared.batch.hands[1].tiles}
    assert contacts == {"frame", "none"}
    (said,) = warnings(prepared.question.stance, prepared.batch)
    assert said == (
        f"{hand.limb}: no spine of {', '.join(FINGERS)} is on rock, bare phalanges press on it"
    )


def _out_of_reach(stance: Stance) -> list[str]:
    """What a plan's warnings say of hands out of reach."""
    return [text for text in plan(ask(stance)).warnings if "out of reach" in text]


def test_a_hand_out_of_reach_is_warned_of_and_one_within_is_not():
    stance = on_wall()
    assert not _out_of_reach(stance)
    hand = stance.hands[0]
    up = stance.body.rotation[:, 0]
    far = replace(hand, pose=Pose(hand.pose.position + 2.0 * up, hand.pose.rotation))
    (warning,) = _out_of_reach(replace(stance, hands=(far, *stance.hands[1:])))
    told = re.match(f"{hand.limb}: out of reach, ([0-9.]+) times as far as", warning)
    assert told is not None
    assert float(told[1]) >= 2.0
    assert warning.endswith("; positions in metres, quaternions as [x, y, z, w]?")
    near = replace(hand, pose=Pose(hand.pose.position + 0.8 * up, hand.pose.rotation))
    (warning,) = _out_of_reach(replace(stance, hands=(near, *stance.hands[1:])))
    assert re.match(f"{hand.limb}: out of reach, [0-9.]+ % farther than its limb goes;", warning)


def test_no_tile_of_a_bundled_hand_is_inside_its_rock():
    for name in ("wall", "wall-300", "wall-700", "overhang", "slab"):
        stance = bundled(name).stance
        for place in stance.hands:
            hand = settle_hand(place, stance)
            into_rock = hand.seating.pose.inverse()
            for point in hand.positions:
                depth = hand.hold.entry(into_rock.apply(point), into_rock.rotation[:, 2])
                assert depth > -1e-4


def test_tiles_stronger_than_their_spines_are_warned_of():
    answer = plan(ask(on_wall(surface=Surface.from_values({"shear_limit": 1e5}))))
    told = [words for words in answer.warnings if "break at 2800 N" in words]
    assert len(told) == 4
    assert all(": a tile is taken to hold 100000 N in shear; " in words for words in told)
