"""The calibration of the gripper: its data are met, and its table says what they fix."""

import numpy as np
import pytest

from hand_models.compliance import gripper_table, search
from hand_models.experiments import clipped_vertices, extents, in_paper_signs, pulled_off_poses
from hand_models.parameters import experiment_table, hand_table
from hand_models.studies import calibrate
from hand_models.studies.calibrate import HELD, Fit

FIT = Fit(gripper_table())


def test_the_recorded_set_meets_all_fifteen_data():
    found = FIT.residuals(FIT.start())
    assert found.shape == (15,)
    worst = int(np.abs(found).argmax())
    assert np.abs(found).max() <= 1.0, FIT.labels[worst]


def test_the_recorded_extents_are_those_of_the_papers_search_too():
    data = experiment_table()
    found = extents(clipped_vertices(in_paper_signs(search(FIT.gripper(FIT.start()), 40).wrenches)))
    assert found.force_x == pytest.approx(data.scalar("fig13", "force_x"), rel=0.1)
    assert found.force_z == pytest.approx(data.scalar("fig13", "force_z"), rel=0.1)
    assert found.moment == pytest.approx(data.scalar("fig13", "moment"), rel=0.25)


def test_numbers_go_to_the_gripper_and_back():
    x = np.full(len(FIT.numbers), 0.25)
    table = FIT.gripper(x).table
    for number, value in zip(FIT.numbers, FIT.values(x), strict=True):
        assert number.current(table) == pytest.approx(value)
        low, high = number.values
        assert low < value < high


def test_every_recorded_number_is_plausible():
    start = FIT.start()
    assert (start > 0.0).all()
    assert (start < 1.0).all()


def test_a_pull_is_balanced_at_its_pose():
    gripper = FIT.gripper(FIT.start())
    pulls = np.array([0.0, 5.0, 11.0])
    wrenches = gripper.evaluate(pulled_off_poses(gripper, pulls)).wrenches
    np.testing.assert_allclose(wrenches[:, 2], -pulls, atol=1e-6)
    np.testing.assert_allclose(wrenches[:, [0, 4]], 0.0, atol=1e-6)
    # beyond what the fingers can bear, there is none
    assert len(pulled_off_poses(gripper, np.array([0.0, 1e4]))) == 1


def test_the_unloaded_normals_follow_from_joint_balance_by_hand():
    """Fig. 12's unloaded state with the hand's own numbers: Σ of moments about the last joint."""
    table = gripper_table()
    gripper = FIT.gripper(FIT.start())
    loads, _ = gripper.finger_loads(np.zeros((1, 3)))
    finger = gripper.finger.finger
    model = finger.model
    # the distal joint: f r = K q + p − T h + N c, whatever the others carry
    torque = 37.0 * model.pulley_radii[2] - model.joint_stiffness[2] * finger.joint_angles[2]
    shear = 37.0 * table.vector("tile", "engagement")[2]
    along = finger.contacts[2].along
    expected = (torque - shear * model.tile_height) / along
    assert loads.normals[0, 2] == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("excluded", [2, len(HELD)])
def test_a_short_run_tells_residuals_numbers_and_what_is_excluded(monkeypatch, excluded):
    monkeypatch.setattr(calibrate, "HELD", HELD[:excluded])
    monkeypatch.setattr(calibrate, "FITS", 1)
    monkeypatch.setattr(calibrate, "REFITS", 1)
    monkeypatch.setattr(calibrate, "RAYS", 200)
    told = []
    result = calibrate.run(lambda done, total: told.append((done, total)), hand_table())
    assert told[-1][0] == told[-1][1]
    assert {claim.role for claim in result.claims} == {"calibration"}
    assert len(result.claims) == len(result.data["residuals"]) == 15
    for number in result.data["numbers"]:
        low, high = number["plausible"]
        assert low <= number["fitted"] <= high
        assert 0.0 < number["left_unknown"] <= 1.0 + 1e-9
        assert number["fixed_by_data"] == (number["left_unknown"] <= calibrate.FIXED)
    # numbers held at the hand's own cannot do better than all of them free
    assert len(result.data["held"]) == excluded
    for held in result.data["held"]:
        assert held["worst"] > 0.0
    assert list(calibrate.plot(result)) == ["calibrate"]
