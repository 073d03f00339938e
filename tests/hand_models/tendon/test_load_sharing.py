"""Load sharing of palm tiles: the paper's two-tile formulas, and all friction patterns of N."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import linprog

from hand_models import InvalidInputError
from hand_models.tendon import share_load, shear_capacity

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


def patterns(n, own):
    """Ways for the tendon to move past the tiles' pulleys and the palm's: forth, back, or stuck.

    What passes a tile is the mean of what passes the palm's pulleys on both sides (none beyond
    the ends), so where these agree the tile's pulley has no choice.
    """
    signs = (1, -1, 0)
    if not own:
        yield from ((m, (None,) * (n - 1)) for m in itertools.product(signs, repeat=n))
        return
    for inner in itertools.product(signs, repeat=n - 1):
        ends = (0, *inner, 0)
        choices = []
        for pair in itertools.pairwise(ends):
            agreed = set(pair) - {0}
            choices.append(signs if len(agreed) == 2 else tuple(agreed) or (0,))
        yield from ((m, inner) for m in itertools.product(*choices))


def loads_by_enumeration(stiffness, springs, mu, own_mu, rng):
    """Tile loads of every consistent pattern: at the two ends of its solutions (where strands are
    open these are many) in a random direction, by linear programming.
    """
    k, kp = stiffness / np.mean(stiffness), springs / np.mean(stiffness)
    n = len(k)
    # unknowns A (n), B (n), δ (n), per unit of travel and of mean stiffness
    A, B, slip = np.split(np.eye(3 * n), 3)
    sums = 2.0 * np.tril(np.ones((n, n)))
    tile_rows, palm_rows = (sums - np.eye(n)) @ slip, (sums @ slip)[:-1]
    pulleys = [
        *zip(A, B, tile_rows, [ratio(mu)] * n, strict=True),
        *zip(B[:-1], A[1:], palm_rows, [ratio(own_mu)] * (n - 1), strict=True),
    ]
    equal = [*(A + B + (kp + k)[:, None] * slip), slip.sum(axis=0)]
    right = [*k, 0.0]
    direction = rng.normal(size=n) @ slip
    found = []
    for tiles, inner in patterns(n, own_mu > 0.0):
        eq, eq_right, less, less_right = list(equal), list(right), [], []
        for (s, after, row, rho), sign in zip(pulleys, tiles + inner, strict=True):
            if sign is None:
                eq.append(after - s)
                eq_right.append(0.0)
            elif sign == 0:
                eq.append(row)
                eq_right.append(0.0)
                less += [rho * s - after, rho * after - s]
                less_right += [0.0, 0.0]
            else:
                eq.append(after - rho * s if sign > 0 else s - rho * after)
                eq_right.append(0.0)
                less.append(-sign * row)
                less_right.append(0.0)
        bounds = [(0.0, None)] * (2 * n) + [(None, None)] * n
        for goal in (direction, -direction):
            answer = linprog(goal, less or None, less_right or None, eq, eq_right, bounds)
            if answer.status == 2:
                break
            assert answer.status == 0
            found.append(stiffness * (1.0 - answer.x[2 * n :]))
    return np.array(found)


@given(stiffness, stiffness, st.floats(0.0, 5000.0), friction)
def test_two_tiles_share_by_equation_1_or_stick(a, b, kp, mu):
    """Up to the stiffness ratio of Eq. 2 nothing slips, and each tile travels with the palm."""
    k1, k2 = max(a, b), min(a, b)
    slips = k2 < ratio(mu) * k1
    expected = equation_1(k1, k2, kp, mu) if slips else [k1, k2]
    np.testing.assert_allclose(share_load([k1, k2], kp, mu).tile_stiffness, expected, rtol=1e-8)
    np.testing.assert_allclose(
        share_load([k2, k1], kp, mu).tile_stiffness, expected[::-1], rtol=1e-8
    )


@pytest.mark.parametrize(("k1", "k2"), [(4900.0, 1400.0), (4900.0, 2200.0), (2200.0, 1400.0)])
@pytest.mark.parametrize("mu", [0.0, 0.1, MU])
def test_the_papers_pairs_follow_equations_1_and_3(k1, k2, mu):
    sharing = share_load([k1, k2], KP, mu)
    np.testing.assert_allclose(sharing.tile_stiffness, equation_1(k1, k2, KP, mu), rtol=1e-9)
    # the softer tile's hard stop ends the travel
    limit = sharing.tile_stiffness.sum() / sharing.tile_travel[1]
    assert limit == pytest.approx(equation_3(k1, k2, KP, mu), rel=1e-9)


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


def random_palm(rng, n, own):
    """Often with like springs, whose tiles stick and leave their strands open."""
    k = rng.choice(SPRINGS, n) if rng.uniform() < 0.5 else 10.0 ** rng.uniform(2.0, 4.3, n)
    mu = rng.choice([0.0, MU, rng.uniform(0.0, 1.0)], p=[0.1, 0.4, 0.5])
    own_mu = rng.choice([mu or MU, rng.uniform(0.1, 1.0)]) if own else 0.0
    return k, rng.choice([0.0, KP, 5000.0]), mu, own_mu


@pytest.mark.parametrize("own", [False, True], ids=["tiles", "tiles and palm"])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("palms", [1, pytest.param(8, marks=pytest.mark.slow)])
def test_the_loads_are_those_of_every_consistent_friction_pattern(n, own, palms):
    rng = np.random.default_rng(n)
    for _ in range(palms):
        palm = random_palm(rng, n, own)
        sharing = share_load(*palm)
        found = loads_by_enumeration(*palm, rng)
        assert len(found) >= 1
        size = sharing.tile_stiffness.mean()
        np.testing.assert_allclose(
            found / size, np.broadcast_to(sharing.tile_stiffness / size, found.shape), atol=2e-6
        )
        # the tendon keeps its length
        assert sharing.tile_travel.mean() == pytest.approx(1.0)
        assert (sharing.tile_travel > 0.0).all()


@given(st.lists(stiffness, min_size=1, max_size=8), friction)
def test_threading_the_tendon_from_the_other_end_loads_the_same_tiles(k, mu):
    """(Not the same strands: their tensions are open where pulleys stick.)"""
    for own in (0.0, mu):
        one, other = share_load(k, KP, mu, own), share_load(k[::-1], KP, mu, own)
        np.testing.assert_allclose(one.tile_stiffness, other.tile_stiffness[::-1], rtol=1e-6)


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


def test_two_tiles_with_friction_at_the_palms_pulley_alone_follow_equation_19_there():
    """A_1 = B_1 and A_2 = B_2 = ρ A_1, so 2 A = k x − k_p δ and 2 ρ A for the other, by hand."""
    k1, k2, rho = 4900.0, 1400.0, ratio(MU)
    sharing = share_load([k1, k2], 0, 0, MU)
    x1 = 2.0 * k2 / (k2 + rho * k1)
    np.testing.assert_allclose(sharing.tile_travel, [x1, 2.0 - x1], rtol=1e-12)


@pytest.mark.parametrize(
    ("k", "printed"),
    [
        ((4900.0, 1400.0, 1400.0, 1400.0), (0.96, 1.14)),
        ((1400.0, 4900.0, 1400.0, 4900.0), (1.02, 1.25)),
    ],
)
def test_friction_at_the_palms_own_pulleys_raises_the_gain(k, printed):
    """Against figures found apart from this code, for preload springs of about 0.14 N/mm."""

    def limit(mu, own):
        sharing = share_load(k, 140.0, mu, own)
        return sharing.tile_stiffness.sum() / sharing.tile_travel.max()

    gains = [limit(MU, own) / limit(0.0, 0.0) for own in (0.0, MU)]
    assert gains == pytest.approx(printed, abs=0.006)


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
        (([1000.0], KP, MU, 2.0), "own_friction"),
    ],
)
def test_impossible_palms_are_refused_by_field(arguments, field):
    with pytest.raises(InvalidInputError) as caught:
        share_load(*arguments)
    assert caught.value.field == field
