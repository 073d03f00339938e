"""The fixed wrist: the parallelepiped of Eq. 16, and what each row says."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.optimize import linprog

from hand_models import FINGERS, Cylinder, Edge, EmptySetError, Grasp, Plane, Pose, SpinyHand
from hand_models.fixed_wrist import wrench_space
from hand_models.parameters import ParameterTable, Quantity, hand_table
from hand_models.tile import Surface, inner_half_planes
from tests.suite.helpers.hands import (
    HAND,
    PINCH,
    ROCK,
    changed_hand,
    limiting,
    own_tiles,
    partly,
    pinch,
    tile_load,
    without_hand_load,
)

seeds = st.integers(0, 2**32 - 1)


def without_structure(space):
    """The same set with a structure and a grip that nothing overloads."""
    strong = ("finger_shear", "fingertip_force", "hand_load")
    names = [row.limit for row in space.rows[: len(space.s)]]
    return replace(space, s=np.where(np.isin(names, strong), 1e9, space.s))


def interval(settled, i, surface):
    """Least and largest tension of a finger, from its tiles' own limits one by one."""
    least, most = 0.0, HAND.maximum_tension
    pieces = inner_half_planes(surface)
    for t in own_tiles(settled, i):
        (t0, t1), (n0, n1) = settled.loads[t]
        # a base tile is pressed as the proximal phalanx after it is
        base = settled.tiles[t].phalanx == "base"
        p0, p1 = settled.engagement[t] * settled.loads[t + 1, 1] if base else (n0, n1)
        least = max(least, -(t0 + surface.friction * p0) / (t1 + surface.friction * p1))
        for p in pieces:
            constant = p.capacity - p.a_shear * t0 - p.a_normal * n0
            slope = p.a_shear * t1 + p.a_normal * n1
            if slope > 0.0:
                most = min(most, constant / slope)
            elif slope < 0.0:
                least = max(least, constant / slope)
    return least, most


@pytest.mark.parametrize("diameter", [0.3, 0.7])
@pytest.mark.parametrize("rotation", [0.0, math.pi])
def test_without_palm_and_lateral_the_set_is_the_parallelepiped_of_equation_16(diameter, rotation):
    """2^n corners o + Σ f_i v_i, each tension at its least or its largest."""
    grasp = Grasp(outer_rotation=rotation, palm=False, lateral=False)
    settled = HAND.settle(Cylinder(diameter), ROCK, grasp)
    space = without_hand_load(wrench_space(settled))
    assert space.columns == tuple(f"{finger}/tension" for finger in FINGERS)
    ends = [interval(settled, i, ROCK) for i in range(4)]
    corners = np.array([space.wrench(f) for f in itertools.product(*ends)])
    vertices = space.vertices()
    assert len(vertices) == 2**4
    gaps = np.linalg.norm(vertices[:, None] - corners, axis=2)
    np.testing.assert_allclose(gaps.min(axis=1), 0.0, atol=1e-7)
    np.testing.assert_allclose(gaps.min(axis=0), 0.0, atol=1e-7)


