"""Stick and slip in a finger: hand-worked cases, all states by enumeration, and energy."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models import InvalidInputError
from hand_models.parameters import ParameterTable, hand_table
from hand_models.tendon import FingerTendon, TendonState

MU = 0.34
CLOSING = 37.0
ENGAGED = np.array([4.85, 6.95, 8.05])
"""Shear of the three tiles at 37 N (Fig. 12) [N]."""

SLIDING = replace(FingerTendon.from_table(hand_table()), friction=MU)
"""The hand's finger with friction between its phalanges."""

CP = SLIDING.pulley_ratio
K, KP = SLIDING.contact_stiffness[0], SLIDING.spring_stiffness
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
                rest[i] = -before.slack if tension is None and i == 0 else 0.0
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
        slipped = v + (before.slack if tension is None else 0.0) * (np.arange(n) == 0)
        fits = (t >= low - 1e-9).all() and (t <= high + 1e-9).all()
        ways = np.where(np.array(pattern) == 2, 1, pattern)
        if fits and (slipped * ways >= -1e-12).all():
            found.append((d, t))
    return found


def assert_only_solution(finger, before, after, shift, turn, tension=None):
    found = by_enumeration(finger, before, shift, turn, tension)
    assert found
    for d, t in found:
        np.testing.assert_allclose(after.tensions, t, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(after.tile_travel - before.tile_travel, d, atol=1e-10)


@pytest.mark.parametrize("count", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_random_fingers_move_as_the_only_consistent_state(count):
    """Each through a history: closing, a change of load, and another from there."""
    rng = np.random.default_rng(1)
    for _ in range(count):
        finger = random_finger(rng)
        n = len(finger.pulley_radii)
        before = finger.closed(rng.uniform(5.0, 200.0), rng.uniform(0.0, 20.0, n))
        for _ in range(2):
            shift, turn = random_motion(rng, n)
            tension = before.motor_tension * rng.choice([1.0, rng.uniform(0.3, 2.0)])
            after = finger.at_tension(before, tension, shift, turn)
            assert_only_solution(finger, before, after, shift, turn, tension)
            before = after


def test_with_the_motor_held_too_the_solution_is_the_only_one():
    rng = np.random.default_rng(2)
    slackened = 0
    for _ in range(300):
        finger = random_finger(rng)
        n = len(finger.pulley_radii)
        before = finger.closed(rng.uniform(5.0, 200.0), rng.uniform(0.0, 20.0, n))
        for _ in range(3):
            shift, turn = random_motion(rng, n)
            after = finger.held(before, 10.0 * shift, turn)
            assert_only_solution(finger, before, after, 10.0 * shift, turn)
            slackened += after.slack > 0.0
            before = after
    assert slackened > 50


def test_a_sticking_tendon_gives_equation_20_by_hand():
    """δl = −r δq / c_p: 0.02 rad on 5.5, 3.08 and 2.69 mm wind 55.0, 30.8 and 26.9 µm off."""
    state = SLIDING.held(SLIDING.closed(CLOSING, ENGAGED), [1e-3] * 3, [0.02] * 3)
    wound = np.array([55.0e-6, 30.8e-6, 26.9e-6])
    np.testing.assert_allclose(state.tile_travel, -wound, rtol=1e-9)
    np.testing.assert_allclose(state.shears - ENGAGED, (1e-3 - wound) * 1e4, rtol=1e-9)
    np.testing.assert_allclose(state.tendon_travel, 0.0, atol=1e-15)


def test_the_first_tile_sticks_until_25_newtons():
    """With Section 5.2's bound on the first element: δT = μ c_p f = 0.34 · 2 · 37 N = 25.16 N."""
    finger = replace(SLIDING, entry_friction=MU)
    closed = finger.closed(CLOSING, ENGAGED)
    bound = 0.34 * 2.0 * 37.0
    # in proportion to the tensions, so that nothing slips further out
    shift = bound / K * closed.tensions / CLOSING
    below = finger.at_tension(closed, CLOSING, 0.999 * shift)
    assert below.shears[0] - ENGAGED[0] == pytest.approx(0.999 * 25.16)
    np.testing.assert_allclose(below.tendon_travel, 0.0, atol=1e-12)
    beyond = finger.at_tension(closed, CLOSING, 1.5 * shift)
    assert beyond.tensions[0] == pytest.approx(1.34 * CLOSING)
    assert beyond.tendon_travel[0] < 0.0
    # beyond it the springs alone take the motion: the tile stays behind, K_p and k in series
    assert beyond.shears[0] - ENGAGED[0] == pytest.approx(bound + 0.5 * bound * KP / (K + KP))


@pytest.mark.parametrize("mu", [0.0, 0.1, MU])
def test_more_tension_loads_the_tiles_by_the_affine_law(mu):
    """T = M (T_e + g (f − f_close)), in one step or in many."""
    finger = replace(SLIDING, friction=mu)
    losses = (1.0 - mu) ** np.arange(3)
    state = finger.closed(CLOSING, losses * ENGAGED)
    for tension in (37.5, 45.0, 90.0):
        state = finger.at_tension(state, tension)
        expected = losses * (ENGAGED + GAIN * (tension - CLOSING))
        np.testing.assert_allclose(state.shears, expected, rtol=1e-12)


def test_below_the_closing_tension_the_far_tiles_keep_their_shear():
    """The tendon sticks at a joint until t_i = (1 + μ) t_{i−1}; then that tile follows."""
    closed = SLIDING.closed(CLOSING, ENGAGED)
    start = closed.tensions
    for tension in np.linspace(CLOSING, 0.0, 30):
        second = min(start[1], 1.34 * tension)
        expected = np.array([tension, second, min(start[2], 1.34 * second)])
        state = SLIDING.at_tension(closed, tension)
        np.testing.assert_allclose(state.tensions, expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(state.shears, ENGAGED + GAIN * (expected - start), atol=1e-9)


def test_without_friction_the_tension_is_the_same_everywhere():
    """Held: one unknown, Σ (c_p δd + r δq) = 0, worked by hand for a common shift."""
    finger = replace(SLIDING, friction=0.0)
    shift, turn = np.array([1e-4, 2e-4, 3e-4]), np.array([0.01, 0.0, -0.01])
    state = finger.held(finger.closed(CLOSING, ENGAGED), shift, turn)
    wound = np.dot(finger.pulley_radii, turn)
    rise = (CP * K * shift.sum() / (K + KP) - wound) / (3.0 * CP**2 / (K + KP))
    np.testing.assert_allclose(state.tensions, CLOSING + rise)
    assert state.motor_tension == pytest.approx(CLOSING + rise)


def test_a_slack_tendon_pulls_again_only_when_its_slack_is_used_up():
    closed = SLIDING.closed(CLOSING, ENGAGED)
    loose = SLIDING.held(closed, [-0.02] * 3)
    assert loose.slack == pytest.approx(3.0 * CP * K * 0.02 / (K + KP) - CP**2 / (K + KP) * 77.5372)
    assert (loose.tensions == 0.0).all()
    looser = SLIDING.held(loose, [-0.01] * 3)
    assert looser.slack == pytest.approx(loose.slack + 3.0 * CP * K * 0.01 / (K + KP))
    almost = SLIDING.held(loose, [0.8 * loose.slack * (K + KP) / (3.0 * CP * K)] * 3)
    assert almost.slack == pytest.approx(0.2 * loose.slack)
    taut = SLIDING.held(loose, [0.02] * 3)
    assert taut.slack == 0.0
    assert taut.tensions.min() > 0.0


def test_a_held_motor_feels_only_what_the_entry_cannot_hold():
    finger = replace(SLIDING, entry_friction=MU)
    closed = finger.closed(CLOSING, ENGAGED)
    little = finger.held(closed, 1e-3 * closed.tensions / CLOSING)
    assert little.motor_tension == CLOSING
    assert little.tensions[0] == pytest.approx(CLOSING + K * 1e-3 / CP)
    much = finger.held(closed, [4e-3] * 3)
    assert much.motor_tension == pytest.approx(much.tensions[0] / 1.34)


history = st.lists(
    st.tuples(
        st.one_of(st.none(), st.floats(0.0, 300.0)),
        st.lists(st.floats(-5e-3, 5e-3), min_size=4, max_size=4),
        st.lists(st.floats(-0.3, 0.3), min_size=4, max_size=4),
    ),
    min_size=1,
    max_size=5,
)


@settings(max_examples=150)
@given(st.integers(0, 10**6), history)
def test_friction_takes_energy_and_tendons_only_pull(seed, steps):
    """The work put in is at least what the springs and contacts store.

    From T = c_p t − K_p d + const and the tendon's length, T δx − t r δq + f v_1 is the change of
    the stored T²/2k + K_p d²/2 − const d, plus what the boundaries dissipate.
    """
    rng = np.random.default_rng(seed)
    finger = random_finger(rng)
    n, k = len(finger.pulley_radii), np.array(finger.contact_stiffness)
    kp, r = finger.spring_stiffness, np.array(finger.pulley_radii)
    grips = k > 0.0
    state = finger.closed(rng.uniform(0.0, 200.0), np.where(grips, rng.uniform(0.0, 20.0, n), 0.0))
    offset = state.shears - finger.pulley_ratio * state.tensions
    mu = np.full(n, finger.friction)

    def stored(s):
        contact = s.shears[grips] ** 2 / (2.0 * k[grips])
        return contact.sum() + (kp * s.tile_travel**2 / 2.0 - offset * s.tile_travel).sum()

    for tension, shift, turn in steps:
        shift, turn = np.array(shift[:n]), np.array(turn[:n])
        held = tension is None
        after = (
            finger.held(state, shift, turn)
            if held
            else finger.at_tension(state, tension, shift, turn)
        )
        assert after.tensions.min() >= 0.0
        assert after.slack >= 0.0
        assert after.motor_tension >= 0.0
        before_boundary = np.concatenate([[after.motor_tension], after.tensions[:-1]])
        moved = after.tendon_travel - state.tendon_travel
        lost = (before_boundary - after.tensions) * moved
        # (a slack that is taken up passes the first boundary before there is any friction)
        assert lost[1:].min(initial=0.0) >= -1e-9
        mu[0] = finger.entry_friction
        within = np.abs(after.tensions - before_boundary) <= mu * before_boundary + 1e-6
        assert within.all()
        balance = finger.pulley_ratio * after.tensions - kp * after.tile_travel + offset
        np.testing.assert_allclose(after.shears, balance, atol=1e-6)
        work = (after.shears * shift - after.tensions * r * turn).sum()
        work += after.tensions[0] * moved[0]
        assert work >= stored(after) - stored(state) - 1e-6
        state = after


@pytest.mark.parametrize("held", [True, False])
def test_a_cycle_of_load_leaves_a_loop(held):
    """Half way back, the shear is not what it was half way up; without friction it is."""

    def halves(finger):
        state, found = finger.closed(CLOSING, ENGAGED), []
        for shift in (3e-3, 3e-3, -3e-3):
            motion = np.array([0.0, 0.0, shift])
            state = (
                finger.held(state, motion) if held else finger.at_tension(state, CLOSING, motion)
            )
            found.append(state.shears[2])
        return found[0], found[2]

    up, back = halves(SLIDING)
    assert back < up - 1.0
    up, back = halves(replace(SLIDING, friction=0.0))
    assert back == pytest.approx(up)


def test_a_tile_on_the_base_comes_first_and_has_no_joint():
    finger = FingerTendon.from_table(hand_table(), base_tile=True)
    assert finger.pulley_radii == (0.0, 0.0055, 0.00308, 0.00269)
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
    finger = replace(SLIDING, contact_stiffness=(K, 0.0, K))
    state = finger.held(finger.closed(CLOSING, ENGAGED * [1, 0, 1]), [1e-3] * 3, [0.01] * 3)
    assert state.shears[1] == 0.0
    assert state.shears[2] > ENGAGED[2]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"pulley_ratio": 0.0}, "pulley_ratio"),
        ({"spring_stiffness": -1.0}, "spring_stiffness"),
        ({"contact_stiffness": (K, -1.0, K)}, "contact_stiffness"),
        ({"contact_stiffness": (K, 0.0, K), "spring_stiffness": 0.0}, "contact_stiffness"),
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
        ((-1.0,), "tension"),
        ((float("inf"),), "tension"),
        ((10.0, [0.0, 0.0]), "shift"),
        ((10.0, [0.0, 0.0, float("nan")]), "shift"),
        ((10.0, None, [0.0] * 4), "turn"),
    ],
)
def test_impossible_changes_of_load_are_refused_by_field(arguments, field):
    state = SLIDING.closed(CLOSING, ENGAGED)
    with pytest.raises(InvalidInputError) as caught:
        SLIDING.at_tension(state, *arguments)
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
    slips = np.array([1e-4, -2e-4, 3e-4])
    for tension, shift in ((50.0, None), (37.0, slips), (60.0, slips)):
        drags = [
            tendon.at_tension(tendon.closed(CLOSING, part * ENGAGED), tension, shift).shears
            for tendon, part in ((whole, 1.0), (some, share))
        ]
        np.testing.assert_allclose(drags[1], share * drags[0], rtol=1e-12, atol=1e-12)
