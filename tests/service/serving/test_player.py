"""A climb is played: its set-points come in order, in time, and as they are interpolated."""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest
import zenoh
from scipy.spatial.transform import Rotation

from hand_models.base import UnsupportedError
from service.bulk import trajectory_digest, write_trajectory
from service.commands.cli import run_command_line
from service.replies import KnotReply
from service.serving import climb_set_points, open_session, play, zenoh_config
from service.wire import NoServiceError
from tests.suite.helpers.climbs import climbed
from tests.suite.helpers.commands import BAD_INPUT, DONE, FAILED, complaint, result
from tests.suite.helpers.dry_robot import DryRobot
from tests.suite.helpers.processes import begun, ended, until
from tests.suite.helpers.served import client_config, free_endpoint


@pytest.fixture(scope="module")
def knots() -> list[KnotReply]:
    return [KnotReply.of(knot) for knot in climbed().climb.knots]


@pytest.fixture(scope="module")
def listening() -> Iterator[tuple[zenoh.Session, str]]:
    endpoint = free_endpoint()
    config = zenoh_config(mode="peer", listen=[endpoint], multicast=False)
    with open_session(config) as session:
        yield session, endpoint


@pytest.fixture
def robot(listening) -> DryRobot:
    return DryRobot(listening[0])


def climb_folder(folder: Path, knots: list[KnotReply], failure: dict | None = None) -> Path:
    write_trajectory(knots, folder)
    rates = {"tension_rate": 50.0}
    digest = trajectory_digest(folder, rates)
    end = {"failure": failure, "knots": len(knots), "rates": rates, "digest": digest}
    about = {"route": "two moves", "robot": "robosimian", "climb": end}
    (folder / "summary.json").write_text(json.dumps(about))
    return folder


# Set-points ---------------------------------------------------------------------------------------


def test_set_points_pass_every_knot_and_are_linear_between(knots):
    points = list(climb_set_points(knots, 0.03))
    assert [each.number for each in points] == list(range(len(points)))
    steps = np.diff([each.time for each in points])
    assert 0.0 < steps.min() <= steps.max() <= 0.03 + 1e-12
    # of a segment of one or two seconds, evenly
    assert len(points) == 1 + sum(
        int(np.ceil((b.time - a.time) / 0.03)) for a, b in pairwise(knots)
    )
    for knot in knots:
        (there,) = (each for each in points if each.time == knot.time)
        assert (there.knot, there.joints, there.body) == (knot.index, knot.joints, knot.body)
        assert there.tensions == {hand.limb: hand.tensions for hand in knot.hands}
    times = [knot.time for knot in knots]
    for i in range(4):
        known = [knot.hands[2].tensions[i] for knot in knots]
        played = [each.tensions["rear_left"][i] for each in points]
        assert np.allclose(played, np.interp([p.time for p in points], times, known), atol=1e-9)
    known = [knot.body.position[2] for knot in knots]
    played = [each.body.position[2] for each in points]
    assert np.allclose(played, np.interp([p.time for p in points], times, known), atol=1e-12)


def test_a_body_turns_the_shortest_way_at_a_constant_rate(knots):
    start = knots[0]
    turned = Rotation.from_quat(start.body.orientation) * Rotation.from_rotvec([0.0, 0.0, 0.4])
    # the same orientation as the one of other sign
    far = msgspec.structs.replace(start.body, orientation=(-turned.as_quat()).tolist())
    end = msgspec.structs.replace(start, index=1, time=1.0, body=far)
    points = list(climb_set_points([start, end], 0.1))
    turns = [Rotation.from_quat(each.body.orientation) for each in points]
    angles = [(turns[0].inv() * turn).as_rotvec() for turn in turns]
    assert np.allclose(angles, np.outer(np.linspace(0.0, 1.0, 11), [0.0, 0.0, 0.4]), atol=1e-9)


