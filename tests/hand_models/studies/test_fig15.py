"""Figs. 15 and 16: what must hold of them however the gripper is calibrated."""

import numpy as np
import pytest

from hand_models.compliance import gripper_table
from hand_models.experiments import Conditions, radius_axes, rest_state
from hand_models.parameters import experiment_table
from tests.hand_models.studies.runs import check_written, studied

pytestmark = pytest.mark.slow

PROXIMAL, DISTAL = 0, 2


@pytest.fixture(scope="module")
def tensions():
    return studied("fig15")


@pytest.fixture(scope="module")
def radii():
    return studied("fig16")


@pytest.mark.parametrize(
    ("name", "pictures"), [("fig15", ["fig15"]), ("fig16", ["fig16", "fig16_lower_tension"])]
)
def test_they_write_their_data_and_pictures_and_nothing_was_fitted(name, pictures):
    check_written(name, *pictures)
    assert {claim.role for claim in studied(name)[0].claims} == {"test"}


def test_curves_are_of_the_printed_surfaces(tensions):
    data = tensions[0].data
    assert [curve["diameter"] for curve in data["curves"]] == [0.3, 0.7]
    assert data["surface"] == "concrete-fine"
    assert data["force_to_moment"] == 50.0
    for curve in data["curves"]:
        for key in ("state", "shear", "pure_shear", "normal", "volume", "pressed_share"):
            assert len(curve[key]) == len(data["tension"]) == 3


def test_pure_shear_is_never_above_the_shear_limit(tensions):
    for curve in tensions[0].data["curves"]:
        for shear, pure in zip(curve["shear"], curve["pure_shear"], strict=True):
            if shear is not None and pure is not None:
                assert pure <= shear * (1.0 + 1e-6)


def test_closing_alone_fails_from_the_tension_told(tensions):
    table = gripper_table()
    found = 0
    for curve in tensions[0].data["curves"]:
        fails = curve["closing_alone_fails_at"]
        if fails is None:
            assert curve["state"][-1] == "holds"
            continue
        found += 1
        for tension, holds in ((fails - 0.2, True), (fails + 0.2, False)):
            grasp = Conditions(curve["diameter"], tension).gripper(table)
            assert bool(grasp.evaluate(np.zeros((1, 3))).holds[0]) is holds
    assert found


def test_states_of_the_curves_are_those_of_the_grippers(tensions):
    data, table = tensions[0].data, gripper_table()
    for curve in data["curves"]:
        for tension, state in zip(data["tension"], curve["state"], strict=True):
            grasp = Conditions(curve["diameter"], tension).gripper(table)
            assert rest_state(grasp) == state


def test_maps_have_limits_just_where_the_gripper_holds(radii):
    data, table = radii[0].data, gripper_table()
    x, y = radius_axes(table, 3)
    for name, diameter in (("A", 0.3), ("B", 0.7)):
        found = data["maps"][name]
        assert found["conditions"] == {
            "diameter": diameter,
            "tension": 46.0,
            "surface": "concrete-fine",
        }
        assert found["x"]["current"] == table.vector("finger", "pulley_radii")[1]
        assert found["y"]["current"] == table.vector("finger", "pulley_radii")[2]
        states = [state for row in found["state"] for state in row]
        for measure in ("shear", "normal"):
            limits = [value for row in found["limits"][measure] for value in row]
            assert [value is not None for value in limits] == [s == "holds" for s in states]
            assert all(value > 0.0 for value in limits if value is not None)
        assert found["failing"] == np.mean([state != "holds" for state in states])
        # rows are of distal radii, columns of middle ones
        own = y.set(x.set(table, x.values[0]), y.values[-1])
        grasp = Conditions(diameter, 46.0).gripper(own)
        assert found["state"][-1][0] == rest_state(grasp)


def test_claims_of_the_distal_radius_are_those_of_the_maps(radii):
    result = radii[0]
    for name, claims in (("A", result.claims[0:2]), ("B", result.claims[2:4])):
        found = result.data["maps"][name]
        fails = np.array([[state != "holds" for state in row] for row in found["state"]])
        above = np.tri(3, k=-1, dtype=bool)  # the distal radius, by rows, over the middle one
        assert claims[0].holds == (fails[above].mean() > fails[~above].mean())
        assert claims[1].holds == fails[above].all()


def test_the_lower_tension_is_lower(radii):
    table = experiment_table()
    assert table.scalar("fig16", "lower_tension") < table.scalar("fig16", "tension")
    data = radii[0].data
    for found in data["maps_at_lower_tension"].values():
        assert found["conditions"]["tension"] == table.scalar("fig16", "lower_tension")
        assert len(found["state"]) == 2
    # the claims' shares are of as many radii as at the printed tension
    claims = [claim for claim in radii[0].claims if "failure regions" in claim.claim]
    for name, claim in zip(("A", "B"), claims, strict=True):
        high, low = data["maps"][name], data["states_at_lower_tension"][name]
        assert high["x"]["values"] == low["x"]["values"]
        assert claim.holds == (low["failing"] < high["failing"])


def test_a_pulley_changes_the_normal_forces_of_its_own_and_earlier_phalanges_only(radii):
    """Each joint's balance has the forces beyond it: ∂N₃/∂r₃ = f₃/c₃, and none after the joint."""
    slopes = np.array(radii[0].data["normal_slopes"])
    assert np.abs(np.tril(slopes, k=-1)).max() <= 1e-6 * np.abs(slopes).max()
    assert (np.diag(slopes) > 0.0).all()
    grasp = Conditions.of_fig16()[0].gripper(gripper_table())
    loads = grasp.finger_loads(np.zeros((1, 3)))[0]
    # on a circle contacts lie alternately: the last as far from its joint as the first from its own
    arm = gripper_table().scalar("finger", "seated_contact")
    assert slopes[DISTAL, DISTAL] == pytest.approx(loads.tensions[0, -1] / arm)
    assert slopes[PROXIMAL, PROXIMAL] == pytest.approx(loads.tensions[0, 0] / arm)
