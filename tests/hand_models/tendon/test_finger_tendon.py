"""Stick and slip in a finger: hand-worked cases, all states by enumeration, and energy."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models import InvalidInputError
from hand_models.parameters import ParameterTable, hand_table
from hand_models.tendon import (
    FingerTendon,
    TendonBatch,
    TendonRegimes,
    TendonState,
    complementarity,
)

MU = 0.34
CLOSING = 37.0
ENGAGED = np.array([4.87, 6.66, 7.42])
"""Shear of the three tiles at 37 N [N]."""

SLIDING = replace(FingerTendon.from_table(hand_table()), friction=MU)
"""The hand's finger with friction between its phalanges."""

CP = SLIDING.pulley_ratio
K, KP = np.array([4250.0, 6543.0, 8215.0]), SLIDING.spring_stiffness
GAIN = CP * K / (K + KP)


def random_finger(rng):
    n = int(rng.integers(1, 5))
    touching = rng.uniform(size=n) < 0.9
    return FingerTendon(
        pulley_ratio=rng.uniform(1.0, 3.0),
        contact_stiffness=tuple(np.where(touching, 10.0 ** rng.uniform(3.0, 5.0, n), 0.0)),
        spring_stiffness=10.0 ** rng.uniform(3.0, 4.5),
        pulley_radii=tuple(rng.uniform(0.0, 0.008, n)),
        friction=rng.choice([0.0, MU, rng.uniform(0.0, 0.95)]),
        entry_friction=rng.choice([0.0, MU, rng.uniform(0.0, 0.95)]),
    )


def random_motion(rng, n):
    return rng.normal(0.0, 1e-3, n), rng.normal(0.0, 0.1, n)


def by_enumeration(finger, before, shift, turn, tension=None):
    """Every consistent change of load, over all states of all boundaries.

    Unknowns δd, t, v. A boundary slips either way or sticks; without a tension the motor is held,
    and the first boundary is taut or slack.
    """
    n, c = len(shift), finger.pulley_ratio
    k, kp, r = np.array(finger.contact_stiffness), finger.spring_stiffness, finger.pulley_radii
    mu = np.full(n, finger.friction)
    mu[0] = finger.entry_friction
    eye, none = np.eye(n), np.zeros((n, n))
    length = np.hstack([c * eye, none, np.eye(n, n, 1) - eye])
    balance = np.hstack([-np.diag(k + kp), c * eye, none])
    fixed = np.concatenate([-np.multiply(r, turn), c * before.tensions + k * shift])
    feed = 0.0 if tension is None else tension
    states = [(-1, 0, 1)] * n if tension is not None else [(0, 2), *[(-1, 0, 1)] * (n - 1)]
    found = []
    for pattern in itertools.product(*states):
        laws, rest = np.zeros((n, 3 * n)), np.zeros(n)
        for i, state in enumerate(pattern):
            if state == 0:
                laws[i, 2 * n + i] = 1.0
            else:
                # slack (2): no tension; else t_i = (1 ∓ μ) t_{i−1}
                ratio = 0.0 if state == 2 else 1.0 - state * mu[i]
                laws[i, n + i] = 1.0
                if i:
                    laws[i, n + i - 1] = -ratio
                else:
                    rest[i] = ratio * feed
        system = np.vstack([length, balance, laws])
        solution = np.linalg.solve(system, np.concatenate([fixed, rest]))
        d, t, v = np.split(solution, 3)
        before_boundary = np.concatenate([[feed], t[:-1]])
        low, high = (1.0 - mu) * before_boundary, (1.0 + mu) * before_boundary
        if tension is None:
            low[0], high[0] = 0.0, np.inf
        fits = (t >= low - 1e-9).all() and (t <= high + 1e-9).all()
        ways = np.where(np.array(pattern) == 2, 1, pattern)
        if fits and (v * ways >= -1e-12).all():
            found.append((d, t))
    return found


def test_with_the_motor_held_the_solution_is_the_only_one():
    rng = np.random.default_rng(2)
    slackened = 0
    for _ in range(500):
        finger = random_finger(rng)
        n = len(finger.pulley_radii)
        before = finger.closed(rng.uniform(5.0, 200.0), rng.uniform(0.0, 20.0, n))
        shift, turn = random_motion(rng, n)
        after = finger.held(before, 10.0 * shift, turn)
        found = by_enumeration(finger, before, 10.0 * shift, turn)
        assert found
        for d, t in found:
            np.testing.assert_allclose(after.tensions, t, rtol=1e-8, atol=1e-8)
            moved = np.array(finger.contact_stiffness) * (10.0 * shift + d)
            np.testing.assert_allclose(after.shears - before.shears, moved, atol=1e-6)
        slackened += after.tensions.max() == 0.0
    assert slackened > 30


def test_a_sticking_tendon_gives_equation_20_by_hand():
    """δl = −r δq / c_p: 0.02 rad on 5.5, 3.195 and 1.945 mm wind 55.0, 31.95 and 19.45 µm off."""
    state = SLIDING.held(SLIDING.closed(CLOSING, ENGAGED), [1e-3] * 3, [0.02] * 3)
    wound = np.array([55.0e-6, 31.95e-6, 19.45e-6])
    np.testing.assert_allclose(state.shears - ENGAGED, (1e-3 - wound) * K, rtol=1e-9)


