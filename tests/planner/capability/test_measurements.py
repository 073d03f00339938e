"""Which measurement narrows load factors: weights by hand, what is measured, and a whole run."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from hand_models.parameters import bundled_draws, experiment_table, hand_table, own_draw
from hand_models.studies import run_study
from planner.capability import MeasurementStudy, measured, measurements, widths
from service.commands.cli import run_command_line
from service.commands.studies import STUDY_NAMES
from tests.suite.helpers.commands import BAD_INPUT, complaint, result
from tests.suite.helpers.stances import ask, on_wall

RNG = np.random.default_rng(5)
FACTORS = RNG.normal(1.3, 0.2, 30)


def width_by_hand(values: np.ndarray, factors: np.ndarray, accuracy: float) -> float:
    """The mean of weighted widths, one truth and one draw after the other."""
    found = []
    for truth in values:
        away = [math.dist(value, truth) / accuracy for value in values]
        weights = [math.exp(-0.5 * each**2) for each in away]
        ends = np.quantile(factors, [0.05, 0.95], weights=weights, method="inverted_cdf")
        found.append(ends[1] - ends[0])
    low, high = np.quantile(factors, [0.05, 0.95], method="inverted_cdf")
    return float(np.mean(found)) / (high - low)


@pytest.mark.parametrize("size", [1, 3])
@pytest.mark.parametrize("accuracy", [0.1, 0.5, 3.0])
def test_a_width_is_the_mean_over_all_truths(size, accuracy):
    values = RNG.normal(size=(30, size))
    width, chance = widths(values, FACTORS, accuracy)
    assert width == pytest.approx(width_by_hand(values, FACTORS, accuracy))
    by_chance = [width_by_hand(np.roll(values, k, axis=0), FACTORS, accuracy) for k in range(1, 30)]
    assert chance == pytest.approx(np.mean(by_chance))


def test_what_tells_nothing_leaves_all_and_what_tells_all_leaves_little():
    assert widths(np.ones((30, 1)), FACTORS, 1.0) == pytest.approx((1.0, 1.0))
    assert widths(RNG.normal(size=(30, 2)), FACTORS, 1e6)[0] == pytest.approx(1.0)
    told, chance = widths(FACTORS[:, None], FACTORS, 0.02)
    assert told < 0.2 < 0.3 < chance
    related, by_chance = widths(RNG.normal(size=(30, 1)), FACTORS, 0.3)
    assert related == pytest.approx(by_chance, abs=0.12)


def test_the_order_of_draws_does_not_matter():
    values, order = RNG.normal(size=(30, 1)), RNG.permutation(30)
    once, again = widths(values, FACTORS, 0.4), widths(values[order], FACTORS[order], 0.4)
    assert again[0] == pytest.approx(once[0])


def test_what_is_measured_is_what_the_draw_says():
    draw = bundled_draws()[4]
    found = measured(draw, hand_table())
    assert set(found) == set(experiment_table().sections["measurements"])
    assert found["tile_on_rock"] == draw.surfaces.scalar("rock", "shear_limit")
    tile = draw.surfaces.scalar("sandpaper-36", "shear_limit")
    assert found["tile_on_sandpaper"] == pytest.approx(tile)
    ratio = draw.surfaces.scalar("defaults", "pull_off_ratio")
    assert found["tile_at_45"] == pytest.approx(ratio * tile)
    np.testing.assert_allclose(
        found["engagement"], 37.0 * np.array(draw.hand.vector("tile", "engagement"))
    )
    np.testing.assert_array_equal(
        found["contact_stiffness"], draw.hand.vector("tile", "contact_stiffness")
    )
    assert found["distal_radius"] == draw.hand.vector("finger", "pulley_radii")[2]
    # along the rock three tiles of a finger drag, and it holds more than straight off
    factor = draw.discrepancy[0] * draw.discrepancy[-1]
    assert tile < found["pull_0"] / factor < 6.0 * tile
    # a gripper that is wrong by nothing is that of the set
    plain = measured(draw._replace(discrepancy=(1.0, 1.0)), hand_table())
    for angle in (0, 45, 90):
        assert found[f"pull_{angle}"] == pytest.approx(factor * plain[f"pull_{angle}"])
    other = measured(draw._replace(gripper=None), hand_table())
    assert other["pull_90"] != found["pull_90"]
    assert other["middle_radius"] == found["middle_radius"]
    assert 0.0 < found["pull_90"] < found["pull_0"]
    assert found["normal_forces"].shape == (3,)


def test_the_rigs_seat_is_its_own_and_a_gripper_that_holds_nothing_pulls_nothing():
    entry = {"unit": "m", "source": "assumed"}
    usual, moved = (
        measured(own_draw({"hand": {"finger": {"seated_contact": entry | {"value": c}}}}), hand)
        for c, hand in ((0.0247, hand_table()), (0.022, hand_table()))
    )
    assert moved["seated_contact"] != usual["seated_contact"]
    assert moved["pull_90"] == usual["pull_90"]
    weak = {"sandpaper-36": {"shear_limit": {"value": 5.0, "unit": "N", "source": "assumed"}}}
    assert measured(own_draw({"surfaces": weak}), hand_table())["pull_0"] == 0.0


@pytest.mark.parametrize("pulled", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_run_ranks_all_measurements(pulled, tmp_path, monkeypatch, request):
    steps, few = [], bundled_draws()
    if not pulled:
        # what a gripper shows takes longest, and has a test of its own
        pulls = {f"pull_{angle}": np.zeros(1) for angle in (0, 45, 90)}
        still = pulls | {"normal_forces": np.zeros(3)}
        monkeypatch.setattr(measurements, "_on_gripper", lambda *given: still)
        few = tuple(bundled_draws()[::3])
        monkeypatch.setattr(measurements, "bundled_draws", lambda _: few)
        request.getfixturevalue("few_draws")
    study = MeasurementStudy({"wall": ask(on_wall()), "held": ask(on_wall(off=0.2))})
    found, files = run_study(study, tmp_path, lambda done, total: steps.append((done, total)))
    assert [path.name for path in files] == ["result.json", "measure.png"]
    data = json.loads(files[0].read_text("utf-8"))["data"]
    assert found.claims == ()
    told = data["measurements"]
    assert sorted(each["name"] for each in told) == sorted(
        experiment_table().sections["measurements"]
    )
    gains = [each["width"] - each["chance"] for each in told]
    assert gains == sorted(gains)
    assert not pulled or told[0]["name"] == "tile_on_rock"
    (on_rock,) = [each for each in told if each["name"] == "tile_on_rock"]
    assert data["stances"] == ["wall", "held"]
    factors = np.array(data["load_factors"]["wall"])
    rock = [draw.surfaces.scalar("rock", "shear_limit") for draw in few]
    values = np.array(rock)[:, None]
    assert on_rock["widths"]["wall"] == pytest.approx(width_by_hand(values, factors, 5.0))
    assert steps[-1][0] == steps[-1][1] == 2 + len(few)
    assert len(data["summary"]) == 1 + len(told)


@pytest.mark.slow
def test_the_command_finds_it_beside_the_studies_of_one_hand(tmp_path, capfd):
    assert run_command_line(["study", "measure", "-o", str(tmp_path), "--json"]) == 0
    found = result(capfd)
    assert "boulders" in found["data"]["stances"]
    assert "wall-300-floating" not in found["data"]["stances"]
    assert (tmp_path / "measure.png").is_file()


def test_the_command_names_it_among_the_studies(tmp_path, capfd):
    assert "measure" in STUDY_NAMES
    assert run_command_line(["study", "measures", "-o", str(tmp_path)]) == BAD_INPUT
    told = complaint(capfd)
    assert all(name in told for name in STUDY_NAMES)
    assert (
        run_command_line(["study", "measure", "-o", str(tmp_path), "--tension", "40"]) == BAD_INPUT
    )
    assert "only the study sweep takes this option, not measure" in complaint(capfd)
