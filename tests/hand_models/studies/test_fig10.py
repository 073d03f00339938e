"""The study of the limit curve: its data are the array's, and its claims follow from them."""

import math

import numpy as np
import pytest

from hand_models import Surface
from hand_models.studies import fig10
from hand_models.tile import SpineArray, directional_strength, inner_half_planes
from tests.hand_models.studies.runs import check_written, studied

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def study():
    return studied("fig10")


def test_it_writes_its_data_and_its_pictures():
    check_written("fig10", "fig10", "fig10_tile_shear", "fig10_surface")


def claim(result, words):
    (found,) = [c for c in result.claims if words in c.claim]
    return found


def test_seventy_trials_scatter_about_the_mean_of_the_array(study):
    trials = study[0].data["trials"]
    strengths = np.array(trials["strength"])
    assert strengths.size == 70
    array = SpineArray.named("sandpaper-36")
    mean = 21.0 * array.share(np.array(trials["angle"]))
    # over all directions, the mean of 70 trials of 45 % scatter each is known to about 6 %
    held = mean > 1.0
    assert np.mean(strengths[held] / mean[held, None]) == pytest.approx(1.0, abs=0.2)


def test_the_fits_are_those_of_ordinary_regression(study):
    data = study[0].data
    angles, mean = np.array(data["array"]["angle"]), np.array(data["array"]["mean"])
    inside = (angles >= 0.0) & (angles <= math.pi / 4 + 1e-12)
    slope, start = np.polyfit(angles[inside], mean[inside], 1)
    assert data["fit_of_mean"]["shear_limit"] == pytest.approx(start)
    assert data["fit_of_mean"]["pull_off_limit"] == pytest.approx(start + slope * math.pi / 4)
    correlation = np.corrcoef(angles[inside], mean[inside])[0, 1]
    assert data["fit_of_mean"]["r_squared"] == pytest.approx(correlation**2)
    # no other line in Cartesian coordinates is nearer
    points = mean[inside, None] * np.stack([np.cos(angles[inside]), np.sin(angles[inside])], axis=1)
    line = data["cartesian_line_of_mean"]

    def squares(slope, limit):
        return np.sum((points @ [1.0, slope] - limit) ** 2) / (1.0 + slope**2)

    best = squares(line["slope"], line["shear_limit"])
    for ds, dl in ((0.01, 0.0), (-0.01, 0.0), (0.0, 0.05), (0.0, -0.05)):
        assert squares(line["slope"] + ds, line["shear_limit"] + dl) > best


def test_the_planners_line_is_inside_the_array_up_to_45_degrees_and_not_beyond(study):
    result = study[0]
    angles, mean, law, line = (
        np.array(result.data[group][key])
        for group, key in (
            ("array", "angle"),
            ("array", "mean"),
            ("planner", "law"),
            ("planner", "half_plane"),
        )
    )
    published = (angles >= 0.0) & (angles < math.pi / 4 - 1e-9)
    # of the strength in drag, which four thousand tiles tell to their scatter
    drag = mean[np.isclose(angles, 0.0)][0]
    scatter = np.array(result.data["array"]["deviation"])[np.isclose(angles, 0.0)][0]
    assert abs(drag - 19.45) <= 3.0 * scatter / math.sqrt(4000)
    assert (law[published] / 19.45 <= mean[published] / drag * 1.01).all()
    assert (line <= law * (1.0 + 1e-9)).all()
    beyond = claim(result, "beyond 45°")
    assert not beyond.holds
    assert mean[np.isclose(angles, math.pi / 3)][0] / 19.45 == pytest.approx(beyond.got, rel=0.03)


def test_claims_follow_from_the_data(study):
    result = study[0]
    cells = result.data["tile_shear"]
    assert len(cells) == 20
    off = [abs(c["simulated_mean"] - c["mean"]) / c["error"] for c in cells]
    assert max(off) < 0.6
    assert claim(result, "20, 40, 60").holds
    assert claim(result, "20, 40, 60").role == "calibration"
    assert claim(result, "5, 10").holds
    # the array scatters more than the fine concrete did
    assert not claim(result, "fine concrete").holds
    assert claim(result, "coarse concrete, over").holds
    # neither straight line is as near as five measurements could tell
    assert not claim(result, "approximately linear").holds
    assert not claim(result, "Cartesian").holds
    assert claim(result, "Coulomb").got == pytest.approx(0.3)
    assert 1.01 < claim(result, "non-convex").got < 1.2


def test_the_gap_of_each_number_of_half_planes_is_told(study):
    rows = study[0].data["bounds"]
    assert [row["half_planes"] for row in rows] == [1, 2, 4, 8]
    inner = [row["inner_volume"] for row in rows]
    outer = [row["outer_volume"] for row in rows]
    assert inner == sorted(inner)
    assert outer == sorted(outer, reverse=True)
    surface = Surface.named("sandpaper-36")
    sideways = directional_strength(inner_half_planes(surface), np.array([[0.0, 0.0, 1.0]]))[0]
    assert rows[0]["lateral_reach"] == pytest.approx(sideways / 19.45)


def test_the_hull_of_a_ball_has_no_more_volume():
    ball = Surface(10.0, 10.0, math.pi / 2, 10.0, 0.0)
    assert fig10.hull_over_surface(ball) == pytest.approx(1.0, abs=2e-3)
