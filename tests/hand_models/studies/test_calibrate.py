"""The calibration of the gripper: its data are met, by the recorded set and by every draw."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hand_models
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import GripperFit, edge, pulled_off_poses, with_mirrored
from hand_models.parameters import (
    ParameterTable,
    draws_of,
    experiment_table,
    hand_table,
)
from hand_models.studies import calibrate
from hand_models.studies.calibrate import as_draws, farthest_apart, global_search
from hand_models.studies.settings import STUDY_SETTINGS

FIT = GripperFit()
DRAWS = Path(hand_models.__file__).parent / "parameters" / "draws.toml"
LABELS = [datum.label for datum in FIT.data]


def test_the_recorded_set_meets_all_data_that_come_first_on_the_fine_hull():
    found = FIT.residuals(FIT.start(), fine=True)
    assert found.shape == (27,)
    assert sum(FIT.first) == 24
    worst = int(np.abs(np.where(FIT.first, found, 0.0)).argmax())
    assert FIT.misfit(found) <= 1.0, LABELS[worst]


def test_rays_are_a_few_per_cent_off_the_fine_hull():
    fine, coarse = (
        np.abs(FIT.wrenches(FIT.gripper(FIT.start()), fine=fine)).max(axis=0)
        for fine in (True, False)
    )
    np.testing.assert_allclose(coarse, fine, rtol=0.03)


def test_residuals_are_off_over_tolerances():
    x = FIT.start()
    model = FIT.model(x)
    settings = experiment_table()
    shears = settings.vector("fig12", "shear_unloaded")
    np.testing.assert_allclose(
        FIT.residuals(x)[:3], (model[:3] - shears) / np.maximum(0.1 * np.array(shears), 0.3)
    )
    at = LABELS.index("extent of M_y")
    assert FIT.residuals(x)[at] == pytest.approx((model[at] / 1.31 - 1.0) / 0.1)


def test_numbers_go_to_the_gripper_and_back():
    x = np.full(len(FIT.numbers), 0.25)
    table = FIT.gripper(x).table
    for number, value in zip(FIT.numbers, FIT.values(x), strict=True):
        assert number.current(table) == pytest.approx(value)
        low, high = number.values
        assert low < value < high


def test_every_recorded_number_is_plausible():
    now = np.array([number.current(gripper_table()) for number in FIT.numbers])
    assert (now >= FIT.low).all()
    assert (now <= FIT.low + FIT.width).all()


def test_a_pull_is_balanced_at_its_pose():
    gripper = FIT.gripper(FIT.start())
    pulls = np.array([0.0, 5.0, 11.0])
    wrenches = gripper.evaluate(pulled_off_poses(gripper, pulls)).wrenches
    np.testing.assert_allclose(wrenches[:, 2], -pulls, atol=1e-6)
    np.testing.assert_allclose(wrenches[:, [0, 4]], 0.0, atol=1e-6)
    # beyond what the fingers can bear, there is none
    assert len(pulled_off_poses(gripper, np.array([0.0, 1e4]))) == 1


def test_the_unloaded_normals_follow_from_joint_balance_by_hand():
    """Fig. 12's unloaded state with the gripper's numbers: Σ of moments about the last joint."""
    table = gripper_table()
    gripper = FIT.gripper(FIT.start())
    loads, _ = gripper.finger_loads(np.zeros((1, 3)))
    finger = gripper.finger
    model = finger.model
    # the distal joint: f r = K q + p − T h + N c, whatever the others carry
    torque = 37.0 * model.pulley_radii[2] - model.joint_stiffness[2] * finger.joint_angles[2]
    shear = 37.0 * table.vector("tile", "engagement")[2]
    along = finger.contacts[2].along
    expected = (torque - shear * model.tile_height) / along
    assert loads.normals[0, 2] == pytest.approx(expected, rel=1e-9)


def test_no_wrench_that_counts_as_held_presses_more_than_the_surface_shows():
    gripper = FIT.gripper(FIT.start())
    held = FIT.wrenches(gripper, fine=True)
    assert held[:, 1].max() <= experiment_table().scalar("fig13", "top") + 1e-9
    free = Gripper(0.3, 37.0, table=gripper.table)
    assert free.most_pressing == np.inf
    np.testing.assert_allclose(with_mirrored(held)[: len(held)], held)


def test_the_edge_of_a_square_turned_by_an_eighth():
    corners = np.array([(-2.0, 0.0), (0.0, 1.0), (2.0, 0.0), (0.0, -1.0), (0.1, 0.2)])
    got = edge(corners, np.array([-1.0, 0.0, 0.5, 2.0, 2.1]))
    np.testing.assert_allclose(got, [0.5, 1.0, 0.75, 0.0, np.nan], atol=1e-12)


def test_sets_farthest_apart_begin_with_the_ends():
    sets = np.array([[0.0], [0.1], [1.0], [0.6]])
    assert farthest_apart(sets, 3) == [0, 2, 3]
    assert sorted(farthest_apart(sets, 9)) == [0, 1, 2, 3]


@pytest.mark.slow
def test_a_search_goes_down_and_keeps_what_meets_the_data():
    told = []
    met = global_search(FIT, FIT.start(), 0.02, 16, 1, lambda: told.append(1))
    assert len(told) >= 16
    assert FIT.misfit(FIT.residuals(met.best)) <= FIT.misfit(FIT.residuals(FIT.start())) + 0.05
    assert all(FIT.misfit(FIT.residuals(x)) <= 1.0 for x in met.sets[:3])
    # the same seed is the same search
    again = global_search(FIT, FIT.start(), 0.02, 16, 1, lambda: None)
    np.testing.assert_array_equal(again.best, met.best)
    i = FIT.names.index("friction")
    held = global_search(FIT, FIT.start(), 0.02, 16, 1, lambda: None, held={i: 0.3})
    assert held.best[i] == 0.3


@pytest.mark.slow
def test_a_short_run_tells_residuals_numbers_sets_and_variants(monkeypatch):
    effort = replace(
        STUDY_SETTINGS,
        calibrate_starts=2,
        calibrate_evaluations=64,
        calibrate_refits=16,
        calibrate_sets=4,
    )
    monkeypatch.setattr(calibrate, "STUDY_SETTINGS", effort)
    told = []
    result = calibrate.run(lambda done, total: told.append((done, total)), hand_table())
    assert told[-1][0] == told[-1][1]
    assert {claim.role for claim in result.claims} == {"calibration"}
    assert len(result.claims) == 24
    assert len(result.data["residuals"]) == 27
    assert result.data["misfit"] <= 1.0
    for number in result.data["numbers"]:
        low, high = number["plausible"]
        least, most = number["of_sets"]
        assert low - 1e-12 <= least <= most <= high + 1e-12
    assert [each["variant"] for each in result.data["variants"]] == [
        words for words, _, _ in calibrate.SEARCH_VARIANTS
    ]
    assert list(calibrate.plot(result)) == ["calibrate"]
    # what it prints is what draws.toml has
    data = json.loads(json.dumps(result.data, default=lambda array: array.tolist()))
    data["sets"] = data["sets"] * 30
    text = as_draws(data) + "\n[ranges]\n" + bundled_ranges()
    drawn = draws_of(ParameterTable.read(text, "draws.toml"))
    assert len(drawn) == len(data["sets"])


def bundled_ranges() -> str:
    lines = DRAWS.read_text(encoding="utf-8")
    return lines.split("\n[ranges]\n")[1]
