"""Where a finger comes to rest, on which phalanges, and that it can stay there (Section 5.7)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hand_models import Cylinder, Edge, Grasp, InvalidInputError, Plane, Pose, Surface
from hand_models.finger import OpenFinger, close_all, settle_finger
from hand_models.sections import Disc, FingerRock
from tests.suite.helpers.hands import HAND, PINCH, ROCK

MODEL = HAND.finger


def placed(hold, x, z, tilt=0.0, surface=ROCK, grasp=None):
    turn = np.array(
        [[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]]
    )
    return HAND.settle(hold, surface, grasp or Grasp(), Pose(np.array([x, 0.0, z]), turn))


def kinds(settled, finger=1):
    return [(contact.kind, contact.stop) for contact in settled.fingers[finger].contacts]


def test_seated_every_phalanx_is_on_the_rock():
    settled = HAND.settle(Cylinder(0.3), ROCK, PINCH)
    assert kinds(settled) == [("face", None)] * 3


def test_a_pinch_whose_palm_is_far_from_the_rock_holds_without_its_proximal_contacts():
    """Fig. 8 (b), found from the hold: bottom-up the proximal phalanx would push the middle off."""
    for stand_off in [0.02, 0.03]:
        settled = placed(Cylinder(0.3), 0.03226, stand_off, grasp=PINCH)
        for i in range(4):
            (proximal, held), middle, distal = kinds(settled, i)
            assert (proximal, held) == ("none", "balance")
            assert middle[0] in ("face", "edge")
            assert distal[0] in ("face", "edge")
        plain = settle_finger(
            MODEL,
            Disc(complex(0.03226 - 0.06615, stand_off + 0.15 + 0.0006), 0.15),
            (0.0, 0.0),
        )
        assert plain.contacts[0].angle > settled.fingers[1].contacts[0].angle


def test_a_contact_that_is_pulled_off_gives_way_on_weak_rock_and_not_on_strong():
    """Beside the proximal tile's own drag of 4.7 N, weak rock does not hold 0.8 N of pull-off."""
    for limit, pulled in ((63.0, True), (4.8, False)):
        surface = Surface.from_values({"shear_limit": limit})
        settled = placed(Cylinder(0.3), 0.03226, 0.004, surface=surface, grasp=PINCH)
        tile = np.flatnonzero(settled.finger_of == 1)[-3]
        normal = settled.loads[tile, 1] @ [1.0, 37.0]
        assert (normal < -0.5) == pulled
        assert (settled.loads[tile, 0] @ [1.0, 37.0] > 4.0) == pulled
        assert pulled or normal >= 0.0


def test_a_crimp_holds_with_its_distal_contact_alone():
    """Fig. 8 (a): a flake out in front of the fingers, which stand at their lower stops."""
    hold = Edge(0.0019812, 1.24626)
    rng = np.linspace(-1.2, 0.5, 35)
    alone = []
    for tilt in rng:
        try:
            settled = placed(hold, 0.1434, -0.0634, float(tilt), grasp=Grasp(palm=False))
        except InvalidInputError:
            continue
        # with the middle of the tile's face, so that the face's height is the shear's lever
        flat = settled.fingers[1].contacts[2].tilt == 0.0
        if [kind for kind, _ in kinds(settled)] == ["none", "none", "face"] and flat:
            alone.append(settled)
    assert alone
    for settled in alone:
        assert [stop for _, stop in kinds(settled)] == ["lower", "lower", None]
        finger = settled.fingers[1]
        # by hand: the distal joint alone gives the normal load
        contact, u = finger.contacts[2], finger.directions[2]
        tile = np.flatnonzero(settled.finger_of == 1)[-1]
        shear, normal = settled.loads[tile] @ [1.0, 37.0]
        spring = MODEL.joint_stiffness[2] * finger.joint_angles[2]
        by_hand = 37.0 * MODEL.pulley_radii[2] - spring - MODEL.tile_height * shear
        assert normal == pytest.approx(by_hand / contact.along, rel=1e-9)
        assert normal > 0.0
        assert np.hypot(*u) == pytest.approx(1.0)


def test_a_rung_is_hooked_by_the_middle_and_distal_phalanges():
    settled = placed(Cylinder(0.05), 0.125, 0.03)
    assert [kind for kind, _ in kinds(settled)] == ["none", "face", "face"]
    assert kinds(settled)[0][1] == "balance"
    loads = settled.tile_loads(np.full(4, 37.0))
    inner = np.flatnonzero(settled.finger_of == 1)
    assert (loads[inner[1:], :2] > 0.0).all()


def test_a_tile_that_only_slips_keeps_its_contact():
    """Closed with more than sandpaper holds in shear: overloaded, but on the rock."""
    weak = replace(
        Surface.named("sandpaper-36"), shear_limit=5.0, pull_off_limit=1.4, lateral_limit=4.3
    )
    settled = HAND.settle(Cylinder(0.3), weak, PINCH)
    assert kinds(settled) == [("face", None)] * 3
    finger = settled.fingers[1]
    shears = finger.shears(37.0)
    assert (shears @ [1.0, 37.0] > weak.shear_limit).any()


def test_an_open_hand_in_the_air_touches_nothing_and_stays():
    # 1.75 rad on 0.05 N·m/rad and 1.945 mm: 45 N
    settled = placed(Plane(), 0.0, 0.3, grasp=Grasp(closing_tension=46.0))
    assert not settled.touching.any()
    for i in range(4):
        assert kinds(settled, i) == [("none", "upper")] * 3
    (closed,) = close_all(MODEL, [OpenFinger(FingerRock(None), ROCK, 46.0)])
    assert (closed.torques @ [1.0, 46.0] > 0.0).all()
