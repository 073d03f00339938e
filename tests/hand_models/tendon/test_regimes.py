"""All changes of load at once are what all states of all boundaries allow one by one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.compliance import COMPLEX_STEP
from hand_models.tendon import FingerTendon, TendonRegimes, pad_tiles
from hand_models.tendon.regimes import TendonResponse
from tests.hand_models.tendon.test_finger_tendon import by_enumeration

MOTOR_SCHEMES = ("held", "tension")


def random_tendon(rng, friction, entry):
    n = int(rng.integers(3, 5))
    stiffness = rng.uniform(2e3, 2e4, n) * (rng.random(n) > 0.15)
    tendon = FingerTendon(
        2.0, tuple(stiffness), 11500.0, tuple(rng.uniform(0.0, 6e-3, n)), friction, entry
    )
    return tendon, tendon.closed(37.0, rng.uniform(2.0, 9.0, n))


def respond(tendon, state, scheme, slips, turns):
    """Return what one tendon does after changes of load (m, n), as the only finger."""
    losses = state.tensions / state.motor_tension
    regimes = TendonRegimes([tendon], losses[None], scheme)
    m = len(slips)
    tension = np.full((1, m), state.motor_tension)
    at_rest = state.shears[None, :, None]
    found = regimes.respond(slips.T[None], turns.T[None], tension, at_rest)
    return TendonResponse(found.tensions[0].T, found.shears[0].T, found.regime[0])


@pytest.mark.slow
@pytest.mark.parametrize("scheme", MOTOR_SCHEMES)
@pytest.mark.parametrize(("friction", "entry"), [(0.34, 0.34), (0.34, 0.0), (0.1, 0.0), (0.0, 0.0)])
@given(seed=st.integers(0, 10**6), size=st.sampled_from([1e-5, 3e-4, 3e-3]))
def test_every_change_of_load_is_the_only_consistent_one(scheme, friction, entry, seed, size):
    rng = np.random.default_rng(seed)
    tendon, state = random_tendon(rng, friction, entry)
    n = len(tendon.pulley_radii)
    slips, turns = size * rng.normal(size=(4, n)), 30.0 * size * rng.normal(size=(4, n))
    found = respond(tendon, state, scheme, slips, turns)
    for i in range(4):
        tension = None if scheme == "held" else 37.0
        alone = by_enumeration(tendon, state, slips[i], turns[i], tension)
        assert alone
        for d, t in alone:
            np.testing.assert_allclose(found.tensions[i], t, atol=1e-7)
            moved = np.array(tendon.contact_stiffness) * (slips[i] + d)
            np.testing.assert_allclose(found.shears[i] - state.shears, moved, atol=1e-7)


def test_small_changes_stick_and_large_ones_slip():
    tendon, _ = random_tendon(np.random.default_rng(3), 0.34, 0.0)
    # closed without loss, so that friction may turn either way
    state = replace(tendon, friction=0.0).closed(37.0, [5.0] * len(tendon.pulley_radii))
    n = len(tendon.pulley_radii)
    sizes = np.array([1e-6, 5e-3])
    found = respond(tendon, state, "held", sizes[:, None] * np.ones(n), np.zeros((2, n)))
    assert found.regime[0] == 0
    assert found.regime[1] != 0
    # where nothing slips the tile follows the winding: δT = k (δx − r δq / c_p) (Eq. 20)
    np.testing.assert_allclose(
        found.shears[0] - state.shears, np.array(tendon.contact_stiffness) * 1e-6, atol=1e-12
    )


@pytest.mark.parametrize("scheme", MOTOR_SCHEMES)
def test_slopes_are_those_of_the_regime(scheme):
    rng = np.random.default_rng(5)
    tendon, state = random_tendon(rng, 0.34, 0.2)
    n, small = len(tendon.pulley_radii), 1e-9
    for size in (1e-4, 2e-3):
        at, way = size * rng.normal(size=(1, n)), rng.normal(size=(1, n))
        none = np.zeros((1, n))
        exact = (
            respond(tendon, state, scheme, at + 1j * COMPLEX_STEP * way, none).shears.imag
            / COMPLEX_STEP
        )
        ends = [
            respond(tendon, state, scheme, at + side * small * way, none).shears
            for side in (1.0, -1.0)
        ]
        np.testing.assert_allclose(exact, (ends[0] - ends[1]) / (2.0 * small), rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("scheme", MOTOR_SCHEMES)
def test_tendons_of_other_lengths_change_nothing_of_each_other(scheme):
    rng = np.random.default_rng(8)
    pairs = []
    while {len(state.shears) for _, state in pairs} != {3, 4} or len(pairs) < 5:
        pairs.append(random_tendon(rng, 0.34, 0.1))
    m = 50
    slips, turns = (
        [size * rng.normal(size=(m, len(state.shears))) for _, state in pairs]
        for size in (2e-3, 0.05)
    )
    losses = pad_tiles([state.tensions / state.motor_tension for _, state in pairs])
    regimes = TendonRegimes([tendon for tendon, _ in pairs], losses, scheme)

    def padded(parts):
        return np.array([np.pad(part.T, ((0, 4 - part.shape[1]), (0, 0))) for part in parts])

    tension = np.full((len(pairs), m), 37.0)
    rest = pad_tiles([state.shears for _, state in pairs])[..., None]
    found = regimes.respond(padded(slips), padded(turns), tension, rest)
    for i, (tendon, state) in enumerate(pairs):
        alone = respond(tendon, state, scheme, slips[i], turns[i])
        n = len(state.shears)
        np.testing.assert_allclose(found.tensions[i, :n].T, alone.tensions, atol=1e-9)
        np.testing.assert_allclose(found.shears[i, :n].T, alone.shears, atol=1e-9)
