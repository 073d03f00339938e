"""A robot of the caller's own: its file and URDF in every command, its name in zenoh's keys."""

from __future__ import annotations

import json
import math
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh

from hand_models.base import InvalidInputError, Pose
from planner.robots import RobotFile, robosimian, robot_of
from service import CruxClient
from service.answering import dispatch, read_hand, read_robot, robots_of, with_hand, with_robot
from service.answering.questions import question
from service.commands.cli import run_command_line
from service.requests import PlanRequest, WrenchSpaceRequest
from service.serving import PlanService
from service.wire import NoServiceError, ServiceError, decode_request, server_key, service_key
from tests.suite.helpers.commands import complaint, result
from tests.suite.helpers.hands import entry_toml
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.requests import pose, put, wall_request
from tests.suite.helpers.robots import arm
from tests.suite.helpers.served import Served, client_config, free_endpoint

ANGLES = {"left": [0.3, -0.4, 0.2, 0.5, -0.2, -0.3], "right": [-0.3, -0.4, -0.2, 0.5, 0.2, -0.3]}
"""Of the two arms [rad]: the palms face the rock."""

BODY = Pose(np.zeros(3), np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]))
"""The trunk hangs on a wall: x up, z into the rock."""


TOML, URDF = arm(6, ("left", "right"))
"""A robot with two arms of six joints."""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robot's file, beside its URDF."""
    folder = tmp_path_factory.mktemp("arms")
    (folder / "arms.urdf").write_text(URDF)
    (folder / "arms.toml").write_text(TOML)
    return folder / "arms.toml"


