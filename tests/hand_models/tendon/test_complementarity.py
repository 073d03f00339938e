"""Lemke's method against enumeration of every complementary basis."""

import itertools

import numpy as np
import pytest

from hand_models.base import SolverError
from hand_models.tendon.complementarity import solve_lcp, stick_slip


def by_enumeration(M, q):
    """All solutions, over the 2^n choices of which z may be above zero."""
    n, found = len(q), []
    for support in itertools.product((False, True), repeat=n):
        chosen = np.array(support)
        z = np.zeros(n)
        z[chosen] = np.linalg.solve(M[np.ix_(chosen, chosen)], -q[chosen])
        if min(z.min(), (M @ z + q).min()) >= -1e-9:
            found.append(z)
    return np.array(found)


@pytest.mark.parametrize("seed", range(8))
def test_a_positive_definite_problem_has_the_one_solution_of_all_bases(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    root, skew = rng.normal(size=(n, n)), rng.normal(size=(n, n))
    M, q = root @ root.T + 0.1 * np.eye(n) + skew - skew.T, rng.normal(size=n)
    z = solve_lcp(M, q, rng.uniform(0.1, 2.0, n))
    found = by_enumeration(M, q)
    np.testing.assert_allclose(found, np.broadcast_to(z, found.shape), atol=1e-8)
    assert len(found) >= 1


def test_nothing_to_do_where_zero_is_a_solution():
    assert (solve_lcp(-np.eye(3), np.array([0.0, 1.0, 2.0]), np.ones(3)) == 0.0).all()
    assert solve_lcp(np.zeros((0, 0)), np.zeros(0), np.zeros(0)).shape == (0,)


def test_a_problem_without_a_solution_is_not_answered():
    with pytest.raises(SolverError):
        solve_lcp(np.array([[-1.0]]), np.array([-1.0]), np.ones(1))


def test_the_size_of_a_problem_does_not_matter():
    M, q = np.array([[2.0, 1.0], [0.0, 1.0]]), np.array([-3.0, -1.0])
    for size in (1e-12, 1.0, 1e12):
        np.testing.assert_allclose(solve_lcp(M, size * q, np.ones(2)), [size, size], rtol=1e-9)


@pytest.mark.parametrize("drive", [0.0, 0.4, 1.0, 1.6, 2.0, 3.0])
def test_one_pulley_sticks_until_its_bound(drive):
    """v = a − drive with 0 ≤ a ≤ 2: a follows the drive, and the tendon runs beyond 2."""
    a = stick_slip((np.eye(1), np.array([-drive])), (np.zeros((1, 1)), np.array([2.0])))
    assert a == pytest.approx(min(drive, 2.0))
