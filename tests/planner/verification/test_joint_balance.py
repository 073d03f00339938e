"""Whether forces balance joints and tendons, against Eq. 6 solved in full and by hand."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.fixed_wrist import slipped_hand
from hand_models.rock import Cylinder
from planner.prepare import HandBatch, prepare_stance, settle_hand
from planner.result import PlanArrays
from planner.solving import answer_on
from planner.verification import Check
from planner.verification.joint_balance import JointBalance
from planner.verification.residuals import PartNames
from tests.suite.helpers.hands import HAND
from tests.suite.helpers.moved_hands import random_placement
from tests.suite.helpers.stances import ask, on_wall, random_stance

STANCES = {
    "pinches": on_wall,
    "large cylinders": lambda: on_wall(Cylinder(0.7), closing_tension=50.0),
    **{
        f"random {seed}": lambda seed=seed: random_stance(np.random.default_rng(seed))
        for seed in range(12)
    },
}


def of_stance(stance) -> HandBatch:
    return HandBatch.of([settle_hand(hand, stance) for hand in stance.hands])


def balance_of(known: HandBatch) -> JointBalance:
    return JointBalance(PartNames(tuple(map(str, range(len(known.hands)))), known))


def wrenches(known: HandBatch, loads: np.ndarray) -> np.ndarray:
    """What tiles with these loads (T, 3) do about the origin of H."""
    forces = np.einsum("tk,tkx->tx", loads, known.axes)
    return np.hstack([forces, np.cross(known.points[: len(loads)], forces)])


@pytest.mark.parametrize("stance", STANCES.values(), ids=STANCES.keys())
def test_loads_by_equation_14_balance_at_any_tension(stance):
    """Eqs. 5 to 8, as they stand and solved, against the affine maps of settled hands."""
    known = of_stance(stance())
    balance, places = balance_of(known), known.places
    rng = np.random.default_rng(1)
    f = rng.uniform(5.0, 300.0, len(known.angles))
    laws = np.concatenate([hand.loads for hand in known.hands])
    shear, normal = (laws[..., 0] + laws[..., 1] * f[places.finger, None]).T
    lateral = rng.normal(size=len(shear))
    loads, left = balance.loads(f, lateral)
    expected = np.column_stack([shear, normal, lateral])
    np.testing.assert_allclose(loads, expected, rtol=1e-9, atol=1e-9)
    own_normal, own_left = balance.solved(balance.fingers(f))
    np.testing.assert_allclose(loads[:, 1], own_normal, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(own_left, left, atol=1e-10)
    # a joint is locked in part where its phalanx has few spines across a gap
    free = known.bearing_shares == 1.0
    if balance.held is not None:
        free &= ~balance.held
    np.testing.assert_allclose(left[free], 0.0, atol=1e-10)
    stops = [(4 * k + i, j, t) for k, hand in enumerate(known.hands) for i, j, t in hand.stops]
    assert list(zip(balance.stop_fingers, balance.stop_joints, strict=True)) == [
        (finger, joint) for finger, joint, _ in stops
    ]
    pressing = [torque[0] + torque[1] * f[finger] for finger, _, torque in stops]
    np.testing.assert_allclose(balance.stops(left), pressing, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", [63, 75, 106])
def test_loads_of_few_spines_across_a_gap_balance(seed):
    """They and a joint that is taken as locked share a balance; so they do when tiles slip."""
    placement, way = random_placement(seed)
    few = 0
    for far in range(0, 60, 10):
        pose = placement.hold_in_hand
        there = Pose(pose.position + 1e-6 * far * way, pose.rotation)
        (hand,) = HAND.settle_each([placement._replace(hold_in_hand=there)])
        few += (hand.postures.bearing_shares < 1.0).any()
        for closed in (hand, slipped_hand(hand, np.flatnonzero(hand.touching)[:1].tolist())):
            balance = balance_of(HandBatch.of([closed]))
            f = np.array([20.0, 60.0, 120.0, 300.0])
            found, _ = balance.loads(f, np.zeros(len(closed.tiles)))
            own = closed.tile_loads(f)
            np.testing.assert_allclose(found[:, :2], own[:, :2], atol=1e-8)
    assert few > 0


def test_normals_are_those_whose_moments_about_the_joints_are_left():
    """Moments by hand: of each phalanx's force about the joints before it, by their arms."""
    known = of_stance(on_wall())
    balance, places = balance_of(known), known.places
    rng = np.random.default_rng(2)
    shear, normal = rng.normal(scale=30.0, size=(2, len(places.hand)))
    normal[places.bases] = normal[places.nails] = 0.0
    torques = np.zeros((len(known.angles), 3))
    for finger in range(len(torques)):
        hand = known.hands[finger // 4]
        frame = hand.hand.frames(hand.grasp.outer_rotation)[finger % 4]
        joints = hand.postures.joints[finger % 4]
        for phalanx, tile in enumerate(places.phalanges[finger]):
            place = known.points[tile] - frame.joint
            force = [shear[tile], normal[tile], 5.0] @ known.axes[tile]
            for joint in range(phalanx + 1):
                x = float(place @ frame.along) - joints[joint].real
                z = float(place[2]) - joints[joint].imag
                torques[finger, joint] += x * force[2] - z * float(force @ frame.along)
    fingers = balance.fingers(np.full(len(torques), 100.0))
    found, left = balance.solved(fingers._replace(shear=shear, torques=torques))
    np.testing.assert_allclose(found, normal, atol=1e-9)
    np.testing.assert_allclose(left, 0.0, atol=1e-10)


def test_a_plan_is_refused_for_hands_whose_balance_cannot_be_solved():
    """Joints that no contact holds, which no settled hand has."""
    question = ask(on_wall())
    prepared = prepare_stance(question)
    answer = answer_on(prepared, time.perf_counter()).plan()
    hand = prepared.batch.hands[0]
    tiles = (hand.tiles[0], hand.tiles[1]._replace(contact="none"), *hand.tiles[2:])
    loose = replace(hand, tiles=tiles)
    check = Check(question, HandBatch.of([loose, *prepared.batch.hands[1:]]), None)
    arrays = PlanArrays.of(answer.hands)
    found = check.problems(arrays, answer.utilisation, prepared.wrench)
    assert any("not what the plan says" in each for each in found), found


@pytest.mark.parametrize("what", ["moved", "turned", "base tile", "palm"])
def test_contacts_that_a_plan_has_elsewhere_are_told_though_all_its_numbers_agree(what):
    """A distal tile 10 mm off, or turned, or another contact off, and the wrenches that fit it."""
    question = ask(on_wall())
    prepared = prepare_stance(question)
    answer = answer_on(prepared, time.perf_counter()).plan()
    check, honest = Check(question, prepared.batch, None), PlanArrays.of(answer.hands)
    assert check.problems(honest, answer.utilisation, prepared.wrench) == []
    places, count = prepared.batch.places, len(honest.loads)
    contact = {"base tile": places.bases[0], "palm": count}.get(what, places.phalanges[1, 2])
    points, axes, forces = honest.points.copy(), honest.axes.copy(), honest.forces.copy()
    if what == "turned":
        axes[contact] = axes[contact] @ Rotation.from_rotvec([0.0, 0.3, 0.0]).as_matrix()
        forces[contact] = honest.loads[contact] @ axes[contact]
    else:
        points[contact, 0] -= 0.01
    each = np.hstack([forces, np.cross(points, forces)])
    sums = np.add.reduceat(each[:count], places.first) + each[count:]
    lie = honest._replace(points=points, axes=axes, forces=forces, wrenches=sums)
    used = max(answer.utilisation, float(lie.utilisations.max()))
    wrong = check.problems(lie, used, check.carry @ sums.ravel())
    name = {"base tile": "base tile of outer_left", "palm": "palm"}.get(
        what, "distal tile of inner_left"
    )
    assert [each for each in wrong if "utilisation" not in each] == [
        f"front_right: {name} is elsewhere, or turned"
    ], wrong