@pytest.fixture(scope="module")
def lemur(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """RoboSimian with another name and a torso that weighs 20 kg less."""
    import planner

    folder = tmp_path_factory.mktemp("lemur")
    bundled = Path(planner.__file__).parent / "parameters"
    urdf = (bundled / "robosimian.urdf").read_text(encoding="utf-8")
    assert urdf.count('<mass value="40') == 1
    (folder / "lemur.urdf").write_text(urdf.replace('<mass value="40', '<mass value="20'))
    toml = (bundled / "robosimian.toml").read_text(encoding="utf-8")
    (folder / "lemur.toml").write_text(toml.replace('"robosimian', '"lemur'), encoding="utf-8")
    return folder / "lemur.toml"


def hanging(file: Path, joints: Any = ANGLES) -> dict:
    """The two arms' hands where their angles put them, in pinches; on the Moon."""
    hands = robot_of(RobotFile.load(file)).hand_poses({k: np.array(v) for k, v in ANGLES.items()})
    stance: dict[str, Any] = {
        "gravity": [0.0, 0.0, -1.62],
        "body": pose(BODY),
        "hands": [
            {
                "limb": limb,
                "pose": pose(BODY @ hand),
                "hold": {"shape": "cylinder", "diameter": 0.3},
                "surface": {"shear_limit": 80.0},
                "grasp": {"outer_rotation": math.pi},
            }
            for limb, hand in hands.items()
        ],
    }
    if joints is not None:
        stance["joints"] = joints
    return {"v": 1, "id": "hanging", "stance": stance}


def plan_request(request: dict) -> PlanRequest:
    return decode_request(msgspec.json.encode(request), PlanRequest)


# Commands -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("joints", [ANGLES, "solve", None])
def test_a_stance_is_planned_for_the_robot_of_the_file(
    joints: Any, file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    request = hanging(file, joints)
    assert run_command_line(["plan", stance_file(request), "--robot", str(file), "--json"]) == 0
    reply = result(capfd)
    robot = robot_of(RobotFile.load(file))
    assert robot.mass == pytest.approx(20.0 + 2 * sum(1 / k for k in range(1, 7)) + 2 * 2.6)
    np.testing.assert_allclose(np.linalg.norm(reply["body_wrench"][:3]), 1.62 * robot.mass)
    if joints is None:
        assert reply["joint_torque"] is None
        return
    angles = {limb: np.array(values) for limb, values in reply["joints"].items()}
    for limb, hand in robot.hand_poses(angles).items():
        asked = request["stance"]["hands"][robot.limbs.index(limb)]["pose"]
        np.testing.assert_allclose((BODY @ hand).position, asked["position"], atol=1e-5)
    # contract: gravity torque + Jᵀ · hand wrench on the rock
    gravity = BODY.rotation.T @ [0.0, 0.0, -1.62]
    weights = robot.statics(angles, gravity, np.zeros(6)).joint_torque
    jacobians = robot.jacobians(angles)
    for hand in reply["hands"]:
        limb = hand["limb"]
        np.testing.assert_allclose(
            reply["joint_torque"][limb],
            weights[limb] + jacobians[limb].T @ hand["wrench"],
            atol=1e-6,
        )
        assert reply["joint_torque_limit"][limb] == [80.0] * 6


@pytest.mark.slow
def test_a_person_reads_the_torques_of_every_joint(
    file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    path = stance_file(hanging(file) | {"limits": {"joint_torque": {"left": 8.0}}})
    assert run_command_line(["plan", path, "--robot", str(file)]) == 3
    out, err = capfd.readouterr()
    assert err == ""
    assert max(len(row) for row in out.splitlines()) <= 80
    assert "joint torques [N·m]" in out
    table = out.partition("joint torques")[2].partition("decrease of the utilisation")[0]
    rows = [row.split() for row in table.splitlines()]
    (left,) = [row for row in rows if row[:1] == ["left"] and len(row) == 9]
    assert sum(cell.endswith("*") for cell in left) == 1
    assert left[7] == "8"
    assert float(left[8]) > 1.0
    assert "left1_joint" in out.partition("decrease of the utilisation")[2]


@pytest.mark.parametrize("named", ["arms", None])
def test_a_stance_may_name_the_robot_of_the_file_or_none(
    named: str | None, file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    path = stance_file(put(hanging(file), ("stance", "robot"), named))
    assert run_command_line(["plan", path, "--robot", str(file), "--json"]) == 0
    assert result(capfd)["status"] == "optimal"


def test_a_stance_for_another_robot_is_refused_and_both_are_named(
    file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    path = stance_file(put(hanging(file), ("stance", "robot"), "robosimian"))
    for command in (["plan"], ["query"], ["wrench-space", "--hand", "left"]):
        assert (
            run_command_line([command[0], path, *command[1:], "--robot", str(file), "--json"]) == 2
        )
        words = complaint(capfd)
        assert words.startswith("crux: stance.robot: the stance is for 'robosimian'")
        assert f"{file} describes 'arms'" in words
    assert (
        run_command_line(["plan", stance_file(put(hanging(file), ("stance", "robot"), "arms"))])
        == 2
    )
    assert "unknown robot 'arms'; known are robosimian" in complaint(capfd)


def test_a_stance_with_limbs_of_another_robot_names_those_that_are_there(
    file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["plan", "wall-300", "--robot", str(file)]) == 2
    assert complaint(capfd) == (
        "crux: stance.hands[0].limb: unknown limb 'front_right'; known are left, right\n"
    )
    assert run_command_line(["plan", stance_file(hanging(file, None))]) == 2
    assert "unknown limb 'left'; known are front_right" in complaint(capfd)


BAD = {
    "no file": (None, None, "No such file or directory"),
    "no TOML": ("[limbs\n", None, "is not valid TOML: Expected"),
    "no URDF": (TOML, None, "urdf: "),
    "degrees": (TOML, URDF.replace("2.5", "143"), "urdf: "),
    "too few torques": (TOML.replace("80.0", "[80.0, 80.0]"), URDF, "limbs.left.torque_limit: one"),
}
"""Texts of a robot's file and its URDF, and the words that each is refused with."""


@pytest.mark.parametrize("what", BAD)
def test_a_bad_file_is_refused_in_one_line(
    what: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    *texts, words = BAD[what]
    path = tmp_path / "mine.toml"
    for file, text in zip((path, tmp_path / "arms.urdf"), texts, strict=True):
        if text is not None:
            file.write_text(text)
    assert run_command_line(["plan", "wall-300", "--robot", str(path)]) == 2
    line = complaint(capfd)
    assert line.startswith(f"crux: {path}: {words}")
    assert len(line) < len(str(path)) + 600


def test_a_hand_and_a_robot_of_ones_own_go_together(
    file: Path, stance_file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    hand = tmp_path / "hand.toml"
    hand.write_text(entry_toml("hand", "mass", 5.6))
    path = stance_file(hanging(file))
    assert (
        run_command_line(["plan", path, "--robot", str(file), "--hand", str(hand), "--json"]) == 0
    )
    weight = np.linalg.norm(result(capfd)["body_wrench"][:3])
    assert weight == pytest.approx(1.62 * (robot_of(RobotFile.load(file)).mass + 2 * 3.0))


def test_a_wrench_space_is_that_of_the_robots_hand(
    file: Path, stance_file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "hand.png"
    request = put(hanging(file), ("stance", "hands", 0, "grasp", "lateral"), False)
    path = stance_file(request)
    flags = ["--robot", str(file), "--plot", str(picture), "--json"]
    assert run_command_line(["wrench-space", path, "--hand", "left", *flags]) == 0
    reply = result(capfd)
    assert (reply["robot"], reply["limb"]) == ("arms", "left")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_body_space_is_that_of_the_robot(
    file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    assert (
        run_command_line(["body-space", stance_file(hanging(file)), "--robot", str(file), "--json"])
        == 0
    )
    reply = result(capfd)
    assert reply["robot"] == "arms"
    weight = np.linalg.norm(reply["body_wrench"][:3])
    assert weight == pytest.approx(1.62 * robot_of(RobotFile.load(file)).mass)


def test_a_lighter_robot_takes_the_bundled_stances(
    lemur: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run_command_line(["plan", "wall-300", "--json"]) == 0
    heavy = result(capfd)
    assert run_command_line(["plan", "wall-300", "--robot", str(lemur), "--json"]) == 0
    light = result(capfd)
    assert robot_of(RobotFile.load(lemur)).mass == pytest.approx(robosimian().mass - 20.0)
    np.testing.assert_allclose(
        light["body_wrench"][:3],
        np.array(heavy["body_wrench"][:3]) * (1.0 - 20.0 / robosimian().mass),
        atol=1e-9,
    )
    assert light["load_factor"] > heavy["load_factor"]


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_route_is_climbed_by_the_robot_in_other_processes_too(
    workers: int, file: Path, stance_file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    request = hanging(file, "solve")
    del request["id"]
    left, right = request["stance"]["hands"]
    higher = {**left, "pose": put(left["pose"], ("position", 2), left["pose"]["position"][2] + 0.9)}
    moves = [left, {**right, "body": request["stance"]["body"]}, higher]
    path = stance_file(request | {"moves": moves, "objective": "min_effort"})
    out = tmp_path / "out"
    flags = ["--robot", str(file), "--workers", str(workers), "--json"]
    assert run_command_line(["route", path, "-o", str(out), *flags]) == 3
    summary = result(capfd)
    assert summary["statuses"]["unreachable"] == 1
    assert summary["crux"]["sentence"].startswith("The crux is move 3, with left on its new hold")
    assert "left is out of reach by " in summary["crux"]["sentence"]
    assert summary["stages"] == 8


# Zenoh --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_two_robots_are_served_side_by_side(alone: zenoh.Session, file: Path) -> None:
    own = read_robot(file)
    request = plan_request(hanging(file))
    with PlanService(alone, workers=1), PlanService(alone, own, workers=1) as service:
        assert service.robot == "arms"
        heard = alone.liveliness().get("crux/**", timeout=PATIENCE)
        alive = {str(reply.ok.key_expr) for reply in heard}
        (zid, robots) = str(alone.info.zid()), ("arms", "robosimian")
        keys = [(service_key(robot, "alive"), server_key(robot, zid)) for robot in robots]
        assert alive == {key for each in keys for key in each}
        arms, simian = (
            CruxClient(alone, name, timeout=PATIENCE) for name in ("arms", "robosimian")
        )
        want = dispatch.answer_plan(request, robots_of(own))
        for asked in (request, with_robot(request, own)):
            assert arms.plan(asked).utilisation == pytest.approx(want.utilisation, rel=1e-9)
        space = WrenchSpaceRequest(v=1, stance=request.stance, limb="right")
        assert arms.wrench_space(space).robot == "arms"
        assert simian.plan(plan_request(wall_request())).status == "optimal"
        with pytest.raises(ServiceError, match="unknown robot 'arms'; known are robosimian") as no:
            simian.plan(with_robot(request, own))
        assert (no.value.kind, no.value.field) == ("invalid", "stance.robot")
        named = plan_request(put(wall_request(), ("stance", "robot"), "robosimian"))
        with pytest.raises(ServiceError, match="unknown robot 'robosimian'; known are arms"):
            arms.plan(named)
        with pytest.raises(NoServiceError, match="no service answers at crux/loris/plan"):
            CruxClient(alone, "loris", timeout=PATIENCE).plan(request)


@pytest.fixture(scope="module")
def served(file: Path) -> Iterator[Served]:
    """A process that serves the robot of the file."""
    server = Served(free_endpoint(), "--robot", str(file), "--workers", "1")
    yield server
    server.stop(signal.SIGTERM)
    assert server.process.returncode == 0


def flags_to(served: Served) -> list[str]:
    flags = ["-m", "client", "-e", served.endpoint, "--no-multicast-scouting", "--json"]
    return [*flags, "--timeout", str(PATIENCE)]


@pytest.mark.slow
def test_serve_and_query_a_robot_and_a_hand(
    served: Served, file: Path, stance_file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    hand = tmp_path / "hand.toml"
    hand.write_text(entry_toml("structure", "held_mass", 20.0))
    assert set(served.ready["keys"]) == {
        service_key("arms", name) for name in (*dispatch.SERVICES_BY_NAME, "cancel")
    }
    flags = [*flags_to(served), "--robot", str(file), "--hand", str(hand)]
    assert run_command_line(["query", stance_file(hanging(file)), *flags]) == 0
    request = with_hand(plan_request(hanging(file)), read_hand(hand))
    want = dispatch.answer_plan(request, robots_of(read_robot(file)))
    assert result(capfd)["utilisation"] == pytest.approx(want.utilisation, rel=1e-9)


@pytest.mark.slow
def test_a_query_that_names_the_robot_goes_to_its_service(
    served: Served, file: Path, stance_file, capfd: pytest.CaptureFixture[str]
) -> None:
    named = stance_file(put(hanging(file), ("stance", "robot"), "arms"))
    assert run_command_line(["query", named, *flags_to(served)]) == 0
    assert result(capfd)["status"] == "optimal"


@pytest.mark.slow
def test_a_service_says_what_its_robot_does_not_reach(served: Served, file: Path) -> None:
    far = hanging(file, "solve")
    far["stance"]["hands"][1]["pose"]["position"][2] += 1.0
    with (
        CruxClient(client_config(served.endpoint), "arms", timeout=PATIENCE) as client,
        pytest.raises(ServiceError, match="right is out of reach by 0") as caught,
    ):
        client.plan(plan_request(far))
    assert caught.value.kind == "unreachable"


@pytest.mark.slow
def test_the_demo_is_of_the_robot(
    lemur: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "demo.png"
    assert run_command_line(["demo", "-o", str(picture), "--json", "--robot", str(lemur)]) == 0
    weight = np.linalg.norm(result(capfd)["body_wrench"][:3])
    assert weight == pytest.approx(9.81 * robot_of(RobotFile.load(lemur)).mass)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_demo_of_a_robot_that_does_not_reach_leaves_joints_out(
    lemur: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    urdf = (lemur.parent / "lemur.urdf").read_text(encoding="utf-8")
    limits = 'lower="-3.1415" upper="3.1415"'
    assert urdf.count(limits) == 28
    (tmp_path / "lemur.urdf").write_text(urdf.replace(limits, 'lower="-0.1" upper="0.1"'))
    file = tmp_path / "stiff.toml"
    file.write_text(lemur.read_text(encoding="utf-8"), encoding="utf-8")
    picture = tmp_path / "demo.png"
    assert run_command_line(["demo", "-o", str(picture), "--json", "--robot", str(file)]) == 0
    out, err = capfd.readouterr()
    assert err.startswith("crux: planned without joints: front_right is ")
    assert err.count("\n") == 1
    reply = json.loads(out)
    assert (reply["joints"], reply["joint_torque"], reply["verified"]) == (None, None, True)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_request_for_another_robot_is_not_turned_into_one_for_this(file: Path) -> None:
    request = plan_request(put(wall_request(), ("stance", "robot"), "loris"))
    with pytest.raises(InvalidInputError, match="the stance is for 'loris'"):
        with_robot(request, read_robot(file))
    with pytest.raises(InvalidInputError, match="unknown robot 'loris'; known are robosimian"):
        question(request)
