"""``crux holds``: holds proposed on a scan, and a plan with one of them."""

from __future__ import annotations

import json
import re
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh

from hand_models.base import CruxError, InvalidInputError
from hand_models.fixed_wrist import AT_BORDER, AT_HOLE, grid_of_trials, try_holds
from hand_models.hand import spiny_hand
from hand_models.parameters import hand_table
from hand_models.rock import Mesh, read_mesh
from hand_models.tile import Surface
from service import processes
from service.commands.cli import run_command_line
from service.processes import Interrupted
from tests.suite.helpers.commands import BAD_INPUT, DONE, FAILED, complaint, result
from tests.suite.helpers.processes import begun, ended, until, watched, workers
from tests.suite.helpers.requests import pose_of, wall_request
from tests.suite.helpers.rocks import cylinder_mesh, height_map

COARSE = ["--spacing", "0.15", "--angles", "1", "--outer-rotation", "0"]


def test_holds_are_written_sorted_and_drawn(rock, tmp_path, capfd):
    output, picture, page = (tmp_path / f"holds.{ending}" for ending in ("json", "png", "html"))
    twice = ["--outer-rotation", "0"]  # which is no other hand
    options = ["-o", str(output), *COARSE, *twice, "--samples", "2", "--workers", "1"]
    drawn = ["--plot", str(picture), "--html", str(page)]
    assert run_command_line(["holds", str(rock), *options, *drawn]) == DONE
    out, _ = capfd.readouterr()
    assert max(map(len, out.splitlines()[:-1])) <= 80
    assert "16 trials at 16 points" in out
    assert picture.read_bytes().startswith(b"\x89PNG")
    told = json.loads(output.read_text(encoding="utf-8"))
    held = told["holds"]
    assert (told["trials"], told["tried"]) == (16, 16)
    assert told["units"] == {"length": "m", "angle": "rad", "force": "N", "share": "1"}
    assert "x, y, z mm" in out
    assert out.splitlines()[-1] == f"{output} (in m, rad, N)"
    assert len(held) + told["refused"] <= 16
    check_refusals(told)
    check_page(page, told)
    assert (told["samples"], told["direction"], told["force"]) == (2, "-fz", 0.1)
    assert told["sort"] == "robust"
    assert {hold["samples"] for hold in held} == {2}
    assert ranks(held) == sorted(ranks(held), reverse=True)
    for hold in held:
        for way, reach in hold["pure"].items():
            assert (way in hold["cannot"]) == (reach is None or reach < 0.1)
        assert hold["pure_pull_off"] == hold["pure"]["-fz"]
        assert (hold["pure_tenth"]["-fz"] >= 0.1) == (hold["share"]["-fz"] == 1.0)
        assert 0.0 <= hold["pure_tenth"]["-fz"] <= max(hold["tenth"]["-fz"], 0.0)


def check_page(page: Path, told: dict) -> None:
    """Each point is there once: a hold with its value, or refused, with the reasons' kinds."""
    data = json.loads(re.search(r'id="data">(.*?)</script>', page.read_text("utf-8"))[1])
    holds, *refused = data["groups"]
    best = {tuple(hold["place"]["point"]): hold for hold in reversed(told["holds"])}
    off = [[round(x, 4), round(y, 4), round(z - 0.01, 4)] for x, y, z in best]
    assert sorted(holds["places"]) == sorted(off)
    assert sorted(holds["values"]) == sorted(100 * hold["share"]["-fz"] for hold in best.values())
    reasons = {tuple(each["point"]): each["reasons"] for each in told["refusals"]}
    texts = [text for group in refused for text in group["texts"]]
    alone = [there for point, there in reasons.items() if point not in best]
    assert len(texts) == told["trials"] - len(best)
    assert all(any(f"1 × {why}" in text for text in texts) for there in alone for why in there)
    (table,) = data["stages"][0]["tables"]
    assert [row[6] for row in table["rows"]] == [hold["pure"]["-fz"] for hold in told["holds"]]


MEASURES = ("pure_tenth", "share", "pure", "support")


def ranks(holds: list[dict], way: str = "-fz", order: tuple[str, ...] = MEASURES) -> list:
    """Measures of holds along a direction; −1 without samples, 0 without a pure force."""

    def measure(hold: dict, key: str) -> float:
        value = -1.0 if hold[key] is None else hold[key][way]
        return max(value or 0.0, 0.0) if key == "pure" else value

    return [[measure(hold, key) for key in order] for hold in holds]


