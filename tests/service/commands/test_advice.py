"""``crux plan --advice``: what is told, what is written, and when it is looked for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import trimesh

from service import answering
from service.commands.cli import run_command_line
from tests.suite.helpers.commands import (
    BAD_INPUT,
    DONE,
    OVERLOADED,
    complaint,
    result,
)
from tests.suite.helpers.requests import (
    HEAVY,
    wall_request,
)
from tests.suite.helpers.rocks import cylinder_mesh

OVER = 120.0
"""Mass [kg] that is so little too much for four pinches that single changes help."""


@pytest.mark.parametrize(
    ("stance", "what"),
    [
        ("wall-300", "better (utilisation "),
        pytest.param("boulders", "feasible (utilisation ", marks=pytest.mark.slow),
    ],
)
def test_advice_is_written_as_requests_whose_plans_give_what_is_printed(
    stance, what, tmp_path, capfd
):
    run_command_line(["plan", stance, "--advice", str(tmp_path / "advised")])
    lines = capfd.readouterr().out.splitlines()
    files = sorted((tmp_path / "advised").iterdir(), key=lambda file: (len(file.name), file.name))
    assert len([line for line in lines if line.startswith(what)]) == 3
    # the last lines tell what is in which file
    for line, file in zip(lines[-len(files) :], files, strict=True):
        less = line.startswith(f"{file}: less overloaded")
        assert run_command_line(["plan", str(file), "--json"]) == (OVERLOADED if less else DONE)
        used = f"{result(capfd)['utilisation']:.2f}"
        found = "less overloaded (utilisation " if less else what
        assert line.startswith(f"{file}: {found}{used})")


@pytest.mark.usefixtures("few_changes")
def test_advice_leaves_a_scan_in_its_file(tmp_path, capfd):
    folder = tmp_path / "stances"
    folder.mkdir()
    vertices, faces = cylinder_mesh(0.3, 64)
    trimesh.Trimesh(vertices, faces, process=False).export(folder / "log.ply")
    request = wall_request(OVER)
    hand = request["stance"]["hands"][0]
    hand["hold"] = {"shape": "mesh", "file": "log.ply"}
    (folder / "stance.json").write_text(json.dumps(request))
    run_command_line(
        ["plan", str(folder / "stance.json"), "--advice", str(tmp_path / "advised"), "-q"]
    )
    capfd.readouterr()
    files = list((tmp_path / "advised").iterdir())
    assert files
    for file in files:
        holds = [each["hold"] for each in json.loads(file.read_text())["stance"]["hands"]]
        meshes = [hold for hold in holds if hold["shape"] == "mesh"]
        assert all("vertices" not in hold for hold in meshes)
        assert all((file.parent / hold["file"]).samefile(folder / "log.ply") for hold in meshes)
    assert run_command_line(["plan", str(files[0]), "--json"]) in (DONE, OVERLOADED)


@pytest.mark.usefixtures("few_changes")
def test_a_stance_may_be_gone_while_advice_is_sought(stance_file, tmp_path, capfd, monkeypatch):
    path = stance_file(wall_request(OVER))
    planned = answering.planned

    def then_gone(*args: object) -> object:
        Path(path).unlink()
        return planned(*args)

    monkeypatch.setattr(answering, "planned", then_gone)
    assert (
        run_command_line(["plan", path, "--advice", str(tmp_path / "advised"), "-q"]) == OVERLOADED
    )
    assert list((tmp_path / "advised").iterdir())
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("few_changes")
def test_the_plan_is_printed_before_advice_is_looked_for(stance_file, tmp_path, capfd, monkeypatch):
    looked, told = answering.answer_with_advice, []

    def looks(answer: answering.Planned) -> answering.Planned:
        told.append(capfd.readouterr())
        return looked(answer)

    monkeypatch.setattr(answering, "answer_with_advice", looks)
    path = stance_file(wall_request(OVER))
    for number, more in enumerate(([], ["-q", "--advice", str(tmp_path)])):
        assert run_command_line(["plan", path, *more]) == OVERLOADED
        assert len(told) == number + 1
        out, err = told[-1]
        assert out.startswith("OVERLOADED ")
        assert err == ""
        assert ("tension N" in out) == ("-q" not in more)
        assert "(utilisation " not in out
        assert "(utilisation " in capfd.readouterr().out


@pytest.mark.usefixtures("few_changes")
def test_json_is_one_line_with_the_advice_in_it(stance_file, tmp_path, capfd):
    path = stance_file(wall_request(OVER))
    assert run_command_line(["plan", path, "--json", "--advice", str(tmp_path)]) == OVERLOADED
    assert result(capfd)["advice"]
    assert run_command_line(["plan", path, "--json"]) == OVERLOADED
    assert "advice" not in result(capfd)


@pytest.mark.usefixtures("few_places", "few_changes")
def test_a_file_of_advice_is_the_stance_but_for_its_changes(stance_file, tmp_path, capfd):
    given = wall_request(HEAVY)
    given = dict(reversed(given.items())) | {"limits": {"utilisation": 1}}
    given["stance"] = dict(reversed(given["stance"].items()))
    path = stance_file(given)
    run_command_line(["plan", path, "--json", "--robust", "--advice", str(tmp_path / "advised")])
    found = result(capfd)["advice"]
    assert len(found) > 3
    for i, advice in enumerate(found):
        text = (tmp_path / "advised" / f"advice-{i + 1}.json").read_text("utf-8")
        written = json.loads(text)
        assert [*written] == [*given, *([] if "load" in given else ["load"])][: len(written)]
        assert '"utilisation": 1\n' in text
        changed = {name.split(".")[0].split("[")[0] for name in advice["changes"]}
        assert {part for part in written if written[part] != given.get(part)} <= changed


@pytest.mark.usefixtures("few_changes")
def test_who_asks_for_less_waits_for_no_advice(stance_file, capfd, monkeypatch):
    asked: list[object] = []
    monkeypatch.setattr(
        answering, "answer_with_advice", lambda answer: asked.append(answer) or answer
    )
    path = stance_file(wall_request(OVER))
    assert run_command_line(["plan", path, "-q"]) == OVERLOADED
    assert not asked
    assert run_command_line(["plan", path]) == OVERLOADED
    assert len(asked) == 1
    capfd.readouterr()


def test_nothing_is_said_of_changes_that_nobody_asked_for(capfd):
    assert run_command_line(["plan", "wall-300"]) == DONE
    assert "changes" not in capfd.readouterr().out


@pytest.mark.usefixtures("few_changes")
def test_a_folder_has_the_advice_about_this_stance_and_none_of_another(
    stance_file, tmp_path, capfd
):
    folder, path = tmp_path / "advice", stance_file(wall_request(OVER))
    folder.mkdir()
    for name in ("advice-1.json", "advice-99.json", "advice-mine.json"):
        (folder / name).write_text("{}")
    assert run_command_line(["plan", path, "--advice", str(folder), "--json"]) == OVERLOADED
    told = result(capfd)["advice"]
    names = {f"advice-{i + 1}.json" for i in range(len(told))}
    assert {file.name for file in folder.iterdir()} == names | {"advice-mine.json"}
    assert told
    run_command_line(["plan", str(folder / "advice-1.json"), "--json"])
    assert result(capfd)["utilisation"] == pytest.approx(told[0]["utilisation"], abs=1e-6)


def test_advice_that_a_brief_reply_does_not_tell_cannot_be_written(stance_file, tmp_path, capfd):
    path, folder = stance_file(wall_request(OVER) | {"detail": "set_points"}), tmp_path / "advice"
    assert run_command_line(["plan", path, "--advice", str(folder), "--json"]) == BAD_INPUT
    assert "detail: --advice requires the full reply" in complaint(capfd)
    assert not folder.exists()
