"""What is read of loads for all hands at once is what each tile's definition says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, Grasp
from hand_models.rock import Edge
from hand_models.tile import inner_half_planes
from planner.prepare import HandBatch, assemble, settle_hand
from planner.result import LoadRecovery, PlanArrays
from tests.suite.helpers.hands import limiting
from tests.suite.helpers.stances import ask, on_wall, random_stance


def hooked():
    """A hand that clings with its nails, beside others that do not."""
    stance = on_wall()
    crimp = replace(
        stance.hands[1], hold=Edge(0.03, 0.5 * math.pi), grasp=Grasp(fingernail=True, palm=False)
    )
    return replace(stance, hands=(stance.hands[0], crimp, *stance.hands[2:]))


def random_loads(rng, space):
    """Loads of any sign where they may have one."""
    return np.array(
        [
            rng.uniform(-20.0, 20.0)
            if name.endswith(("/lateral", "/nail"))
            else max(rng.uniform(-20.0, 150.0), 0.0)
            for name in space.columns
        ]
    )


@pytest.fixture(scope="module", params=["hooked", *range(12)])
def stance(request):
    if request.param == "hooked":
        return hooked()
    return random_stance(np.random.default_rng(request.param))


def read(stance, seed=0):
    """Settled hands, their sets, random loads, and what is read of these."""
    rng = np.random.default_rng(seed)
    batch, hands = assemble(ask(stance), None, np.zeros(6))
    spaces, data = hands.sets(hands.at_rest())
    loads = [random_loads(rng, space) for space in spaces]
    reader = LoadRecovery(batch, spaces)
    return batch.hands, spaces, data, loads, reader


def named(space, y):
    return dict(zip(space.columns, y.tolist(), strict=True))


def test_every_number_is_that_of_its_definition(stance):
    settled, spaces, data, loads, reader = read(stance)
    arrays, told_used, effort = reader.read(loads)
    hands = arrays.hands([hand.limb for hand in stance.hands], HandBatch.of(settled), spaces)
    used = [space.utilisations(y) for space, y in zip(spaces, loads, strict=True)]
    np.testing.assert_allclose(told_used, np.concatenate(used), rtol=1e-12, atol=1e-12)
    efforts = [
        hand.E @ (y / hand.unit) + hand.e0 for hand, y in zip(data.hands, loads, strict=True)
    ]
    assert effort == pytest.approx(sum(float(e @ e) for e in efforts), rel=1e-12)
    for place, hand, space, y, plan in zip(
        stance.hands, settled, spaces, loads, hands, strict=True
    ):
        load = named(space, y)
        assert (plan.limb, plan.tiles, plan.seating) == (place.limb, hand.tiles, hand.seating)
        assert plan.utilisation == pytest.approx(max(0.0, space.utilisations(y).max()), rel=1e-12)
        palm = np.array([-load.get("palm_shear", 0.0), 0.0, load.get("palm_pressing", 0.0)])
        np.testing.assert_array_equal(plan.palm.force, palm)
        np.testing.assert_array_equal(plan.palm.position, hand.palm.centre)
        limits = (hand.palm.shear_limit, hand.palm.pressing_limit)
        share = max(-palm[0] / limits[0], palm[2] / limits[1]) if hand.palm.engaged else 0.0
        assert plan.palm.utilisation == pytest.approx(share, rel=1e-12)
        wrench = np.concatenate([palm, np.cross(hand.palm.centre, palm)])
        tiles = iter(range(len(hand.tiles)))
        for i, (name, finger) in enumerate(zip(FINGERS, plan.fingers, strict=True)):
            tension = load[f"{name}/tension"]
            assert (finger.name, finger.tendon_tension) == (name, tension)
            torque = tension * 0.0067 / 236.0 / 0.7
            assert finger.motor_torque == pytest.approx(torque, rel=1e-12)
            assert finger.motor_current == pytest.approx(torque / 0.0234 + 0.0263, rel=1e-12)
            spines = float(hand.engagement[hand.finger_of == i].sum())
            drawn = hand.hand.nail.pulley_radius * hand.nail_angles[i]
            drawn += np.array([5.5e-3, 3.195e-3, 1.945e-3]) @ hand.fingers[i].joint_angles
            for tile in finger.tiles:
                t = next(tiles)
                shear, normal = hand.loads[t] @ [1.0, tension]
                lateral, planes = 0.0, inner_half_planes(place.surface)
                if hand.touching[t]:
                    engagement = float(hand.engagement[t])
                    lateral = load.get(f"{name}/lateral", 0.0) * engagement / spines
                    part = limiting(engagement)
                    planes = tuple(p._replace(capacity=part * p.capacity) for p in planes)
                if hand.nails[t]:
                    shear, planes = load[f"{name}/nail"], hand.nail_limits(t)
                if tile.phalanx != "nail":
                    drawn += 2.0 * (2.0 * tension - shear) / 11500.0
                told = (tile.shear, tile.normal, tile.lateral)
                np.testing.assert_allclose(told, (shear, normal, lateral), rtol=1e-12, atol=1e-12)
                axes = (tile.shear_axis, tile.normal_axis, tile.lateral_axis)
                np.testing.assert_array_equal(axes, hand.axes[t])
                force = np.array([shear, normal, lateral]) @ hand.axes[t]
                np.testing.assert_allclose(tile.force, force, rtol=1e-12, atol=1e-11)
                wrench += [*force, *np.cross(tile.position, force)]
                shares = [
                    (p.a_shear * shear + p.a_normal * normal + p.a_lateral * abs(lateral))
                    / p.capacity
                    for p in planes
                ]
                share = max(0.0, *shares) if hand.holding[t] else 0.0
                assert tile.utilisation == pytest.approx(share, rel=1e-9, abs=1e-12)
                for own, piece in zip(plan.limits_of(t), planes, strict=True):
                    assert own[:4] == piece[:4]
                    assert own.capacity == pytest.approx(piece.capacity, rel=1e-12)
                assert (tile.phalanx, tile.contact) == hand.tiles[t][1:]
                np.testing.assert_array_equal(tile.position, hand.positions[t])
                np.testing.assert_array_equal(tile.load_per_newton, hand.loads[t, :, 1])
                np.testing.assert_array_equal(tile.load_at_zero, hand.loads[t, :, 0])
            assert finger.winch_angle == pytest.approx(drawn / 0.0067, rel=1e-9)
        assert next(tiles, None) is None
        np.testing.assert_allclose(plan.wrench, wrench, rtol=0.0, atol=1e-9)


def test_hands_are_read_alone_as_together(stance):
    settled, spaces, _, loads, reader = read(stance, seed=1)
    limbs = [hand.limb for hand in stance.hands]
    carried = reader.read(loads)[0]
    alone = []
    for limb, hand, space, y in zip(limbs, settled, spaces, loads, strict=True):
        batch = HandBatch.of([hand])
        arrays = LoadRecovery(batch, [space]).read([y])[0]
        alone += arrays.hands([limb], batch, [space])
    parted = carried.hands(limbs, HandBatch.of(settled), spaces)
    for got in (PlanArrays.of(alone), PlanArrays.of(parted)):
        for name, mine, expected in zip(carried._fields, got, carried, strict=True):
            if isinstance(expected, np.ndarray):
                np.testing.assert_allclose(mine, expected, rtol=1e-12, atol=1e-12, err_msg=name)
            else:
                assert mine == expected, name


def test_loads_that_are_negative_by_rounding_count_as_zero():
    _, spaces, _, loads, reader = read(on_wall())
    names = spaces[0].columns
    off = [y.copy() for y in loads]
    for name in ("outer_left/tension", "palm_shear", "palm_pressing", "inner_left/lateral"):
        off[0][names.index(name)] = -1e-9
    carried = reader.read(off)[0]
    assert carried.tensions[0] == 0.0
    assert not carried.palms[0].any()
    inner = slice(4, 4 + len(PHALANGES))
    np.testing.assert_allclose(carried.loads[inner, 2], -1e-9 / 3.0, rtol=1e-12)


def test_a_reading_of_other_loads_leaves_the_first_as_it_was():
    """Arrays that are told must not be those that the next reading writes to."""
    stance = on_wall()
    settled, spaces, _, loads, reader = read(stance)
    limbs = [hand.limb for hand in stance.hands]
    first = reader.read(loads)[0].hands(limbs, HandBatch.of(settled), spaces)
    kept = [(hand.loads.copy(), hand.forces.copy(), hand.wrench.copy()) for hand in first]
    reader.read([2.0 * y for y in loads])
    for hand, numbers in zip(first, kept, strict=True):
        for got, expected in zip((hand.loads, hand.forces, hand.wrench), numbers, strict=True):
            np.testing.assert_array_equal(got, expected)


def test_the_same_holds_give_the_same_arrays_for_hands_that_are_settled_anew():
    stance = on_wall()
    settled, spaces, _, loads, reader = read(stance)
    again = [replace(settle_hand(hand, stance)) for hand in stance.hands]
    assert all(a is not b for a, b in zip(settled, again, strict=True))
    one, other = (r.read(loads)[0] for r in (reader, LoadRecovery(HandBatch.of(again), spaces)))
    np.testing.assert_array_equal(one.forces, other.forces)
    np.testing.assert_array_equal(one.drives, other.drives)


def test_what_is_kept_of_hands_cannot_be_written_to():
    stance = on_wall()
    settled, spaces, _, loads, reader = read(stance)
    limbs = [hand.limb for hand in stance.hands]
    hands = reader.read(loads)[0].hands(limbs, HandBatch.of(settled), spaces)
    for array in (hands[1].positions, hands[1].axes, hands[1].palm.position):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
