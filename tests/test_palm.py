"""Load sharing of palm tiles: the paper's two-tile formulas, and all friction patterns of N."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hand_models import InvalidInputError
from hand_models.palm import share_load, shear_capacity

MU, KP = 0.34, 840.0
SPRINGS = (1400.0, 2200.0, 4900.0)
"""The paper's contact springs [N/m]."""

stiffness = st.floats(100.0, 20000.0)
friction = st.floats(0.0, 1.9)


def ratio(mu):
    """Eq. 19: the strands on either side of a slipping pulley."""
    return (1.0 - mu / 2.0) / (1.0 + mu / 2.0)


def equation_1(k1, k2, kp, mu):
    """Tile loads per unit of palm travel where k1 ≥ k2."""
    below = (2.0 - mu) * k1 + (2.0 + mu) * k2 + 4.0 * kp
    first = 2.0 * (2.0 + mu) * k1 * k2 + 4.0 * kp * k1
    second = 2.0 * (2.0 - mu) * k1 * k2 + 4.0 * kp * k2
    return np.array([first, second]) / below


def equation_3(k1, k2, kp, mu):
    """Palm load per unit of travel of the softer tile 2."""
    return (4.0 * k1 * k2 + 2.0 * kp * (k1 + k2)) / ((2.0 - mu) * k1 + 2.0 * kp)


def residuals(sharing, k, kp, mu):
    """What is left of Eq. 18, of the tendon's length, and of friction at each pulley."""
    k, slip = np.asarray(k), 1.0 - sharing.tile_travel
    F, rho = sharing.strand_stiffness, ratio(mu)
    travel = 2.0 * (np.cumsum(slip) - slip) + slip
    forward, backward = F[1:] - rho * F[:-1], F[:-1] - rho * F[1:]
    size = np.abs(k).mean()
    moves = np.minimum(np.maximum(travel, 0.0), np.abs(forward) / size)
    moves = np.maximum(moves, np.minimum(np.maximum(-travel, 0.0), np.abs(backward) / size))
    return {
        "balance": (F[:-1] + F[1:] + kp * slip - k * sharing.tile_travel) / size,
        "length": slip.sum(),
        "travel": sharing.tendon_travel - travel,
        "cone": np.minimum(np.minimum(forward, backward), 0.0) / size,
        "complementarity": moves,
        "loads": (sharing.tile_stiffness - k * sharing.tile_travel) / size,
    }


def by_enumeration(k, kp, mu):
    """Every consistent solution over all 3^N patterns: slip forward, backward, or stick."""
    n, rho = len(k), ratio(mu)
    length_row = np.concatenate([np.zeros(n + 1), np.ones(n)])
    found = []
    for pattern in itertools.product((1, -1, 0), repeat=n):
        # unknowns F_0 … F_N, slips δ_i = 1 − x_i
        A, b = [length_row], [0.0]
        for i, sign in enumerate(pattern):
            balance = np.zeros(2 * n + 1)
            balance[[i, i + 1]], balance[n + 1 + i] = 1.0, kp + k[i]
            law = np.zeros(2 * n + 1)
            if sign == 0:
                law[n + 1 : n + 1 + i], law[n + 1 + i] = 2.0, 1.0
            else:
                law[i + 1 if sign > 0 else i], law[i if sign > 0 else i + 1] = 1.0, -rho
            A += [balance, law]
            b += [k[i], 0.0]
        A, b = np.array(A), np.array(b)
        if np.linalg.cond(A / np.abs(A).max(axis=1)[:, None]) > 1e12:
            continue
        solution = np.linalg.solve(A, b)
        F, slip = solution[: n + 1], solution[n + 1 :]
        travel = 2.0 * (np.cumsum(slip) - slip) + slip
        small = 1e-9 * np.mean(k)
        if (F[1:] < rho * F[:-1] - small).any() or (F[:-1] < rho * F[1:] - small).any():
            continue
        if all(t * s >= -1e-9 if s else True for t, s in zip(travel, pattern, strict=True)):
            found.append(k * (1.0 - slip))
    return np.array(found)


@settings(max_examples=100, deadline=None)
@given(stiffness, stiffness, st.floats(0.0, 5000.0), friction)
def test_two_tiles_share_by_equation_1_or_stick(a, b, kp, mu):
    """Up to the stiffness ratio of Eq. 2 nothing slips, and each tile travels with the palm."""
    k1, k2 = max(a, b), min(a, b)
    slips = k2 < ratio(mu) * k1
    expected = equation_1(k1, k2, kp, mu) if slips else [k1, k2]
    np.testing.assert_allclose(share_load([k1, k2], kp, mu).tile_stiffness, expected, rtol=1e-9)
    np.testing.assert_allclose(
        share_load([k2, k1], kp, mu).tile_stiffness, expected[::-1], rtol=1e-9
    )


@pytest.mark.parametrize(("k1", "k2"), [(4900.0, 1400.0), (4900.0, 2200.0), (2200.0, 1400.0)])
@pytest.mark.parametrize("mu", [0.0, 0.1, MU])
def test_the_papers_pairs_follow_equations_1_and_3(k1, k2, mu):
    sharing = share_load([k1, k2], KP, mu)
    np.testing.assert_allclose(sharing.tile_stiffness, equation_1(k1, k2, KP, mu), rtol=1e-9)
    # the softer tile's hard stop ends the travel
    limit = sharing.tile_stiffness.sum() / sharing.tile_travel[1]
    assert limit == pytest.approx(equation_3(k1, k2, KP, mu), rel=1e-9)


