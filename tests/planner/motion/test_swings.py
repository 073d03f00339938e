"""Swings of a hand, sampled ten times as finely, and by coal, and those for which there is none."""

from itertools import pairwise

import numpy as np
import pytest

from hand_models.base import InvalidInputError, Pose, turns_about
from planner import deadline
from planner.deadline import DeadlineError
from planner.motion import (
    BranchEndError,
    CollisionScene,
    JointSpace,
    NoWayError,
    check_shift,
    check_way,
    clear_branches,
    met_in_shift,
    pose_between,
    shift_postures,
    swing,
)
from planner.scene.solids import capsule_solids, distance_between
from tests.suite.helpers.stances import wall
from tests.suite.helpers.swings import BODY, PLACES, ROBOT, ball, palm, posture, rock, rough

LIMB = "front_left"


def goals(scene, place=(0.75, 0.35), limb=LIMB):
    return clear_branches(scene, BODY, posture(), limb, palm(*place))


def dense(path, count=10, step=0.02):
    """Postures on straight lines between others, ten times as many as needed to go by steps."""
    found = [path[:1]]
    for first, second in pairwise(path):
        n = count * max(1, int(np.abs(second - first).max() / step))
        found.append(first + np.linspace(0.0, 1.0, n + 1)[1:, None] * (second - first))
    return np.vstack(found)


def free_space(scene, limb=LIMB):
    others = [each for each in ROBOT.limbs if each != limb]
    return JointSpace(scene, [BODY], posture(), (limb,), touching=others)


def check_whole(scene, found, margin=0.02):
    """The swing leaves straight, arrives straight, and is as clear between as it says."""
    limb, start = found.limb, posture()[found.limb]
    assert found.path[0] == pytest.approx(start)
    back = [ROBOT.hand_poses({limb: each})[limb] for each in dense(found.path[: found.retreat + 1])]
    along = [back[0].rotation.T @ (pose.position - back[0].position) for pose in back]
    assert along[-1] == pytest.approx([0.0, 0.0, -0.05], abs=1e-9)
    assert np.abs(np.array(along)[:, :2]).max() < 1e-3
    on = [ROBOT.hand_poses({limb: each})[limb] for each in found.path[found.approach :]]
    assert on[-1].rotation.T @ (on[-1].position - on[0].position) == pytest.approx(
        [0.0, 0.0, 0.05], abs=1e-9
    )
    between = dense(found.path[found.retreat : found.approach + 1])
    away = free_space(scene, limb).clearances(between).min(axis=1)
    assert found.bound >= 0.5 * found.nearest.distance
    assert away.min() >= found.bound
    assert away.min() == pytest.approx(found.nearest.distance, abs=2e-3)
    assert found.nearest.distance >= margin
    assert np.abs(np.diff(found.path[: found.retreat + 1], axis=0)).max() < 0.2
    assert np.abs(np.diff(found.path[found.approach :], axis=0)).max() < 0.2


def by_coal(scene, joints, limb=LIMB):
    """The least distance of a limb's capsules from all others that they are not joined with."""
    placed, radii = scene.placed(joints), scene.radii
    solids = capsule_solids(scene.names, placed, radii)
    own = set(scene.own[limb].tolist())
    return min(
        distance_between(solids[i], solids[j])[0]
        for i, j in scene.pairs.tolist()
        if i in own or j in own
    )


@pytest.mark.parametrize("hold", [None, rough()], ids=["flat", "rough"])
def test_a_straight_way_is_taken_where_it_is_clear(hold):
    scene = CollisionScene(ROBOT, [rock(hold)])
    found = swing(scene, BODY, posture(), LIMB, goals(scene))
    assert found.how == "straight"
    assert found.approach == found.retreat + 1
    check_whole(scene, found)


def test_links_keep_their_distance_by_coal():
    scene = CollisionScene(ROBOT, [rock()])
    found = swing(scene, BODY, posture(), LIMB, goals(scene, (0.5, 0.6)))
    for angles in dense(found.path[found.retreat : found.approach + 1])[::20]:
        assert by_coal(scene, {**posture(), LIMB: angles}) >= found.bound


def blocked():
    """Boulders on both sides of the straight way, which it meets, and the way back."""
    scene = CollisionScene(ROBOT, [rock()])
    straight = swing(scene, BODY, posture(), LIMB, goals(scene, (0.95, 0.25)))
    middle = 0.5 * (straight.path[straight.retreat] + straight.path[straight.approach])
    hand = BODY @ ROBOT.hand_poses({LIMB: middle})[LIMB]
    place = BODY.rotation.T @ hand.position
    return CollisionScene(ROBOT, [rock(), ball(place, 0.12)])