def test_without_friction_the_tension_is_the_same_everywhere():
    """Held: one unknown, Σ (c_p δd + r δq) = 0, worked by hand for a common shift."""
    finger = replace(SLIDING, friction=0.0)
    shift, turn = np.array([1e-4, 2e-4, 3e-4]), np.array([0.01, 0.0, -0.01])
    state = finger.held(finger.closed(CLOSING, ENGAGED), shift, turn)
    wound = np.dot(finger.pulley_radii, turn)
    rise = ((GAIN * shift).sum() - wound) / (CP**2 / (K + KP)).sum()
    np.testing.assert_allclose(state.tensions, CLOSING + rise)
    assert state.motor_tension == pytest.approx(CLOSING + rise)


def test_a_held_motor_feels_only_what_the_entry_cannot_hold():
    finger = replace(SLIDING, entry_friction=MU)
    closed = finger.closed(CLOSING, ENGAGED)
    little = finger.held(closed, 1e-3 * closed.tensions / CLOSING)
    assert little.motor_tension == CLOSING
    assert little.tensions[0] == pytest.approx(CLOSING + 4250.0 * 1e-3 / CP)
    much = finger.held(closed, [8e-3] * 3)
    assert much.motor_tension > CLOSING
    assert much.motor_tension == pytest.approx(much.tensions[0] / 1.34)


def test_a_tile_on_the_base_comes_first_and_has_no_joint():
    finger = FingerTendon.from_table(hand_table(), base_tile=True)
    assert finger.contact_stiffness == (4250.0, 4250.0, 6543.0, 8215.0)
    assert finger.pulley_radii == (0.0, 0.0055, 0.003195, 0.001945)
    state = replace(finger, friction=MU).closed(CLOSING, [1.0] * 4)
    np.testing.assert_allclose(state.tensions, CLOSING * 0.66 ** np.arange(4))


@pytest.mark.parametrize("name", ["friction", "entry_friction"])
def test_a_friction_that_the_parameters_lack_is_named(name):
    sections = {s: dict(entries) for s, entries in hand_table().sections.items()}
    del sections["tendon"][name]
    with pytest.raises(InvalidInputError) as caught:
        FingerTendon.from_table(ParameterTable(sections))
    assert caught.value.field == f"tendon.{name}"


def test_a_tile_off_the_rock_carries_nothing():
    finger = replace(SLIDING, contact_stiffness=(4250.0, 0.0, 8215.0))
    state = finger.held(finger.closed(CLOSING, ENGAGED * [1, 0, 1]), [1e-3] * 3, [0.01] * 3)
    assert state.shears[1] == 0.0
    assert state.shears[2] > ENGAGED[2]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"pulley_ratio": 0.0}, "pulley_ratio"),
        ({"spring_stiffness": -1.0}, "spring_stiffness"),
        ({"contact_stiffness": (1e4, -1.0, 1e4)}, "contact_stiffness"),
        ({"contact_stiffness": (1e4, 0.0, 1e4), "spring_stiffness": 0.0}, "contact_stiffness"),
        ({"pulley_radii": (0.005, 0.003)}, "pulley_radii"),
        ({"friction": 1.0}, "friction"),
        ({"entry_friction": -0.1}, "entry_friction"),
        ({"friction": float("nan")}, "friction"),
    ],
)
def test_impossible_tendons_are_refused_by_field(change, field):
    with pytest.raises(InvalidInputError) as caught:
        replace(SLIDING, **change)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (([0.0, 0.0],), "shift"),
        (([0.0, 0.0, float("nan")],), "shift"),
        ((None, [0.0] * 4), "turn"),
    ],
)
def test_impossible_changes_of_load_are_refused_by_field(arguments, field):
    state = SLIDING.closed(CLOSING, ENGAGED)
    with pytest.raises(InvalidInputError) as caught:
        SLIDING.held(state, *arguments)
    assert caught.value.field == field


def test_a_state_is_left_as_it_was():
    state = SLIDING.closed(CLOSING, ENGAGED)
    SLIDING.held(state, [1e-3] * 3)
    assert isinstance(state, TendonState)
    np.testing.assert_array_equal(state.shears, ENGAGED)
    assert state.motor_tension == CLOSING


