"""The study of the phalanges' forces: what must hold of its lines whatever the calibration."""

import json

import numpy as np
import pytest

from hand_models.compliance import Gripper
from hand_models.studies.fig12 import balance_matrix
from service.commands.cli import run_command_line
from tests.hand_models.studies.runs import check_written, studied


@pytest.fixture(scope="module")
def study():
    return studied("fig12")


def test_it_writes_its_data_and_its_pictures():
    check_written("fig12", "fig12")


def test_what_was_fitted_is_told_apart(study):
    roles = [c.role for c in study[0].claims]
    assert roles == ["calibration"] * 4 + ["test"] * (len(roles) - 4)
    for c in study[0].claims[:4]:
        assert "0.3 N" in c.claim
    assert study[0].data["not_tested"]


def test_both_fingers_together_pull_as_much_as_is_pulled(study):
    """Forces from shear, normal and the phalanges' directions, summed here."""
    data = study[0].data
    gripper = Gripper(data["diameter"], data["tension"])
    poses = np.column_stack([np.zeros(45), data["base"], np.zeros(45)])
    loads = gripper.finger_loads(poses)
    total = 0.0
    for side in loads:
        u = side.directions
        force_z = np.array(data["normal"]) * u[..., 0] - np.array(data["shear"]) * u[..., 1]
        total = total + force_z.sum(axis=1)
    np.testing.assert_allclose(total, -np.array(data["pull"]), atol=1e-7)


def test_equation_6_holds_along_the_lines(study):
    """A f_c = b: joint torques are those of tendon and springs, forces along phalanges shears."""
    data = study[0].data
    gripper = Gripper(data["diameter"], data["tension"])
    poses = np.column_stack([np.zeros(45), data["base"], np.zeros(45)])
    loads = gripper.finger_loads(poses)[0]
    A = balance_matrix(gripper, poses, loads)
    found = np.einsum("mij,mj->mi", A, loads.forces.reshape(-1, 6))
    np.testing.assert_allclose(found[:, 3:], -loads.shears, atol=1e-9)
    model = gripper.finger.model
    angles = np.arctan2(loads.directions[..., 1], loads.directions[..., 0])
    springs = np.diff(angles, axis=1, prepend=0.0) * model.joint_stiffness + model.joint_preload
    np.testing.assert_allclose(
        found[:, :3], loads.tensions * model.pulley_radii - springs, atol=1e-9
    )
    np.testing.assert_allclose(np.linalg.cond(A), data["condition"])


def test_the_pull_ends_at_the_limit_of_the_phalanx_named(study):
    slip = study[0].data["slip"]
    used = slip["utilisation_by_phalanx"]
    assert max(used) == pytest.approx(slip["utilisation"])
    assert 0.99 <= slip["utilisation"] <= 1.0
    assert study[0].data["phalanges"][int(np.argmax(used))] == slip["phalanx"]
    beyond = study[0].data["until_slip"]
    assert beyond["pull"][-1] == pytest.approx(slip["pull"])
    np.testing.assert_allclose(beyond["normal"][-1], slip["normal"], atol=1e-6)


@pytest.mark.slow
def test_the_command_writes_it(tmp_path, capsys):
    assert run_command_line(["study", "fig12", "-o", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["name"] == "fig12"
    assert sorted(f.name for f in (tmp_path / "out").iterdir()) == ["fig12.png", "result.json"]
