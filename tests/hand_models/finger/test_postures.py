"""Postures and loads of many fingers at once: as of each finger, and as its geometry demands."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from hand_models import Cylinder, Edge, Ellipsoid, Sphere
from hand_models.finger import OpenFinger, close_all, settle_finger
from hand_models.finger.contact_states import close
from hand_models.finger.limit_postures import PATTERNS, at_limits
from hand_models.finger.posture_loads import TendonBatch, left_torque, loads
from hand_models.finger.postures import settle_fingers, swing
from hand_models.sections import section_rows
from tests.suite.helpers.fingers import random_section, torques
from tests.suite.helpers.hands import HAND, ROCK, changed_hand, random_surface

MODEL = HAND.finger
RUBBING = changed_hand("tendon", "friction", 0.2).finger
seeds = st.integers(0, 2**32 - 1)


def random_closings(rng, count):
    return [
        OpenFinger(
            random_section(rng),
            random_surface(rng),
            float(rng.uniform(15.0, 60.0)),
            bool(rng.random() < 0.5),
        )
        for _ in range(count)
    ]


def tendons_of(model, closings):
    return TendonBatch.of(
        model,
        [closing.tension for closing in closings],
        [closing.base_tile for closing in closings],
        [closing.surface for closing in closings],
    )


def assert_alike(one, other):
    """Two fingers, or none."""
    assert (one is None) == (other is None)
    if one is None:
        return
    for mine, theirs in zip(one.contacts, other.contacts, strict=True):
        assert (mine.kind, mine.stop) == (theirs.kind, theirs.stop)
        np.testing.assert_allclose(mine.angle, theirs.angle, atol=1e-9)
        np.testing.assert_allclose(mine.joint, theirs.joint, atol=1e-9)
        np.testing.assert_allclose(mine.along, theirs.along, atol=1e-8)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_many_fingers_settle_as_each_does(seed):
    rng = np.random.default_rng(seed)
    sections = [random_section(rng) for _ in range(6)]
    with np.errstate(invalid="ignore", divide="ignore"):
        fingers = settle_fingers(MODEL, section_rows(sections), len(sections))
    for i, section in enumerate(sections):
        assert_alike(fingers.finger(MODEL, i), settle_finger(MODEL, section, (0.0, 0.0)))


@settings(max_examples=100, deadline=None)
@given(seeds)
def test_their_loads_are_as_of_each_in_any_contact_state(seed):
    rng = np.random.default_rng(seed)
    closings = random_closings(rng, 2)
    of = np.repeat([0, 1], len(PATTERNS))
    rock = section_rows([closing.section for closing in closings]).take(of)
    with np.errstate(invalid="ignore", divide="ignore"):
        fingers, possible = at_limits(RUBBING, rock, np.tile(np.arange(len(PATTERNS)), 2))
        loaded = loads(RUBBING, fingers, tendons_of(RUBBING, closings).take(of))
    for i in np.flatnonzero(possible).tolist():
        closing, finger = closings[of[i]], fingers.finger(RUBBING, i)
        shears = finger.shears(closing.tension, closing.base_tile)
        normals = finger.normals(shears, closing.base_tile)
        size = max(1.0, np.abs(normals).max())
        np.testing.assert_allclose(loaded.shears[..., i], shears, atol=1e-12 * size)
        np.testing.assert_allclose(loaded.normals[..., i], normals, atol=1e-9 * size)
        stops = finger.stop_torques(shears, normals, closing.base_tile)
        np.testing.assert_allclose(loaded.torques[..., i], stops, atol=1e-10 * size)


@settings(max_examples=100, deadline=None)
@given(seeds)
def test_what_is_left_at_a_joint_that_swings_is_as_its_geometry_says(seed):
    """Loaded with what balances the joints beyond it, and with nothing on its own phalanx."""
    rng = np.random.default_rng(seed)
    closings = random_closings(rng, 3)
    of, proximal = np.array([0, 0, 1, 1, 2, 2]), 3
    held = np.array([0, 0, 0, 1, 1, 1])
    rock = section_rows([closing.section for closing in closings])
    tendons = tendons_of(MODEL, closings).take(of)
    with np.errstate(invalid="ignore", divide="ignore"):
        laid = settle_fingers(MODEL, rock, 3).take(of)
        angle = laid.angles[held, np.arange(6)] - rng.uniform(0.0, 0.3, 6)
        fingers = swing(MODEL, rock.take(of), laid, proximal, angle)
        left = left_torque(MODEL, fingers, tendons, proximal)
        normals = loads(MODEL, fingers, tendons).at(tendons.closing).normals
    for i in range(6):
        closing, finger = closings[of[i]], fingers.finger(MODEL, i)
        assert finger.contacts[held[i]].angle == angle[i]
        if held[i]:
            assert finger.contacts[0] == laid.finger(MODEL, i).contacts[0]
        shear = finger.shears(closing.tension) @ [1.0, closing.tension]
        normal = np.where(np.arange(3) > held[i], normals[:, i], 0.0)
        found = torques(finger, closing.tension, closing.base_tile, shear, normal)
        np.testing.assert_allclose(left[i], found[held[i]], atol=1e-10 * max(1.0, normal.max()))


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_fingers_close_together_as_they_do_alone(seed):
    rng = np.random.default_rng(seed)
    closings = random_closings(rng, 5)
    together = close_all(MODEL, closings)
    backward = close_all(MODEL, closings[::-1])[::-1]
    for closing, closed, other in zip(closings, together, backward, strict=True):
        alone = close(MODEL, *closing)
        for one in (closed, other):
            assert_alike(one and one.finger, alone and alone.finger)
            if alone is not None:
                size = max(1.0, np.abs(alone.normals).max())
                for mine, theirs in zip(one[1:], alone[1:], strict=True):
                    np.testing.assert_allclose(mine, theirs, atol=1e-7 * size)


def test_a_phalanx_swings_back_to_where_its_joint_balances():
    """The torque left there is what the width of the last interval may leave."""
    found = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        closings = random_closings(rng, 4)
        for closing, closed in zip(closings, close_all(MODEL, closings), strict=True):
            if closed is None:
                continue
            torque = closed.torques @ [1.0, closing.tension]
            for contact, turned in zip(closed.finger.contacts, torque, strict=True):
                if contact.stop == "balance":
                    found += 1
                    assert 0.0 <= turned < 1e-3
                    assert math.isfinite(contact.angle)
    assert found > 5


EXTREMES = [
    Cylinder(1e6),
    Cylinder(1e-6),
    Sphere(1e-5),
    Edge(1e-6, 0.01),
    Edge(1e6, 3.14),
    Ellipsoid((1e-6, 1.0, 1.0)),
    Ellipsoid((1e6, 1e-3, 1.0)),
]


@pytest.mark.filterwarnings("error")
def test_on_rock_thin_or_huge_they_still_close_together_as_alone():
    """And where a joint is right in the middle of the rock, or on its surface."""
    rng = np.random.default_rng(3)
    closings = []
    for hold in EXTREMES:
        middle = [0.0, 0.0, hold.entry([0.0, 0.0, -1.0], [0.0, 0.0, 1.0]) - 1.0 + 0.5e-6]
        for origin in ([0.0, 0.0, 0.0], middle, *(0.01 * rng.normal(size=(8, 3)))):
            axes = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
            section = hold.section(np.array(origin), axes[:, 0], axes[:, 1])
            closings.append(OpenFinger(section, ROCK, float(rng.choice([0.1, 37.0, 500.0]))))
    for closing, closed in zip(closings, close_all(MODEL, closings), strict=True):
        alone = close(MODEL, *closing)
        assert (closed is None) == (alone is None)
        if alone is not None:
            kinds = [(contact.kind, contact.stop) for contact in alone.finger.contacts]
            assert [(contact.kind, contact.stop) for contact in closed.finger.contacts] == kinds
