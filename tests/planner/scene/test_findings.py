"""What is odd about stances: slips are told, sound stances are left alone."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from hand_models.rock import Cylinder, Plane
from planner.question import Question
from planner.robots import Robot, robosimian
from planner.scene.scene import smooth_depths
from planner.solving import KnownStance, plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.rocks import distance, random_ellipsoid, random_hold
from tests.suite.helpers.scenes import (
    BASES,
    HOLDS,
    REFUSED,
    SLIPS,
    TURN_X,
    exchanged,
    kinds,
    lifted,
    look,
    mirrored,
    nearer,
    sound_stances,
    turned_hand,
    twin,
)
from tests.suite.helpers.stances import moved, on_wall

EXAMPLES = (
    *("wall-300", "wall-700", "wall", "overhang", "slab", "boulders", "ledge"),
    *("wall-300-floating", "wall-300-joints"),
)


@pytest.fixture(scope="module")
def bases():
    return {name: make() for name, make in BASES.items()}


def test_slips_are_told_or_refused(bases):
    for slip in SLIPS:
        for base in BASES:
            assert look(bases[base]) == ()
            make, telling = SLIPS[slip]
            try:
                found = kinds(make(bases[base]))
            except InvalidInputError as error:
                found = {REFUSED if error.field else ""}
            assert found & telling


@pytest.mark.slow
def test_nothing_is_odd_about_three_hundred_sound_stances():
    stances = list(sound_stances(300))
    assert {len(stance.hands) for stance in stances} == {2, 3, 4}
    assert {hand.hold.shape for s in stances for hand in s.hands} == {hold.shape for hold in HOLDS}
    odd = [(i, found) for i, stance in enumerate(stances) if (found := look(stance))]
    assert odd == []


@pytest.mark.slow
def test_nor_about_some_of_them_and_the_bundled_ones():
    assert not any(look(stance) for stance in sound_stances(6, seed=1))
    assert not any(look(question(read_request(name)).stance) for name in EXAMPLES)


def told(stance) -> list:
    """Kinds, measures and the limbs that the fields are about, whatever the order of hands."""
    limbs = [hand.limb for hand in stance.hands]
    found = []
    for finding in look(stance):
        index = finding.field.removeprefix("stance.hands[").split("]")[0]
        limb = limbs[int(index)] if index.isdigit() else ""
        found.append((finding.kind, limb, round(finding.value, 9)))
    return sorted(found)


def test_findings_are_the_same_wherever_the_world_begins(bases):
    for slip in [name for name, (_, signs) in SLIPS.items() if REFUSED not in signs]:
        stance = SLIPS[slip][0](bases["slab"])
        turn = Rotation.from_rotvec([0.0, 0.0, 1.3]).as_matrix()
        assert told(moved(stance, Pose(np.array([3.0, -2.0, 40.0]), turn))) == told(stance)
        # only gravity is judged by where up is
        around = Rotation.from_rotvec([0.9, 2.0, -0.4]).as_matrix()
        inner = [each for each in told(stance) if each[0] != "gravity_up"]
        there = told(moved(stance, Pose(np.array([0.1, 0.2, -3.0]), around)))
        if slip != "gravity's sign":
            assert [each for each in there if each[0] != "gravity_up"] == inner


@pytest.mark.parametrize(
    "slip", [name for name, (_, kinds) in SLIPS.items() if REFUSED not in kinds]
)
def test_findings_are_the_same_in_another_order_and_in_the_mirror(slip, bases):
    stance = SLIPS[slip][0](bases["overhang"])
    shuffled = replace(stance, hands=tuple(stance.hands[i] for i in (2, 0, 3, 1)))
    pairs = {"hands_overlap", "limbs_crossed"}
    without = [each for each in told(stance) if each[0] not in pairs]
    assert [each for each in told(shuffled) if each[0] not in pairs] == without
    # of two hands either may be named, and the order of limbs decides
    assert [(kind, value) for kind, _, value in told(shuffled)] == [
        (kind, value) for kind, _, value in told(stance)
    ]
    ours, theirs = told(stance), told(mirrored(stance))
    assert [kind for kind, _, _ in theirs] == [kind for kind, _, _ in ours]
    # the robot's limbs are each other's mirror images to some micrometres
    values = [[sorted(value for _, _, value in some)] for some in (theirs, ours)]
    assert values[0] == [pytest.approx(values[1][0], abs=1e-5)]
    named = [
        {(kind, limb) for kind, limb, _ in some if kind not in pairs} for some in (ours, theirs)
    ]
    assert {(kind, twin(limb)) for kind, limb in named[0]} == named[1]


def test_messages_name_field_measure_and_slip(bases):
    (found,) = look(turned_hand(bases["logs"], 1, TURN_X))
    assert (found.kind, found.field, found.unit) == (
        "palm_away",
        "stance.hands[1].pose.orientation",
        "m",
    )
    assert "rear_right" in found.message
    assert "[x, y, z, w]" in found.message
    # the body is as far from the palm's plane as it stands off the wall
    assert found.value == pytest.approx(0.3)


def test_a_body_in_the_wall_is_as_deep_as_its_lowest_capsule():
    stance = on_wall(Plane(), off=0.3, outer_rotation=0.0)
    deep = 0.2
    (found,) = look(nearer(stance, deep))
    ends, radii = robosimian().body_capsules
    lowest = (ends[:, :, 2].min(axis=1) - radii).min()
    # the palm stands off the plane on which the tiles lie flat
    off = 0.3 + 0.0041
    assert found.kind == "body_in_rock"
    assert found.value == pytest.approx(deep - lowest - off, abs=2e-4)


def test_exchanged_limbs_are_as_much_nearer_as_shoulders_say(bases):
    stance = bases["logs"]
    chains, body = stance.robot.chains, stance.body.inverse()
    places = {hand.limb: body.apply(hand.pose.position) for hand in stance.hands}

    def away(limb, other):
        return math.dist(chains[limb].shoulder, places[other])

    pair = ("front_left", "front_right")
    wrong = away(*pair) + away(*reversed(pair))
    right = away(pair[0], pair[0]) + away(pair[1], pair[1])
    (found,) = look(exchanged(stance, *pair))
    assert found.value == pytest.approx(wrong - right)


def test_depth_in_smooth_rock_is_its_distance():
    rng = np.random.default_rng(5)
    seen = set()
    boulders = [random_ellipsoid(rng) for _ in range(10)]
    for hold in [*boulders, *(random_hold(rng) for _ in range(60))]:
        if hold.swept is None:
            continue
        seen.add(hold.shape)
        points = rng.uniform(-0.5, 0.5, (40, 3))
        got, expected = -smooth_depths([hold.swept], points[None])[0], distance(hold, points)
        if hold.shape == "ellipsoid":
            assert (np.abs(got) <= np.abs(expected) + 1e-9).all()
            assert (np.sign(got) == np.sign(expected)).all()
        else:
            assert got == pytest.approx(expected, abs=1e-9)
    assert seen == {"plane", "cylinder", "sphere", "edge", "ellipsoid"}


def test_plans_tell_what_is_odd_in_words_and_structured(bases):
    stance = turned_hand(bases["logs"], 0, TURN_X)
    answer = plan(Question(stance))
    assert [found.kind for found in answer.findings] == ["palm_away", "palm_without_travel"]
    assert answer.warnings[0] == answer.findings[0].message
    known = KnownStance(Question(stance)).plan(answer.body_wrench)
    assert known.findings == answer.findings
    assert {found.kind for found in plan(Question(bases["logs"])).findings} <= {
        "palm_without_travel"
    }


def test_what_cannot_be_is_refused_with_its_field(bases):
    for name, field in (
        ("hands in one place", r"^stance\.hands\[1\]\.pose\.position: .* at the same position"),
        ("the body in a boulder", r"^stance\.body\.position: the body's origin is [0-9.]+ m deep"),
    ):
        with pytest.raises(InvalidInputError, match=field):
            plan(Question(SLIPS[name][0](bases["logs"])))


def test_two_forward_hands_side_by_side_are_two_holds():
    stance = on_wall(Cylinder(0.3), limbs=("front_left", "front_right"))
    first = stance.hands[0].pose
    apart = Pose(first.position + 0.15 * first.rotation[:, 1], first.rotation)
    there = replace(stance, hands=(stance.hands[0], replace(stance.hands[1], pose=apart)))
    assert "hands_overlap" not in kinds(there)
    assert kinds(lifted(stance)) == {"out_of_reach"}


def test_without_a_known_back_most_hands_tell_where_the_belly_is(bases):
    description = robosimian().description
    anywhere = Robot(replace(description, back=None), robosimian().urdf, robosimian().hand)

    def asked(stance):
        return replace(stance, robot=anywhere)

    assert kinds(asked(turned_hand(bases["logs"], 3, TURN_X))) == {"palm_away"}
    assert kinds(asked(SLIPS["the body beyond the wall"][0](bases["logs"]))) == {"body_in_rock"}
    # which way round such a body is meant to be nobody knows
    assert "body_reversed" not in kinds(asked(SLIPS["the body rolled over"][0](bases["logs"])))
    assert not any(look(asked(stance)) for stance in sound_stances(2, seed=2))