@pytest.mark.parametrize(
    ("more", "order"),
    [
        (["--samples", "0"], ("pure", "support")),
        (["--samples", "0", "--sort", "support"], ("support", "pure")),
        (["--samples", "0", "--direction", "-fx"], ("pure", "support")),
    ],
)
def test_holds_are_sorted_as_asked_for(rock, tmp_path, capfd, more, order):
    output = tmp_path / "holds.json"
    options = ["-o", str(output), *COARSE, "--workers", "1", *more]
    assert run_command_line(["holds", str(rock), *options]) == DONE
    held = json.loads(output.read_text(encoding="utf-8"))["holds"]
    way = "-fx" if "-fx" in more else "-fz"
    found = ranks(held, way, order)
    assert len(found) > 1
    assert found == sorted(found, reverse=True)
    assert {hold["samples"] for hold in held} == {0}
    assert all(hold["share"] is hold["pure_tenth"] is hold["tenth"] is None for hold in held)
    out, _ = capfd.readouterr()
    assert f"along {way}" in out
    assert "share %" not in out


def test_only_the_best_are_sampled_if_asked_for(rock, tmp_path):
    """The first comes first with samples, too: those without have no robust force."""
    output = tmp_path / "holds.json"
    options = ["-o", str(output), *COARSE, "--workers", "1", "--samples", "2", "--robust", "1"]
    assert run_command_line(["holds", str(rock), *options]) == DONE
    held = json.loads(output.read_text(encoding="utf-8"))["holds"]
    assert [hold["samples"] for hold in held] == [2] + [0] * (len(held) - 1)
    nominal = ranks(held, order=("pure", "support"))
    assert nominal == sorted(nominal, reverse=True)


def check_refusals(told: dict) -> None:
    """Every refused trial is counted once, at its point and under its reason."""
    for key in ("reasons", "kinds"):
        counts: Counter[str] = Counter()
        for refusal in told["refusals"]:
            counts.update(refusal[key])
        assert counts == told[key]
        assert counts.total() == told["refused"]
    points = [tuple(refusal["point"]) for refusal in told["refusals"]]
    assert len({*points}) == len(points)


def test_file_and_table_say_why_hands_cannot_be_at_places(rock, tmp_path, capfd):
    """At the rim of a wall fingers reach over its border; each trial is tried again."""
    output = tmp_path / "holds.json"
    options = [*COARSE, "--samples", "0", "--workers", "1"]
    assert run_command_line(["holds", str(rock), "-o", str(output), *options]) == DONE
    told = json.loads(output.read_text(encoding="utf-8"))
    check_refusals(told)
    assert 0 < told["reasons"][AT_BORDER] < told["trials"] == told["tried"]
    assert told["kinds"]["scan_border"] == told["reasons"][AT_BORDER]
    table = capfd.readouterr().out.split("places without a hold")[1]
    idle = told["tried"] - told["refused"] - len(told["holds"])
    for kind, count in (told["kinds"] | ({"holds_nothing": idle} if idle else {})).items():
        assert re.search(rf"^ {kind} +{count} ", table, re.MULTILINE)
    held = {tuple(hold["place"]["point"]) for hold in told["holds"]}
    mesh = Mesh(*read_mesh(rock), hand_table(), anywhere=True)
    radius = 0.5 * hand_table().scalar("palm", "length")
    trials = grid_of_trials(mesh, 0.15, 1, (0.0,), radius=radius)
    assert len(trials) == told["trials"]
    at_point = Counter(trial.point for trial in trials)
    for refusal in told["refusals"]:
        point = tuple(refusal["point"])
        refused = sum(refusal["reasons"].values())
        assert 0 < refused <= at_point[point]
        assert refused < at_point[point] or point not in held
    # each refused trial alone is refused with the reason that is told of its point
    tried = try_holds(spiny_hand(), mesh, Surface.named("rock"), trials)
    for trial, outcome in zip(trials, tried, strict=True):
        if isinstance(outcome, InvalidInputError):
            (there,) = [r for r in told["refusals"] if tuple(r["point"]) == trial.point]
            assert any(outcome.message.startswith(why.split("…")[0]) for why in there["reasons"])


def planned_with(hold, rock, tmp_path, capfd):
    """The plan of a stance whose first hand has a hold that was found, and the pose of its rock."""
    request = wall_request()
    hand = request["stance"]["hands"][0]
    # a wall that faces the body: z of the rock's frame along x of the world
    position = hand.pop("pose")["position"]
    pose = {"position": position, "orientation": [0.0, 0.70710678, 0.0, 0.70710678]}
    request["stance"]["rocks"] = {"wall": {"shape": "mesh", "file": str(rock), "pose": pose}}
    hand |= {"hold": {"shape": "rock", "rock": "wall"}}
    hand |= {key: hold[key] for key in ("grasp", "place", "placing")}
    stance = tmp_path / "stance.json"
    stance.write_text(json.dumps(request), encoding="utf-8")
    capfd.readouterr()
    run_command_line(["plan", str(stance), "--json"])
    return result(capfd), pose


