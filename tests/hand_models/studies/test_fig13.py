"""The study of the wrench space on 300 mm: its hull is one, cut and symmetric as it must be."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

from hand_models.compliance import Gripper, boundary, search_box
from hand_models.experiments import PLANAR_SCALE, in_paper_signs
from tests.hand_models.studies.runs import check_written, studied

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def study():
    return studied("fig13")


def test_it_writes_its_data_and_its_pictures():
    check_written("fig13", "fig13")


def test_the_extents_are_calibration_and_the_rest_is_not(study):
    claims = study[0].claims
    assert [c.role for c in claims] == ["calibration"] * 5 + ["test"] * 2
    assert any("10 %" in words for words in study[0].data["not_tested"])


def test_the_hull_shown_is_convex_cut_and_as_large_as_told(study):
    data = study[0].data
    shown = np.array(data["hull_vertices"])
    assert len(ConvexHull(shown * PLANAR_SCALE).vertices) == len(shown)
    assert shown[:, 1].max() <= 1e-9
    assert data["extents"] == {
        "force_x": np.abs(shown[:, 0]).max(),
        "force_z": shown[:, 1].min(),
        "moment": np.abs(shown[:, 2]).max(),
    }
    # inside of the cut and of the whole hull alike, for wrenches that pull off
    full = np.array(data["full_hull_vertices"])
    part, whole = Delaunay(shown * PLANAR_SCALE), Delaunay(full * PLANAR_SCALE)
    low, high = 1.2 * shown.min(axis=0), 1.2 * shown.max(axis=0)
    wrenches = np.random.default_rng(0).uniform(low, high, (2000, 3))
    wrenches = wrenches[wrenches[:, 1] < 0.0]
    held = whole.find_simplex(wrenches * PLANAR_SCALE) >= 0
    np.testing.assert_array_equal(part.find_simplex(wrenches * PLANAR_SCALE) >= 0, held)
    assert 0 < held.sum() < len(held)


def test_it_is_skew_symmetric(study):
    """Two equal fingers: mirrored poses load them the other way round."""
    assert study[0].data["asymmetry"] < 1e-9
    full = np.array(study[0].data["full_hull_vertices"])
    mirrored = full * (-1.0, 1.0, -1.0)
    distance = np.linalg.norm((full[:, None] - mirrored) * PLANAR_SCALE, axis=2).min(axis=1)
    assert distance.max() < 1e-6


def test_the_moment_has_the_papers_sign(study):
    """Minus the contract's, which the gripper gives: found again by another search."""
    data = study[0].data
    gripper = Gripper(data["diameter"], data["tension"])
    rays = boundary(gripper, search_box(gripper), 500)
    full = Delaunay(1.05 * np.array(data["full_hull_vertices"]) * PLANAR_SCALE)
    paper, ours = in_paper_signs(rays.wrenches), rays.wrenches[:, [0, 2, 4]]
    assert (full.find_simplex(paper * PLANAR_SCALE) >= 0).mean() > 0.95
    assert (full.find_simplex(ours * PLANAR_SCALE) >= 0).mean() < 0.95


def test_straight_pulls_end_inside_the_hull(study):
    data = study[0].data
    full = Delaunay(1.02 * np.array(data["full_hull_vertices"]) * PLANAR_SCALE)
    wrenches = np.array(data["pulls"]["wrenches"])
    assert (full.find_simplex(wrenches * PLANAR_SCALE) >= 0).all()
    assert data["pulls"]["hull_over_pull"]["mean"] >= 1.0


def test_the_map_of_pull_off_is_the_hulls_underside(study):
    field = study[0].data["pull_off"]
    values = np.array(field["force_z"], dtype=float)
    assert np.nanmin(values) >= study[0].data["extents"]["force_z"] - 1e-9
    # a convex function: below the mean of its neighbours along both axes
    for v in (values, values.T):
        bend = v[2:] - 2.0 * v[1:-1] + v[:-2]
        assert np.nanmin(bend) >= -1e-9
    best = study[0].data["positive_moment"]
    x, _ = np.meshgrid(field["force_x"], field["moment"])
    for force, strength in zip(best["force_x"], best["strength"], strict=True):
        there = -values[np.isclose(x, force)]
        assert np.nanmax(there, initial=-np.inf) <= strength + 1e-9


def test_the_linearised_sets_error_is_that_of_its_extents(study):
    data = study[0].data
    for name in ("at_rest", "unloaded"):
        found = data["linearised"][name]
        ratio = found["extents"]["force_z"] / data["extents"]["force_z"] - 1.0
        worst = max(abs(found["error_pulling"]["least"]), abs(found["error_pulling"]["most"]))
        assert abs(ratio) <= worst + 0.02
        assert found["error"]["least"] <= found["error_pulling"]["least"]
        assert found["mean_size_of_error"] >= abs(found["error"]["mean"])