@settings(max_examples=50, deadline=None)
@given(stiffness, st.floats(1.0, 20.0), st.floats(0.0, 5000.0))
def test_the_friction_of_equation_2_loads_both_tiles_alike_for_their_stiffness(k2, times, kp):
    k1 = times * k2
    mu = 2.0 * (k1 - k2) / (k1 + k2)
    sharing = share_load([k1, k2], kp, mu)
    first, second = sharing.tile_stiffness / [k1, k2]
    assert first == pytest.approx(second, rel=1e-6)
    assert equation_1(k1, k2, kp, mu) / [k1, k2] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize(("k1", "k2"), [*itertools.combinations(sorted(SPRINGS)[::-1], 2)])
def test_friction_raises_the_two_tile_palms_load_by_the_printed_14_percent(k1, k2):
    def limit(mu):
        """With the travel of the softest spring as the limit, whichever tile it is under."""
        sharing = share_load([k1, k2], KP, mu)
        return sharing.tile_stiffness.sum() / sharing.tile_travel[1]

    assert limit(MU) / limit(0.0) >= 1.14
    assert equation_3(k1, k2, KP, MU) / equation_3(k1, k2, KP, 0.0) >= 1.14


@pytest.mark.parametrize("k", [*itertools.combinations_with_replacement(SPRINGS, 3)])
@pytest.mark.parametrize("mu", [0.0, MU])
def test_like_springs_load_alike(k, mu):
    """Without friction every tile but for its preload spring carries the same: 2 F + k_p δ."""
    sharing = share_load(k, KP, mu)
    tension = sharing.tile_stiffness - KP * (1.0 - sharing.tile_travel)
    if mu == 0.0 or len(set(k)) == 1:
        np.testing.assert_allclose(tension, tension[0], rtol=1e-9)
    else:
        assert np.ptp(tension) > 0.01 * tension.mean()


@settings(max_examples=25, deadline=None)
@given(st.lists(st.sampled_from([*SPRINGS, 300.0, 9000.0]), min_size=1, max_size=4), friction)
def test_the_solution_is_the_only_one_of_all_friction_patterns(k, mu):
    k = np.array(k) * np.linspace(1.0, 1.1, len(k))
    found = by_enumeration(k, KP, mu)
    assert len(found) >= 1
    got = share_load(k, KP, mu).tile_stiffness
    np.testing.assert_allclose(found, np.broadcast_to(got, found.shape), rtol=1e-6)


@settings(max_examples=150, deadline=None)
@given(st.lists(stiffness, min_size=1, max_size=8), st.floats(0.0, 5000.0), friction)
def test_balance_length_and_friction_hold_at_every_pulley(k, kp, mu):
    sharing = share_load(k, kp, mu)
    for name, left in residuals(sharing, k, kp, mu).items():
        np.testing.assert_allclose(left, 0.0, atol=1e-8, err_msg=name)
    assert (sharing.strand_stiffness > 0.0).all()
    assert (sharing.tile_travel > 0.0).all()


@settings(max_examples=50, deadline=None)
@given(st.lists(stiffness, min_size=1, max_size=8), friction)
def test_threading_the_tendon_from_the_other_end_loads_the_same_tiles(k, mu):
    """(Not the same strands: their tensions are open where pulleys stick.)"""
    one, other = share_load(k, KP, mu), share_load(k[::-1], KP, mu)
    np.testing.assert_allclose(one.tile_stiffness, other.tile_stiffness[::-1], rtol=1e-6)


@settings(max_examples=30, deadline=None)
@given(st.lists(stiffness, min_size=2, max_size=8), friction, st.floats(1e-3, 1e3))
def test_loads_scale_with_all_stiffnesses(k, mu, factor):
    one = share_load(k, KP, mu)
    scaled = share_load(np.multiply(k, factor), KP * factor, mu)
    np.testing.assert_allclose(scaled.tile_stiffness, factor * one.tile_stiffness, rtol=1e-6)
    np.testing.assert_allclose(scaled.tile_travel, one.tile_travel, rtol=1e-6, atol=1e-9)


def test_capacity_is_reached_when_the_first_tile_is_at_its_limit():
    sharing = share_load([4900.0, 1400.0], KP, MU)
    first, second = equation_1(4900.0, 1400.0, KP, MU)
    assert sharing.capacity([60.0, 60.0]) == pytest.approx(60.0 / first * (first + second))
    assert sharing.capacity([60.0, 1.0]) == pytest.approx(1.0 / second * (first + second))


def test_eight_alike_tiles_carry_eight_times_one():
    assert shear_capacity((1e4,) * 8, KP, MU, 63.0) == pytest.approx(8 * 63.0)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (([], KP, MU), "contact_stiffness"),
        (([1000.0, 0.0], KP, MU), "contact_stiffness"),
        (([1000.0, math.nan], KP, MU), "contact_stiffness"),
        (([1000.0], -1.0, MU), "spring_stiffness"),
        (([1000.0], math.inf, MU), "spring_stiffness"),
        (([1000.0], KP, 2.0), "friction"),
        (([1000.0], KP, -0.1), "friction"),
        (([1000.0], KP, math.nan), "friction"),
    ],
)
def test_impossible_palms_are_refused_by_field(arguments, field):
    with pytest.raises(InvalidInputError) as caught:
        share_load(*arguments)
    assert caught.value.field == field