def test_a_plan_is_made_with_a_hold_that_was_proposed(rock, tmp_path, capfd):
    output = tmp_path / "holds.json"
    options = ["-o", str(output), *COARSE, "--samples", "0", "--workers", "1", "--json"]
    assert run_command_line(["holds", str(rock), *options]) == DONE
    told = result(capfd)
    best = json.loads(output.read_text(encoding="utf-8"))["holds"][0]
    assert told["file"] == str(output)
    reply, _ = planned_with(best, rock, tmp_path, capfd)
    assert reply["hands"][0]["seating"]["rule"] == best["seating"]["rule"]
    assert list(reply["poses"]) == [reply["hands"][0]["limb"]]


@pytest.mark.slow
def test_a_hold_by_contact_is_where_a_plan_places_the_hand_by_contact(tmp_path, capfd):
    """On a log of 300 mm, across z of its frame: at its crest a pinch has a rest."""
    vertices, faces = cylinder_mesh(0.3, length=0.3)
    log, output = tmp_path / "log.ply", tmp_path / "holds.json"
    trimesh.Trimesh(vertices, faces, process=False).export(log)
    grid = ["--spacing", "0.31", "--angles", "1", "--outer-rotation", "3.14159265"]
    options = ["-o", str(output), *grid, "--samples", "0", "--workers", "1"]
    found = {}
    for placing in ("given", "contact"):
        assert run_command_line(["holds", str(log), *options, "--placing", placing]) == DONE
        holds = json.loads(output.read_text(encoding="utf-8"))["holds"]
        assert all(hold["placing"] == placing for hold in holds)
        found |= {(placing, tuple(hold["place"]["point"])): hold for hold in holds}
    best = holds[0]
    assert best["seating"]["rule"] == "contact"
    seat = found["given", tuple(best["place"]["point"])]
    assert best["pose"]["position"][2] > seat["pose"]["position"][2] + 5e-4
    reply, pose = planned_with(best, log, tmp_path, capfd)
    assert reply["hands"][0]["seating"]["rule"] == "contact"
    there = pose_of(pose).inverse() @ pose_of(reply["poses"][reply["hands"][0]["limb"]])
    assert there.position == pytest.approx(best["pose"]["position"], abs=1e-6)


@pytest.mark.slow
def test_where_no_hand_comes_to_rest_the_hint_says_so(tmp_path, capfd):
    """Four fingers side by side on flat rock drag the hand along."""
    flat, output = tmp_path / "flat.ply", tmp_path / "holds.json"
    corners = [[-0.4, -0.4, 0.0], [0.4, -0.4, 0.0], [0.4, 0.4, 0.0], [-0.4, 0.4, 0.0]]
    trimesh.Trimesh(corners, [[0, 2, 1], [0, 3, 2]], process=False).export(flat)
    grid = ["--spacing", "1", "--angles", "1", "--outer-rotation", "0"]
    options = ["-o", str(output), *grid, "--robust", "0", "--workers", "1"]
    for placing, rests in (("contact", False), ("given", True)):
        status = run_command_line(["holds", str(flat), *options, "--placing", placing])
        assert status == (0 if rests else 3)
        told = " ".join(capfd.readouterr().out.split())
        assert ("nothing holds: closed hands come to rest nowhere" in told) != rests
        assert "does z of the file point" not in told
        assert ("--placing given" in told) != rests


@pytest.mark.slow
def test_places_at_holes_of_a_scan_are_counted_with_what_may_close_them(tmp_path, capfd):
    vertices, faces = height_map(np.zeros((121, 121)), 4e-3)
    hole = np.abs(vertices[faces].mean(axis=1)[:, :2] - [0.1, 0.0]).max(axis=1) < 0.03
    for name, some in (("whole", faces), ("holed", faces[~hole])):
        scan, output = tmp_path / f"{name}.ply", tmp_path / f"{name}.json"
        trimesh.Trimesh(vertices, some, process=False).export(scan)
        grid = ["--spacing", "0.1", "--angles", "1", "--outer-rotation", "0"]
        options = ["-o", str(output), *grid, "--robust", "0", "--workers", "1"]
        assert run_command_line(["holds", str(scan), *options]) == DONE
        reasons = json.loads(output.read_text(encoding="utf-8"))["reasons"]
        count, said = reasons.get(AT_HOLE, 0), " ".join(capfd.readouterr().out.split())
        assert reasons[AT_BORDER] > 0
        assert (count > 0) == (name == "holed")
        words = f"{count} of these places are at holes of the scan, away from its outline"
        assert (words in said) == (count > 0)
        assert ("--hole" in said) == (count > 0)