def test_a_sideways_load_is_shared_by_a_fingers_tiles_and_bounded_with_their_shear():
    settled = pinch()
    space = wrench_space(settled)
    i = FINGERS.index("inner_left")
    column = space.columns.index("inner_left/lateral")
    np.testing.assert_allclose(settled.lateral_shares[own_tiles(settled, i)], 1.0 / 3.0, atol=1e-15)
    # at 37 N: share/3 of Y beside (T, N) on each tile, on the tightest of its half-planes
    reach = min(
        3.0 * (p.capacity - p.a_shear * T - p.a_normal * N) / p.a_lateral
        for p in inner_half_planes(ROCK)
        for T, N in (tile_load(settled, t, 37.0) for t in own_tiles(settled, i))
    )
    y = np.zeros(len(space.columns))
    y[:4] = 37.0
    for sign in (1.0, -1.0):
        y[column] = sign * reach
        assert space.utilisations(y).max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("hold", "rotation"),
    [
        (Plane(), 0.0),
        pytest.param(Cylinder(0.3), 0.0, marks=pytest.mark.slow),
        pytest.param(Cylinder(0.3), math.pi, marks=pytest.mark.slow),
    ],
)
def test_what_a_hand_can_do_does_not_jump_where_its_base_tiles_lose_the_rock(hold, rotation):
    """A nanometre to either side, along and about all axes."""
    grasp = Grasp(outer_rotation=rotation, palm=False)
    seated = HAND.settle(hold, ROCK, grasp).seating.pose

    def away(off):
        pose = Pose(seated.position + np.array([0.0, 0.0, off]), seated.rotation)
        return HAND.settle(hold, ROCK, grasp, pose)

    near, far = 0.0, 5e-3
    assert away(near).engagement[0] > 0.1
    assert away(far).engagement[0] == 0.0
    while far - near > 1e-9:
        middle = (near + far) / 2.0
        near, far = (middle, far) if away(middle).engagement[0] > 0.0 else (near, middle)
    reaches = np.array(
        [
            [wrench_space(away(off)).support(side * axis) for axis in np.eye(6) for side in (1, -1)]
            for off in (near, far)
        ]
    )
    # sideways its own row binds until the last of its spines lets go
    np.testing.assert_allclose(reaches[0], reaches[1], rtol=0.025, atol=1e-5)


def test_a_tile_half_on_the_rock_has_half_the_load_and_half_the_strength():
    """So that tension alone uses it as it does a whole tile; its share of lateral load is less."""
    share = np.ones(14)
    share[0] = 0.5
    whole = HAND.settle(Cylinder(0.3), ROCK, Grasp(outer_rotation=0.0))
    half = partly(whole, share)
    used = []
    for settled in (whole, half):
        space = wrench_space(settled)
        limits = enumerate(space.rows[: len(space.s)])
        base = [i for i, row in limits if row.label.startswith("outer_left/base/")]
        assert len(base) == 2 * len(inner_half_planes(ROCK))
        column = space.columns.index("outer_left/lateral")
        tension = space.L[base, 0] / space.s[base], space.l0[base] / space.s[base]
        spines = settled.engagement[settled.finger_of == 0].sum()
        used.append((tension, space.L[base, column] / space.s[base] * spines, space.s[base]))
    np.testing.assert_allclose(used[1][0], used[0][0], rtol=1e-12)
    np.testing.assert_allclose(used[1][1], used[0][1], rtol=1e-12)
    np.testing.assert_allclose(used[1][2], 0.5 * used[0][2], rtol=1e-12)


def test_a_tile_with_fewer_and_fewer_spines_limits_its_hand_less_and_less():
    """Its utilisation goes to zero with its share, and no tension drags it backwards at last."""
    whole = HAND.settle(Cylinder(0.3), ROCK, Grasp(outer_rotation=0.0))
    assert whole.engagement[0] > 0.15
    at_zero, per_newton = whole.loads[0, 0] / whole.engagement[0]
    used, least = [], []
    for share in (0.15, 0.1 + 1e-9, 0.1 - 1e-9, 0.05, 0.01, 1e-3, 1e-6):
        part = np.ones(14)
        part[0] = share / whole.engagement[0]
        settled = partly(whole, part)
        space = wrench_space(settled)
        rows = [row.label.startswith("outer_left/base/") for row in space.rows]
        limits, hard = np.array(rows[: len(space.s)]), np.array(rows[len(space.s) :])
        y = np.zeros(len(space.columns))
        y[:4] = 100.0
        used.append(space.utilisations(y)[limits].max())
        least.append(float((space.h[hard] / space.H[hard, 0])[0]))
        whole_tile = (at_zero + per_newton * 100.0) / ROCK.shear_limit
        assert used[-1] >= whole_tile * share / limiting(share) - 1e-9
        assert -1e-9 <= settled.limit_shares[0] - share <= 0.05
    assert used[1] == pytest.approx(used[2], rel=1e-6)
    assert used[0] == pytest.approx(used[1], rel=1e-6)
    assert (np.diff(used[2:]) < 0.0).all()
    assert used[-1] < 1e-4
    assert least[0] == pytest.approx(least[2], rel=1e-6)
    assert least[-1] < -1e3


