"""Whether forces balance joints and tendons, against Eq. 6 solved in full and by hand."""

import time

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import wrench_transport
from hand_models.rock import Cylinder
from planner.prepare import NOTHING, HandBatch, prepare_stance, settle_hand
from planner.result import PlanArrays
from planner.solving import plan
from planner.solving.solve import plan_on
from planner.verification import Check
from planner.verification.joint_balance import LEVER, JointBalance
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


def wrenches(known: HandBatch, loads: np.ndarray) -> np.ndarray:
    """What tiles with these loads (T, 3) do about the origin of H."""
    forces = np.einsum("tk,tkx->tx", loads, known.axes)
    return np.hstack([forces, np.cross(known.points[: len(loads)], forces)])


@pytest.mark.parametrize("stance", STANCES.values(), ids=STANCES.keys())
def test_loads_by_equation_14_balance_at_any_tension(stance):
    """Eqs. 5 to 8, as they stand and solved, against the affine maps of settled hands."""
    known = of_stance(stance())
    balance, places = JointBalance(known), known.places
    rng = np.random.default_rng(1)
    f = rng.uniform(5.0, 300.0, len(known.angles))
    laws = np.concatenate([hand.loads for hand in known.hands])
    shear, normal = (laws[..., 0] + laws[..., 1] * f[places.finger, None]).T
    np.testing.assert_allclose(balance.shears(f), shear, rtol=1e-9, atol=1e-9)
    # what acts across a finger turns none of its joints
    aside = rng.normal(scale=20.0, size=len(shear))
    left = balance.left(f, wrenches(known, np.column_stack([shear, normal, aside])))
    free = left if balance.held is None else left[~balance.held]
    np.testing.assert_allclose(free, 0.0, atol=1e-10)
    own_normal, own_left = balance.solved(balance.fingers(f))
    np.testing.assert_allclose(own_normal, normal, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(own_left, left, atol=1e-10)
    stops = [(4 * k + i, j, t) for k, hand in enumerate(known.hands) for i, j, t in hand.stops]
    assert list(zip(balance.stop_fingers, balance.stop_joints, strict=True)) == [
        (finger, joint) for finger, joint, _ in stops
    ]
    pressing = [torque[0] + torque[1] * f[finger] for finger, _, torque in stops]
    np.testing.assert_allclose(balance.stops(left), pressing, rtol=1e-9, atol=1e-9)


def test_a_force_on_a_phalanx_turns_the_joints_before_it_by_its_arms():
    known = of_stance(on_wall())
    balance, places = JointBalance(known), known.places
    f = np.full(len(known.angles), 100.0)
    count = len(places.hand)
    at_rest = balance.left(f, np.zeros((count, 6)))
    for finger in (0, 5, 10, 15):
        hand = known.hands[finger // 4]
        frame = hand.hand.frames(hand.grasp.outer_rotation)[finger % 4]
        joints = hand.postures.joints[finger % 4]
        for phalanx, tile in enumerate(places.phalanges[finger]):
            loads = np.zeros((count, 3))
            loads[tile, :2] = 3.0, 7.0
            turned = at_rest - balance.left(f, wrenches(known, loads))
            place = known.points[tile] - frame.joint
            force = loads[tile] @ known.axes[tile]
            for joint in range(3):
                x = float(place @ frame.along) - joints[joint].real
                z = float(place[2]) - joints[joint].imag
                expected = x * force[2] - z * float(force @ frame.along)
                assert turned[finger, joint] == pytest.approx(
                    expected if joint <= phalanx else 0.0, abs=1e-12
                )
            others = np.delete(turned, finger, axis=0)
            np.testing.assert_array_equal(others, 0.0)


@pytest.mark.parametrize("stance", STANCES.values(), ids=STANCES.keys())
def test_a_balance_off_by_little_tells_loads_that_are_off_by_little(stance):
    """No normals of norm 1 N leave less than `LEVER` times that of the balance."""
    known = of_stance(stance())
    balance, places = JointBalance(known), known.places
    f, count = np.zeros(len(known.angles)), len(places.hand)
    nothing = balance.left(f, np.zeros((count, 6)))
    turns = np.zeros((len(f), 3, 3))
    for phalanx in range(3):
        loads = np.zeros((count, 3))
        loads[places.phalanges[:, phalanx], 1] = 1.0
        turns[:, :, phalanx] = nothing - balance.left(f, wrenches(known, loads))
    bears = known.touch.contacts[places.phalanges] != NOTHING
    free = np.ones_like(bears) if balance.held is None else ~balance.held
    for finger in np.flatnonzero(free.any(axis=1)):
        own = turns[finger][np.ix_(free[finger], bears[finger])]
        assert np.linalg.svd(own, compute_uv=False).min() > LEVER


@pytest.mark.parametrize("what", ["moved", "turned"])
def test_tiles_that_a_plan_has_elsewhere_are_told_though_all_its_numbers_agree(what):
    """A distal tile 10 mm off, or turned, and normals, forces, wrench and shares that fit it."""
    question = ask(on_wall())
    prepared = prepare_stance(question)
    answer, _ = plan_on(prepared, time.perf_counter())
    check = Check(question, prepared.batch, None)
    honest = PlanArrays.of(answer.hands)
    tiles = [
        t
        for t, tile in enumerate(answer.hands[0].tiles)
        if tile.finger == "inner_left" and tile.phalanx != "base"
    ]
    points, axes = honest.points.copy(), honest.axes.copy()
    if what == "moved":
        points[tiles[-1], 0] -= 0.01
    else:
        axes[tiles[-1]] = axes[tiles[-1]] @ Rotation.from_rotvec([0.0, 0.3, 0.0]).as_matrix()

    def told(normals):
        loads, forces = honest.loads.copy(), honest.forces.copy()
        loads[tiles, 1] = normals
        forces[tiles] = np.einsum("tk,tkx->tx", loads[tiles], axes[tiles])
        return honest._replace(points=points, axes=axes, loads=loads, forces=forces)

    def left(normals):
        return check.again.of([], told(normals), None).left[1]

    start = honest.loads[tiles, 1]
    slopes = np.column_stack([left(start + e) - left(start) for e in np.eye(3)])
    lie = told(start - np.linalg.solve(slopes, left(start)))
    for _ in range(2):
        again = check.again.of([], lie, None)
        lie = lie._replace(
            wrenches=again.wrenches,
            tile_utilisations=again.tiles,
            utilisations=again.hands,
        )
    assert np.abs(check.again.of([], lie, None).left).max() < 1e-9
    reactions = -sum(
        wrench_transport(question.stance.body.inverse() @ place.pose) @ wrench
        for place, wrench in zip(question.stance.hands, lie.wrenches, strict=True)
    )
    wrong = check.problems(lie, float(lie.utilisations.max()), reactions)
    assert any("distal tile of inner_left" in words for words in wrong)
    assert check.problems(honest, answer.utilisation, prepared.wrench) == []


@pytest.mark.parametrize("lever", ["a tile", "a palm"])
def test_forces_that_act_elsewhere_are_told_though_wrenches_fit_them(lever):
    """A base tile, which no joint's balance hangs on, or a palm 10 mm off, and the wrench of it."""
    question = ask(on_wall())
    prepared = prepare_stance(question)
    check, honest = Check(question, prepared.batch, None), PlanArrays.of(plan(question).hands)
    place = int(prepared.batch.places.bases[0]) if lever == "a tile" else len(honest.loads)
    points = honest.points.copy()
    points[place, 1] += 0.01
    lie = honest._replace(points=points)
    lie = lie._replace(wrenches=check.again.of([], lie, None).wrenches)
    wrong = check.problems(lie, float(lie.utilisations.max()), check.carry @ lie.wrenches.ravel())
    assert wrong == [
        f"front_right: {'base tile of outer_left' if lever == 'a tile' else 'palm'} is elsewhere, "
        "or turned"
    ]
