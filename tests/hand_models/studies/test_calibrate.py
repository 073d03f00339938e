"""The calibration of the gripper: data, likelihood, posterior, and the samples that are kept."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hand_models
from hand_models.base import InvalidInputError
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import (
    FITTED_FIGURES,
    GripperFit,
    Posterior,
    PosteriorSettings,
    Sampled,
    edge,
    pull,
    pulled_off_poses,
    reach_toward,
    with_mirrored,
)
from hand_models.parameters import (
    OF_GRIPPER,
    ParameterTable,
    bundled_draws,
    draw_table,
    draws_of,
    experiment_table,
    hand_table,
)
from hand_models.studies import calibrate
from hand_models.studies.calibrate import as_draws
from hand_models.studies.settings import STUDY_SETTINGS

FIT = GripperFit()
DRAWS = Path(hand_models.__file__).parent / "parameters" / "draws.toml"
LABELS = [datum.label for datum in FIT.data]
ALL = np.ones(len(FIT.data), dtype=bool)


def test_data_are_those_of_three_figures():
    assert [sum(FIT.figures == figure) for figure in FITTED_FIGURES] == [12, 12, 2]
    settings = experiment_table()
    shears = settings.vector("fig12", "shear_unloaded")
    np.testing.assert_allclose(FIT.wanted[:3], shears)
    np.testing.assert_allclose(FIT.wanted[-2:], [1 / 90, 1 / 20])
    # 0.17 N of reading and a tenth of 6.95 N
    wide = FIT.deviations(0.1)
    assert wide[LABELS.index("middle shear, unloaded")] == pytest.approx(np.hypot(0.17, 0.695))
    # of 1 N as of 2 N
    assert wide[LABELS.index("middle normal, unloaded")] == pytest.approx(np.hypot(0.17, 0.2))


def test_reaches_are_straight_pulls_over_the_figures():
    gripper, x = FIT.gripper(FIT.start()), FIT.start()
    model = dict(zip(LABELS, FIT.model(x), strict=True))
    off = pull(gripper, np.array([(0.0, -1.0, 0.0)])).wrenches[0]
    assert model["extent of F_z"] == pytest.approx(off[1] / -17.5)
    held = FIT.pulled(gripper)
    assert model["extent of F_x"] == pytest.approx(np.abs(held[:, 0]).max() / 49.7)
    along = edge(held[:, [0, 2]], np.array([0.0]))[0]
    assert model["edge at F_x = 0 N, M_y = 0.93 N·m"] == pytest.approx(along / 0.93)
    np.testing.assert_allclose(with_mirrored(held)[: len(held)], held)
    assert held[:, 1].max() <= experiment_table().scalar("fig13", "top") + 1e-9


def test_a_place_is_reached_as_far_as_the_edge_is():
    square = np.array([(-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0), (0.3, 0.2)])
    places = np.array([(1.0, 0.0), (0.0, 4.0), (1.0, 1.0), (2.0, 1.0), (-4.0, 1.0)])
    np.testing.assert_allclose(reach_toward(square, places), [2.0, 0.25, 1.0, 1.0, 0.5])


def test_numbers_go_to_the_gripper_and_back():
    x = np.full(len(FIT.numbers), 0.25)
    table = FIT.gripper(x).table
    for number, value in zip(FIT.numbers, FIT.values(x), strict=True):
        assert number.current(table) == pytest.approx(value)
        low, high = number.values
        assert low < value < high


def test_every_recorded_number_is_plausible_and_not_on_a_bound():
    now = np.array([number.current(gripper_table()) for number in FIT.numbers])
    assert (now > FIT.low).all()
    assert (now < FIT.low + FIT.width).all()


def test_a_set_without_a_gripper_has_no_values():
    table = gripper_table()
    # so high that no phalanx lies on the rock
    far = np.array([number.current(table) for number in FIT.numbers])
    x = (far - FIT.low) / FIT.width
    x[FIT.names.index("seated_contact")] = 60.0
    found = FIT.models(np.array([FIT.start(), x]))
    np.testing.assert_array_equal(np.isfinite(found).all(axis=1), [True, False])
    np.testing.assert_array_equal(found[0], FIT.model(FIT.start()))


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


def test_where_nothing_was_said_a_gripper_may_press_as_it_likes():
    assert Gripper(0.3, 37.0, table=gripper_table()).most_pressing == np.inf


class LinearFit:
    """Two data of each of two figures, linear in three parameters: a posterior in closed form."""

    def __init__(self):
        self.numbers, self.figures = range(3), np.array(["fig12", "fig12", "fig13", "fig13"])
        self.slopes = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.3], [0.4, 0.0, 1.0], [1.0, 1.0, 1.0]])
        self.data, self.wanted = range(4), self.slopes @ [0.5, 0.45, 0.55] + [0.0, 0.02, 0.0, -0.02]
        self.reading, self.size = np.full(4, 0.02), np.ones(4)

    def start(self):
        return np.full(3, 0.5)

    def models(self, sets):
        return sets @ self.slopes.T

    def deviations(self, discrepancy):
        return np.hypot(self.reading, discrepancy)


def test_of_a_linear_model_the_posterior_is_that_of_least_squares(monkeypatch):
    fit = LinearFit()
    effort = PosteriorSettings(first_sets=60, wave_sets=40, last_sets=800, walkers=60, steps=500)
    search = Posterior(fit, effort)
    monkeypatch.setattr(search, "_left_out", lambda found: 0.03)
    told = []
    found = search.run(lambda: told.append(1))[""]
    assert len(told) == search.evaluations
    wide = np.hypot(0.02, 0.03)
    covariance = np.linalg.inv(fit.slopes.T @ fit.slopes) * wide**2
    mean = covariance @ fit.slopes.T @ fit.wanted / wide**2
    np.testing.assert_allclose(found.weights @ found.sets, mean, atol=4e-3)
    spread = np.sqrt(found.weights @ (found.sets - found.weights @ found.sets) ** 2)
    np.testing.assert_allclose(spread, np.sqrt(np.diag(covariance)), rtol=0.12)
    # an emulator that is exact leaves even weights
    assert found.effective > 0.9 * len(found.weights)


def test_a_posterior_found_again_is_the_same():
    effort = PosteriorSettings(first_sets=40, wave_sets=20, last_sets=60, walkers=20, steps=60)
    one, other = (Posterior(LinearFit(), effort).run(lambda: None)[""] for _ in range(2))
    np.testing.assert_array_equal(one.sets, other.sets)


def test_the_discrepancy_is_what_data_that_were_left_out_are_off_by():
    fit = LinearFit()
    search = Posterior(fit)
    values = fit.wanted + np.array([[0.1, -0.1, 0.3, 0.3], [0.1, -0.1, 0.3, 0.3]])
    found = search._left_out(
        [(ALL[:4], values), (fit.figures != "fig12", values), (fit.figures != "fig13", values)]
    )
    assert found == pytest.approx(np.sqrt((0.01 + 0.09) / 2.0 - 0.02**2))


def test_quantiles_are_of_samples_and_of_what_the_model_leaves():
    even = Sampled(np.zeros((2, 1)), np.array([[1.0, 5.0], [1.0, 7.0]]), np.array([0.5, 0.5]))
    low, middle, high = even.quantiles(np.array([0.1, 1e-9]))
    np.testing.assert_allclose([low[0], middle[0], high[0]], [0.8355, 1.0, 1.1645], atol=6e-3)
    assert (low[1], high[1]) == pytest.approx((5.0, 7.0))
    uneven = replace(even, weights=np.array([0.96, 0.04]))
    assert uneven.quantiles(np.array([0.1, 1e-9]))[2, 1] == pytest.approx(5.0)
    assert uneven.effective == pytest.approx(1.0 / (0.96**2 + 0.04**2))
    assert even.chosen(2) == [0, 1]
    assert uneven.chosen(1) == [0]
    # one that is picked twice is taken once
    assert uneven.chosen(2) == [0, 1]
    with pytest.raises(InvalidInputError, match="at least 3 samples are needed, got 2"):
        uneven.chosen(3)


def misfits(values):
    """Of each set, as `draws.toml` records it."""
    told = draw_table().scalar("ranges", "discrepancy")
    return np.sqrt((((values - FIT.wanted) / FIT.deviations(told)) ** 2).mean(axis=1))


def test_bundled_samples_miss_the_figures_by_as_much_as_is_recorded():
    some = range(0, len(bundled_draws()), 10)
    misfit = misfits(FIT.models(np.array([shares(k) for k in some])))
    np.testing.assert_allclose(draw_table().vector("fit", "misfit")[::10], misfit, rtol=0.05)


@pytest.mark.slow
def test_bundled_samples_foretell_the_figures_that_they_were_fitted_to():
    """Straight pulls of the thirty grippers, with what the model is wrong by, about each figure."""
    sets, draws = draw_table(), bundled_draws()
    told = sets.scalar("ranges", "discrepancy")
    values = FIT.models(np.array([shares(k) for k in range(len(draws))]))
    assert np.isfinite(values).all()
    drawn = Sampled(values, values, np.full(len(values), 1.0 / len(values)))
    low, _, high = drawn.quantiles(FIT.deviations(told))
    assert np.mean((low <= FIT.wanted) & (FIT.wanted <= high)) >= 0.8
    np.testing.assert_allclose(sets.vector("fit", "misfit"), misfits(values), rtol=0.05)


def shares(k: int) -> np.ndarray:
    """A bundled set as shares of plausible ranges."""
    sets = draw_table()
    angle = np.pi / 4
    ratio = sets.vector("defaults", "pull_off_ratio")[k]
    found = {
        "pull_off_slope": (1.0 / ratio - np.cos(angle)) / np.sin(angle),
        "friction": sets.vector("defaults", "friction")[k],
        "shear_limit": sets.vector("sandpaper-36", "shear_limit")[k],
        **{name: sets.vector("gripper", name)[k] for name in OF_GRIPPER},
    }
    for section in ("finger", "tile"):
        found |= {name: sets.vector(section, name)[k] for name in sets.sections[section]}
    return (np.array([found[name] for name in FIT.names]) - FIT.low) / FIT.width


@pytest.mark.slow
def test_a_short_run_tells_intervals_numbers_and_sets(monkeypatch):
    few = PosteriorSettings(first_sets=120, wave_sets=8, last_sets=30, walkers=40, steps=60)
    monkeypatch.setattr(calibrate, "POSTERIOR_SETTINGS", few)
    monkeypatch.setattr(calibrate, "STUDY_SETTINGS", replace(STUDY_SETTINGS, calibrate_sets=4))
    told = []
    result = calibrate.run(lambda done, total: told.append((done, total)), hand_table())
    assert told[-1][0] == told[-1][1]
    assert [claim.role for claim in result.claims] == ["test"] * 3
    assert len(result.data["residuals"]) == 26
    for row in result.data["residuals"]:
        low, middle, high = row["foretold"]
        assert low <= middle <= high
        assert row["inside"] == (low <= row["wanted"] <= high)
    for number in result.data["numbers"]:
        low, high = number["plausible"]
        least, most = number["of_sets"]
        assert low - 1e-12 <= least <= most <= high + 1e-12
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