@pytest.mark.parametrize(("cap", "effective"), [(100.0, 100.0), (5000.0, 700.0), (None, 700.0)])
def test_a_callers_cap_on_tension_counts_below_the_hands_own_maximum(cap, effective):
    settled = HAND.settle(Plane(), ROCK.from_values({"shear_limit": 1e4}), Grasp(palm=False))
    space = without_structure(wrench_space(settled, cap))
    names = [row.limit for row in space.rows[: len(space.s)]]
    caps = space.s[[name == "tendon_tension" for name in names]]
    np.testing.assert_array_equal(caps, effective)
    along = space.support([-1.0, 0, 0, 0, 0, 0])
    shear = -space.wrench([effective] * 4 + [0.0] * (len(space.columns) - 4))[0]
    assert along == pytest.approx(shear)


def test_closing_beyond_what_tiles_hold_leaves_no_wrench():
    settled = pinch(0.3, ROCK.from_values({"shear_limit": 1.0}))
    with pytest.raises(EmptySetError, match="contradict"):
        wrench_space(settled).vertices()


def test_tendons_with_friction_are_not_slackened_below_closing():
    """There the far tiles would stick, and their loads not follow the tension."""
    hand = changed_hand("tendon", "friction", 0.2)
    settled = hand.settle(Cylinder(0.3), ROCK, PINCH)
    space = wrench_space(settled)
    hard = space.rows[len(space.s) :]
    sticks = [i for i, row in enumerate(hard) if row.limit == "tendon_sticks"]
    assert [hard[i].finger for i in sticks] == list(FINGERS)
    for finger, i in enumerate(sticks):
        np.testing.assert_array_equal(space.H[i], -np.eye(len(space.columns))[finger])
        assert space.h[i] == -37.0
    assert not any(row.limit == "tendon_sticks" for row in wrench_space(pinch()).rows)


def test_friction_at_the_palms_own_pulleys_lets_stiff_tiles_carry_more():
    stiffness = [1e4, 1e4, 1e4, 1e4, 4e3, 1e4, 1e4, 1e4]
    uneven = ParameterTable(
        {"palm": {"contact_stiffness": Quantity(stiffness, "N/m", "assumed", "of a test")}}
    )
    own = ParameterTable({"palm": {"own_pulley_friction": Quantity(0.34, "1", "assumed", "")}})
    table = hand_table().replaced(uneven)
    limits = [
        SpinyHand(one).settle(Cylinder(2.0), ROCK, PINCH).palm.shear_limit
        for one in (table, table.replaced(own))
    ]
    assert limits[1] > 1.02 * limits[0]


def test_what_drags_a_tile_backwards_gives_it_no_more_sideways():
    """However far pressed tiles are dragged backwards, each holds what it does without shear."""
    hold, surface = Edge(0.036, 2.08), Surface.named("sandpaper-36")
    settled = HAND.settle(hold, surface, Grasp(outer_rotation=math.pi))
    space = wrench_space(settled)
    backwards = 0
    for i, finger in enumerate(FINGERS):
        column = space.columns.index(f"{finger}/lateral")
        cost = -np.eye(len(space.columns))[column]
        bounds = np.concatenate([space.s - space.l0, space.h])
        found = linprog(cost, np.vstack([space.L, space.H]), bounds, bounds=(None, None))
        assert found.status == 0
        laterals = np.array([found.x[space.columns.index(f"{f}/lateral")] for f in FINGERS])
        for t in own_tiles(settled, i):
            shear, _, side = settled.tile_loads(found.x[:4], laterals)[t]
            backwards += shear < -0.1
            assert abs(side) <= settled.engagement[t] * surface.lateral_limit * (1.0 + 1e-7)
    assert backwards
