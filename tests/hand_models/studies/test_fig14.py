"""The study of failure modes and loading planes: shares, planes and sets as they must be."""

import numpy as np
import pytest

from hand_models.experiments import distance_along
from hand_models.studies.fig14 import loading_planes
from tests.hand_models.studies.runs import check_written, studied

pytestmark = pytest.mark.slow

BOX = np.array([[x, z, m] for x in (-40.0, 40.0) for z in (-20.0, 0.0) for m in (-1.0, 1.0)])


@pytest.fixture(scope="module")
def study():
    return studied("fig14")


def test_it_writes_its_data_and_its_pictures():
    check_written("fig14", "fig14", "fig14_planes")


def test_planes_of_the_fitted_surface_are_calibration_and_all_else_is_a_test(study):
    fitted = [c.claim for c in study[0].claims if c.role == "calibration"]
    assert len(fitted) == 3
    assert all("on 300 mm" in claim for claim in fitted)
    assert sum("best F_x : M_y" in claim for claim in fitted) == 2
    cases = [(s["diameter"], s["tension"]) for s in study[0].data["surfaces"]]
    assert cases == [(0.3, 37.0), (0.7, 37.0), (0.7, 30.0), (0.7, 40.0)]


def test_shares_count_the_directions(study):
    for surface in study[0].data["surfaces"]:
        assert sum(entry["share"] for entry in surface["shares"]) == pytest.approx(1.0)
        pulls = surface["pulls"]
        for entry in surface["shares"]:
            pairs = list(zip(pulls["phalanx"], pulls["way"], strict=True))
            counted = pairs.count((entry["phalanx"], entry["way"]))
            assert counted == round(entry["share"] * len(pairs))


def test_a_box_is_loaded_best_in_its_diagonals():
    """|F_x| to 40, −F_z to 20, M_y to ±1: the greatest force in any plane that meets the side."""
    found = loading_planes(BOX)
    assert found["best_for_force"]["force"] == pytest.approx(np.hypot(40.0, 20.0))
    assert abs(found["best_for_force"]["arm"]) == pytest.approx(1.0 / 40.0)
    # of four diagonals that are as good, those to the right
    assert found["best_for_force"]["wrench"][:2].tolist() == [40.0, -20.0]
    assert found["best_for_moment"]["moment"] == 1.0
    low, high = found["best_for_force"]["arms_as_good"]
    assert -0.0255 < low < -0.0245
    assert 0.0245 < high < 0.0255
    for arm, force, moment in zip(found["arm"], found["force"], found["moment"], strict=True):
        x = min(40.0, 1.0 / max(abs(arm), 1e-12))
        assert force == pytest.approx(np.hypot(x, 20.0))
        assert moment == pytest.approx(abs(arm) * x)


def test_no_plane_holds_more_than_the_best(study):
    for surface in study[0].data["surfaces"]:
        planes, points = surface["planes"], np.array(surface["hull_vertices"])
        for name in ("force", "moment"):
            best = planes[f"best_for_{name}"]
            assert max(planes[name]) <= best[name] + 1e-9
            assert best["arm"] * best["ratio"] == pytest.approx(1.0)
        # pure pull-off is in every plane, shear in the plane's own direction
        arms = np.array(planes["arm"])
        down = distance_along(points, np.array([[0.0, -1.0, 0.0]]))[0]
        along = distance_along(points, np.column_stack([np.ones(len(arms)), 0.0 * arms, arms]))
        assert (np.array(planes["force"]) >= np.maximum(down, along) - 1e-9).all()