def test_a_way_around_a_boulder_is_searched():
    scene = blocked()
    found = swing(scene, BODY, posture(), LIMB, goals(scene, (0.95, 0.25))[:1])
    assert found.how == "searched"
    check_whole(scene, found)
    again = swing(scene, BODY, posture(), LIMB, goals(scene, (0.95, 0.25))[:1])
    assert np.array_equal(again.path, found.path)
    other = swing(scene, BODY, posture(), LIMB, goals(scene, (0.95, 0.25))[:1], seed=1)
    check_whole(scene, other)


def test_a_swing_is_the_same_wherever_the_world_begins():
    by = Pose(np.array([2.0, -1.0, 5.0]), turns_about([0.4, 2.0, -1.0]))
    rocks = [rock(rough()), ball((0.2, 0.9, 0.1))]
    here = CollisionScene(ROBOT, rocks)
    there = CollisionScene(ROBOT, [each._replace(pose=by @ each.pose) for each in rocks])
    found = swing(here, BODY, posture(), LIMB, goals(here))
    moved = swing(there, by @ BODY, posture(), LIMB, goals(here))
    assert moved.path == pytest.approx(found.path, abs=1e-9)
    assert moved.nearest[:2] == found.nearest[:2]
    assert moved.bound == pytest.approx(found.bound, abs=1e-9)


def test_of_several_ends_a_later_one_may_have_the_straight_way():
    scene = blocked()
    hard, easy = goals(scene, (0.95, 0.25))[0], goals(scene, (0.7, 0.75))[0]
    found = swing(scene, BODY, posture(), LIMB, [hard, easy])
    assert found.how == "straight"
    assert found.path[-1] == pytest.approx(easy, abs=1e-9)


def length(found):
    return np.linalg.norm(
        np.diff(found.path[found.retreat : found.approach + 1], axis=0), axis=1
    ).sum()


def test_the_shortest_of_the_ways_to_several_ends_is_taken():
    """Around a ball to a near end, not straight to a far one, whatever their order."""
    place, clear = (0.7, 0.75), CollisionScene(ROBOT, [rock()])
    ends = clear_branches(clear, BODY, posture(), LIMB, palm(*place), count=6)
    near = min((swing(clear, BODY, posture(), LIMB, [each]) for each in ends), key=length)
    middle = near.path[[near.retreat, near.approach]].mean(axis=0)
    hand = BODY @ ROBOT.hand_poses({LIMB: middle})[LIMB]
    scene = CollisionScene(ROBOT, [rock(), ball(BODY.rotation.T @ hand.position, 0.05)])
    alone = [swing(scene, BODY, posture(), LIMB, [each]) for each in ends]
    shortest = min(alone, key=length)
    assert shortest.how == "searched"
    assert length(shortest) < 1.05 * length(near)
    assert min(length(each) for each in alone if each.how == "straight") > 1.5 * length(near)
    for order in (ends, ends[::-1]):
        found = swing(scene, BODY, posture(), LIMB, order)
        check_whole(scene, found)
        assert np.array_equal(found.path, shortest.path)


def test_a_swing_without_a_way_says_which_link_meets_what():
    """A wall of boulders across the limb's way."""
    wall_of = [ball((0.85, y, z), 0.2) for y in (-0.1, 0.1, 0.3, 0.5, 0.7, 0.9) for z in (0.1, 0.3)]
    scene = CollisionScene(ROBOT, [rock(), *wall_of])
    with pytest.raises(NoWayError, match=r"^front_left has no way to its new hold: ") as caught:
        swing(scene, BODY, posture(), LIMB, [posture()[LIMB] + [0.9, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0]])
    assert caught.value.kind == "unreachable"
    assert caught.value.nearest.distance < caught.value.margin
    assert caught.value.nearest.first in str(caught.value)
    assert caught.value.nearest.second in str(caught.value)


def test_a_hand_that_cannot_leave_its_hold_says_so():
    """A boulder behind its back."""
    place = BODY.rotation.T @ palm(*PLACES[LIMB], 0.2).position
    scene = CollisionScene(ROBOT, [rock(), ball(place, 0.16)])
    with pytest.raises(NoWayError, match=r"beside its old hold, .* boulder"):
        swing(scene, BODY, posture(), LIMB, [posture()[LIMB]])


def test_no_ends_are_refused():
    scene = CollisionScene(ROBOT, [rock()])
    with pytest.raises(InvalidInputError, match="at least one") as caught:
        swing(scene, BODY, posture(), LIMB, [])
    assert caught.value.field == "goals"


def test_a_wider_margin_is_kept_or_refused():
    scene = CollisionScene(ROBOT, [rock()])
    ends = goals(scene)
    wide = swing(scene, BODY, posture(), LIMB, ends, margin=0.03)
    check_whole(scene, wide, 0.03)
    with pytest.raises(NoWayError, match="500 mm"):
        swing(scene, BODY, posture(), LIMB, ends, margin=0.5)


def test_a_deadline_ends_the_search():
    scene = blocked()
    ends = goals(scene, (0.95, 0.25))
    with deadline.within(0.0), pytest.raises(DeadlineError):
        swing(scene, BODY, posture(), LIMB, ends)