def test_all_is_loaded_before_the_first_set_points(knots, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delitem(sys.modules, "scipy.spatial.transform")
    next(climb_set_points(knots, 0.1))
    assert "scipy.spatial.transform" in sys.modules


def test_knots_at_one_time_follow_each_other(knots):
    again = msgspec.structs.replace(knots[0], index=1)
    assert [each.knot for each in climb_set_points([knots[0], again], 0.1)] == [0, 1]


# Over zenoh ---------------------------------------------------------------------------------------


def test_a_robot_gets_all_set_points_in_order_and_no_sooner_than_they_should_come(
    knots, listening, robot
):
    with open_session(client_config(listening[1])) as session:
        sent = play(session, "robosimian", knots, rate=200.0, speed=20.0, wait=10.0)
    robot.wait()
    taken = robot.taken
    assert len(taken) == sent + 1
    assert [each.number for each in taken] == list(range(sent + 1))
    assert taken[:-1] == list(climb_set_points(knots, 20.0 / 200.0))
    assert taken[-1] == msgspec.structs.replace(taken[-2], number=sent, state="done")
    # whatever the machine does, the whole takes no less time than the climb has at this speed
    assert robot.arrivals[-1] - robot.arrivals[0] >= 0.9 * knots[-1].time / 20.0
    change = [
        np.abs(np.subtract([*b.tensions.values()], [*a.tensions.values()])).max()
        for a, b in pairwise(taken)
    ]
    rates = [
        np.abs(np.subtract(new.tensions, old.tensions)).max() / (b.time - a.time)
        for a, b in pairwise(knots)
        for old, new in zip(a.hands, b.hands, strict=True)
    ]
    assert max(change) <= max(rates) * 20.0 / 200.0 + 1e-9


def test_what_comes_late_is_told(knots, listening, robot, monkeypatch: pytest.MonkeyPatch):
    slow, delays = time.sleep, []
    monkeypatch.setattr("time.sleep", lambda seconds: slow(seconds + 0.01))
    with open_session(client_config(listening[1])) as session:
        play(session, "robosimian", knots[:3], rate=200.0, wait=10.0, late=delays.append)
    robot.wait()
    # a sleep ends 10 ms late, and the next set-points should come 5 ms after
    assert max(delays) > 0.004


def test_many_set_points_between_two_knots_are_evenly_spaced(knots):
    slow = [msgspec.structs.replace(knot, time=45.0 * knot.index) for knot in knots[:2]]
    points = list(climb_set_points(slow, 0.01))
    assert [each.time for each in points] == pytest.approx(np.arange(4501) / 100.0)
    assert points[-1].body == slow[1].body
    assert points[-1].joints == slow[1].joints


def test_nobody_is_played_to_where_nobody_listens(knots):
    config = zenoh_config(mode="peer", settings=["listen/endpoints:[]"], multicast=False)
    with (
        open_session(config) as session,
        pytest.raises(NoServiceError, match="nobody subscribes to crux/robosimian/play"),
    ):
        play(session, "robosimian", knots, rate=100.0, wait=0.05)


def test_the_command_plays_a_folder(knots, listening, robot, tmp_path, capfd):
    folder = climb_folder(tmp_path, knots)
    flags = ["-m", "client", "-e", listening[1], "--no-multicast-scouting", "--wait", "10"]
    fast = ["--speed", "50", "--rate", "100"]
    assert run_command_line(["play", str(folder), *flags, *fast, "--json"]) == DONE
    said = result(capfd)
    robot.wait()
    assert said == {
        "v": 1,
        "set_points": len(robot.taken) - 1,
        "knots": len(knots),
        "time": knots[-1].time,
    }
    assert robot.taken[-1].state == "done"


def test_a_climb_that_fails_is_played_up_to_there_only_if_asked_for(
    knots, listening, robot, tmp_path, capfd
):
    failure = {"move": 2, "phase": "swing", "limb": "front_right", "reason": "a link meets rock"}
    folder = climb_folder(tmp_path, knots[:4], failure)
    flags = ["-m", "client", "-e", listening[1], "--no-multicast-scouting", "--wait", "10"]
    command = ["play", str(folder), *flags, "--speed", "50"]
    assert run_command_line(command) == BAD_INPUT
    words = complaint(capfd)
    assert "move 2 (swing): a link meets rock; --up-to-failure" in words
    assert not robot.taken
    assert run_command_line([*command, "--up-to-failure"]) == DONE
    robot.wait()
    assert robot.taken[-1].knot == 3


def test_what_cannot_be_played_is_refused(knots, tmp_path, capfd):
    assert run_command_line(["play", str(tmp_path)]) == BAD_INPUT
    assert "crux route ROUTE -o" in complaint(capfd)
    write_trajectory(knots, tmp_path)
    assert run_command_line(["play", str(tmp_path)]) == BAD_INPUT
    assert "summary.json: No such file" in complaint(capfd)
    climb_folder(tmp_path, knots)
    write_trajectory(knots[:-1], tmp_path)
    assert run_command_line(["play", str(tmp_path)]) == BAD_INPUT
    assert f"ends after {len(knots) - 1} knots, the climb of summary.json has" in complaint(capfd)
    unsure = [msgspec.structs.replace(knot, verified=knot.index != 2) for knot in knots]
    assert run_command_line(["play", str(climb_folder(tmp_path, unsure))]) == BAD_INPUT
    assert "knot 2 is not verified" in complaint(capfd)


def test_an_edited_climb_is_refused(knots, tmp_path, capfd):
    """Also if all its numbers could be those of a climb."""

    def refused(folder: Path) -> bool:
        assert run_command_line(["play", str(folder), "--wait", "0"]) == BAD_INPUT
        return "climb.digest differs" in complaint(capfd)

    heavier = msgspec.structs.replace(knots[2], hands=[*knots[2].hands])
    hand = heavier.hands[0]
    tensions = [hand.tensions[0] + 1e-9, *hand.tensions[1:]]
    heavier.hands[0] = msgspec.structs.replace(hand, tensions=tensions)
    folder = climb_folder(tmp_path, knots)
    unchanged = (folder / "summary.json").read_text()
    write_trajectory([*knots[:2], heavier, *knots[3:]], folder)
    assert refused(folder)
    # as it was, with other rates
    write_trajectory(knots, folder)
    (folder / "summary.json").write_text(unchanged.replace("50.0", "60.0"))
    assert refused(folder)
    about = json.loads(unchanged)
    del about["climb"]["digest"]
    (folder / "summary.json").write_text(json.dumps(about))
    assert run_command_line(["play", str(folder)]) == BAD_INPUT
    assert "missing required field `digest`" in complaint(capfd)


def test_a_second_player_is_refused_while_the_first_one_plays(knots, listening, robot, tmp_path):
    folder = climb_folder(tmp_path, knots)
    flags = ["-m", "client", "-e", listening[1], "--no-multicast-scouting", "--wait", "30"]
    first = begun("play", str(folder), *flags, "--rate", "50")
    until(lambda: len(robot.taken) >= 5, first)
    with (
        open_session(client_config(listening[1])) as session,
        pytest.raises(UnsupportedError, match="another player sends set-points"),
    ):
        play(session, "robosimian", knots, rate=100.0, speed=50.0, wait=30.0)
    first.send_signal(signal.SIGINT)
    ended(first)
    robot.wait()
    assert [points.number for points in robot.taken] == list(range(len(robot.taken)))
    again = DryRobot(listening[0])
    with open_session(client_config(listening[1])) as session:
        play(session, "robosimian", knots, rate=100.0, speed=50.0, wait=30.0)
    again.wait()
    assert again.taken[-1].state == "done"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_robot_is_told_that_playing_was_broken_off(number, knots, listening, robot, tmp_path):
    folder = climb_folder(tmp_path, knots)
    flags = ["-m", "client", "-e", listening[1], "--no-multicast-scouting", "--wait", "30"]
    process = begun("play", str(folder), *flags, "--rate", "50")
    until(lambda: len(robot.taken) >= 5, process)
    process.send_signal(number)
    status, error = ended(process)
    robot.wait()
    assert status == FAILED
    last, stopped = robot.taken[-2:]
    assert stopped == msgspec.structs.replace(last, number=last.number + 1, state="stopped")
    told = f"stopped at {stopped.time:.2f} s of {knots[-1].time:.2f} s"
    assert f"crux: interrupted: {told}" in error
    assert 0.0 < stopped.time < knots[-1].time