def test_tiles_partly_on_the_rock_give_that_part_of_a_whole_tiles_shear():
    """For tendon and for slip alike; tension that does not follow the slip, as without friction."""
    whole = FingerTendon.from_table(hand_table())
    share = np.array([1.0, 0.5, 0.0])
    some = whole.engaged(share)
    assert some.contact_stiffness[0] == whole.contact_stiffness[0]
    assert some.contact_stiffness[2] == 0.0
    slips = np.array([[1e-4, -2e-4, 3e-4], [0.0, 0.0, 0.0]])
    states = [
        tendon.closed(CLOSING, part * ENGAGED) for tendon, part in ((whole, 1.0), (some, share))
    ]
    losses = np.array([state.tensions for state in states]) / CLOSING
    at_rest = np.array([state.shears for state in states])[..., None]
    drags = (
        TendonRegimes([whole, some], losses, "tension")
        .respond(np.array([slips.T] * 2), np.zeros((2, 3, 2)), np.full((2, 2), CLOSING), at_rest)
        .shears
    )
    np.testing.assert_allclose(drags[1], share[:, None] * drags[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("motor", [None, CLOSING])
@pytest.mark.parametrize("mu", [0.0, MU])
@pytest.mark.parametrize("tile", range(3))
def test_a_tile_that_lets_go_keeps_the_tendons_laws(tile, mu, motor):
    finger = replace(SLIDING, friction=mu)
    before = finger.closed(CLOSING, ENGAGED)
    after = finger.slipped(before, tile, 0.5, motor)
    assert after.shears[tile] == pytest.approx(0.5)
    # each tile's balance, and the shears of those that hold
    rise, lost = after.tensions - before.tensions, after.shears - before.shears
    travel = (CP * rise - lost) / KP
    others = np.arange(3) != tile
    np.testing.assert_allclose(lost[others], (K * travel)[others], atol=1e-9)
    # the tendon's length and friction, at each boundary
    passed = np.cumsum((CP * travel)[::-1])[::-1]
    assert finger.drawn(before, after) == pytest.approx(passed[0])
    if motor is None:
        assert passed[0] == pytest.approx(0.0, abs=1e-12)
        assert after.motor_tension <= CLOSING + 1e-9
    else:
        assert passed[0] >= -1e-12
    ratios = after.tensions[1:] / after.tensions[:-1]
    for v, ratio in zip(passed[1:], ratios, strict=True):
        assert 1.0 - mu - 1e-9 <= ratio <= 1.0 + mu + 1e-9
        if abs(v) > 1e-9:
            assert ratio == pytest.approx(1.0 - mu if v > 0.0 else 1.0 + mu)


@st.composite
def fingers_moved(draw):
    """Fingers of which tiles may be off the rock, boundaries without friction, tendons slack."""
    n, friction = draw(st.integers(1, 4)), st.sampled_from([0.0, 0.05, MU, 0.9])
    of_tiles = st.lists(st.floats(-1.0, 1.0), min_size=n, max_size=n).map(np.array)
    stiffness = st.lists(st.sampled_from([0.0, 4250.0, 8215.0]), min_size=n, max_size=n)
    radii = st.lists(st.sampled_from([0.0, 0.002, 0.006]), min_size=n, max_size=n)
    known = tuple(draw(stiffness)), draw(st.sampled_from([900.0, KP])), tuple(draw(radii))
    finger = FingerTendon(CP, *known, draw(friction), draw(friction))
    before = finger.closed(draw(st.sampled_from([0.0, 5.0, CLOSING])), 5.0 * draw(of_tiles) + 5.0)
    size = draw(st.sampled_from([0.0, 1e-6, 1e-3, 1e-2]))
    return finger, before, size * draw(of_tiles), 10.0 * size * draw(of_tiles), draw(st.booleans())


@given(st.lists(fingers_moved(), min_size=1, max_size=6))
@settings(max_examples=60)
def test_fingers_solved_at_once_stick_and_slip_as_by_lemkes_method(drawn):
    fingers, states, shifts, turns, driven = zip(*drawn, strict=True)

    def padded(rows):
        return np.array([[*row, *[0.0] * (4 - len(row))] for row in rows])

    longest = max(map(len, shifts))
    rest = padded([each.tensions for each in states]), padded([each.shears for each in states])
    at_rest = np.array([each.motor_tension for each in states]), *(x[:, :longest] for x in rest)
    shift, turn = padded(shifts)[:, :longest], padded(turns)[:, :longest]
    tensions, shears = TendonBatch(fingers, driven).changed(at_rest, shift, turn, 0.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(complementarity, "_newton", none_by_newton)
        for i, (finger, before, own, turned, keeps) in enumerate(drawn):
            alone = (finger.kept if keeps else finger.held)(before, own, turned)
            n = len(own)
            np.testing.assert_allclose(tensions[i, :n], alone.tensions, rtol=1e-9, atol=1e-8)
            np.testing.assert_allclose(shears[i, :n], alone.shears, rtol=1e-9, atol=1e-8)


def none_by_newton(V, v_0, S, s_0, known):
    """Leave every tendon to Lemke's method."""
    return np.zeros(v_0.shape), np.zeros(len(v_0), dtype=bool)


def test_newtons_method_solves_most_fingers(monkeypatch):
    left = []
    lemke = complementarity.stick_slip
    monkeypatch.setattr(complementarity, "stick_slip", lambda *own: left.append(1) or lemke(*own))
    rng = np.random.default_rng(5)
    for _ in range(100):
        finger = random_finger(rng)
        shift, turn = random_motion(rng, len(finger.pulley_radii))
        before = finger.closed(rng.uniform(5.0, 200.0), rng.uniform(0.0, 20.0, len(shift)))
        finger.held(before, 10.0 * shift, turn)
        finger.kept(before, shift, turn)
    assert len(left) < 10