def test_what_was_tried_is_kept_when_the_rest_is_broken_off(rock, tmp_path, monkeypatch):
    output = tmp_path / "holds.json"
    real = processes.HoldTrials.each

    def broken(self: processes.HoldTrials, trials: list, **more: object) -> Iterator:
        for done, each in enumerate(real(self, trials, **more)):
            if done == 8:
                raise Interrupted
            yield each

    monkeypatch.setattr(processes.HoldTrials, "each", broken)
    picture = tmp_path / "holds.png"
    options = [*COARSE, "--samples", "0", "--plot", str(picture)]
    words = "8 of 16 places were tried, 0 of the best sampled; .*; --plot was not drawn$"
    with pytest.raises(Interrupted, match=words):
        run_command_line(["holds", str(rock), "-o", str(output), *options])
    assert not picture.exists()
    told = json.loads(output.read_text(encoding="utf-8"))
    assert (told["trials"], told["tried"]) == (16, 8)
    found = ranks(told["holds"], order=("pure", "support"))
    assert found
    assert found == sorted(found, reverse=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "more",
    [
        ["--workers", "2"],
        ["--dask", "local", "--workers", "2"],
    ],
    ids=["processes", "cluster"],
)
def test_holds_are_the_same_wherever_hands_are_tried(more, rock, tmp_path, capfd):
    if "--dask" in more:
        pytest.importorskip("distributed")
    found = []
    for where in (["--workers", "1"], more):
        output = tmp_path / f"{len(found)}.json"
        options = ["-o", str(output), *COARSE, "--robust", "2", "--samples", "4", "--json", *where]
        assert run_command_line(["holds", str(rock), *options]) == DONE
        assert capfd.readouterr().err == ""
        found.append(output.read_bytes())
    assert found[0] == found[1]


def test_what_was_tried_is_kept_when_the_cluster_is_gone(rock, tmp_path, capfd, monkeypatch):
    output = tmp_path / "holds.json"
    real = processes.HoldTrials.each

    def broken(self: processes.HoldTrials, trials: list, **more: object) -> Iterator:
        yield next(real(self, trials, **more))
        raise CruxError("the Dask scheduler is gone")

    monkeypatch.setattr(processes.HoldTrials, "each", broken)
    options = ["-o", str(output), *COARSE, "--workers", "1", "--samples", "1", "--robust", "2"]
    assert run_command_line(["holds", str(rock), *options]) == FAILED
    kept = "1 of 16 places were tried, 0 of the best sampled; what they hold is in"
    assert f"the Dask scheduler is gone; {kept}" in complaint(capfd)
    assert json.loads(output.read_text(encoding="utf-8"))["tried"] == 1


@watched
def test_an_interruption_ends_the_search(rock, tmp_path):
    output = tmp_path / "holds.json"
    process = begun("holds", str(rock), "-o", str(output), *COARSE, "--workers", "2")
    until(lambda: workers(process), process)
    process.send_signal(signal.SIGTERM)
    status, error = ended(process)
    assert (status, error.count("\n")) == (FAILED, 1)
    assert error.startswith("crux: interrupted")
    assert output.exists() == ("places were tried" in error)
    assert {path.name for path in tmp_path.iterdir()} <= {output.name}


def test_what_cannot_be_is_told_in_a_line(rock, tmp_path, capfd):
    output = str(tmp_path / "holds.json")
    for arguments, words in (
        ([str(tmp_path / "none.ply"), "-o", output], "no such file"),
        ([str(rock), "-o", output, "--surface", "cheese"], "cheese"),
        (
            [str(rock), "-o", output, "--samples", "0", "--sort", "share"],
            "--sort: share requires samples: give --samples above 0, or sort by pure or support",
        ),
        ([str(rock), "-o", output, "--spacing", "0"], "spacing"),
        (
            [str(rock), "-o", output, "--spacing", "nan"],
            "spacing: must be finite and at least 0.001 m",
        ),
        (
            [str(rock), "-o", output, "--spacing", "0.001"],
            "up to 2,008,008 places to try (a grid of 501 by 501 points, 8 at each); the "
            "maximum is 100,000",
        ),
        ([str(rock), "-o", str(tmp_path / "x" / "holds.json")], "no such folder"),
        ([str(rock), "-o", str(tmp_path / "holds.txt")], "must end in .json"),
    ):
        assert run_command_line(["holds", *arguments]) == BAD_INPUT
        assert words in complaint(capfd)