# The body shifts ----------------------------------------------------------------------------------


def shifted(by, turn=(0.0, 0.0, 0.0), count=6):
    hands = {limb: BODY @ pose for limb, pose in ROBOT.hand_poses(posture()).items()}
    there = Pose(BODY.position + np.array(by), BODY.rotation @ turns_about(turn))
    bodies = [pose_between(BODY, there, part) for part in np.linspace(0.0, 1.0, count + 1)]
    found = shift_postures(ROBOT, hands, bodies[1:], posture())
    joints = {limb: np.vstack([posture()[limb], angles]) for limb, angles in found.items()}
    return bodies, joints


@pytest.mark.parametrize(
    ("by", "turn"), [((0.0, 0.04, 0.05), (0.0, 0.0, 0.0)), ((0.05, 0.0, 0.0), (0.1, 0.0, 0.1))]
)
def test_a_shift_is_as_clear_as_it_says(by, turn):
    scene = CollisionScene(ROBOT, [rock(rough()), ball((0.2, 0.0, 0.2))])
    bodies, joints = shifted(by, turn)
    seen = check_shift(scene, bodies, joints)
    assert seen.clear
    least = np.inf
    for i, (first, second) in enumerate(pairwise(bodies)):
        for part in np.linspace(0.0, 1.0, 31):
            body = pose_between(first, second, part)
            angles = {
                limb: (1.0 - part) * each[i] + part * each[i + 1] for limb, each in joints.items()
            }
            least = min(least, scene.nearest(body, angles).distance)
    assert seen.bound <= least <= seen.nearest.distance + 1e-9
    assert seen.bound >= 0.5 * least


def test_a_body_that_shifts_into_rock_says_so():
    bodies, joints = shifted((0.15, 0.0, 0.0))
    scene = CollisionScene(ROBOT, [rock(), ball((0.0, 0.0, 0.15), 0.3)])
    seen = check_shift(scene, bodies, joints)
    assert not seen.clear
    assert (seen.nearest.first, seen.nearest.second) == ("body", "boulder")
    assert str(seen.nearest).startswith("body ")


def test_what_is_met_on_a_shift_that_ends_early_is_named():
    hands = {limb: BODY @ pose for limb, pose in ROBOT.hand_poses(posture()).items()}
    wall_alone = CollisionScene(ROBOT, [rock()])
    into_rock = Pose(BODY.position - 0.6 * BODY.rotation[:, 2], BODY.rotation)
    with pytest.raises(BranchEndError):
        shift_postures(ROBOT, hands, [into_rock], posture())
    met = met_in_shift(wall_alone, hands, BODY, into_rock, posture())
    assert (met.first, met.second) == ("body", "wall")
    # how deep the body ends behind the rock's face, but for the spacing of points along it
    body = into_rock.apply(wall_alone.body.reshape(-1, 3)) @ wall()[:, 2]
    deepest = (body.reshape(-1, 2).min(axis=1) - wall_alone.radii[: len(wall_alone.body)]).min()
    assert deepest - 0.02 < met.distance <= deepest
    # away from it a limb is stretched, and nothing is met
    away = Pose(BODY.position + 0.6 * BODY.rotation[:, 2], BODY.rotation)
    with pytest.raises(BranchEndError, match="stretched"):
        shift_postures(ROBOT, hands, [away], posture())
    assert met_in_shift(wall_alone, hands, BODY, away, posture()) is None
    # but for a ball that a link meets before, beside the way of the body
    scene = CollisionScene(ROBOT, [rock(), ball((0.22, 0.36, 0.58))])
    met = met_in_shift(scene, hands, BODY, away, posture())
    assert met.second == "boulder"
    assert met.first != "body"


def test_nothing_slips_between_two_postures():
    """A ball so small that postures at both ends, and in the middle, are clear of it."""
    scene = CollisionScene(ROBOT, [rock()])
    found = swing(scene, BODY, posture(), LIMB, goals(scene, (0.3, 0.75)))
    first, second = found.path[found.retreat], found.path[found.approach]
    hand = BODY @ ROBOT.hand_poses({LIMB: first + 0.25 * (second - first)})[LIMB]
    place = BODY.rotation.T @ hand.apply([0.0, 0.0, -0.05])
    thin = CollisionScene(ROBOT, [rock(), ball(place, 0.002)])
    space, line = free_space(thin), np.array([first, second])
    assert space.clearances(np.vstack([line, line.mean(axis=0)])).min() > 0.0
    seen = check_way(space, line, 1e-3)
    assert not seen.clear
    assert seen.nearest.second == "boulder"


def test_the_end_of_the_retreat_is_named_where_a_branch_ends():
    scene = CollisionScene(ROBOT, [rock()])
    with pytest.raises(BranchEndError, match="front_left cannot follow"):
        swing(scene, BODY, posture(), LIMB, goals(scene), stand_off=1.5)
