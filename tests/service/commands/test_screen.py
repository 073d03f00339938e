"""``crux screen``: lists and folders of stances, exit statuses, and what is wrong with some."""

import json

import msgspec
import numpy as np
import pytest

from service.commands.cli import run_command_line
from service.commands.stances import read_request

DONE, BAD_INPUT, OVERLOADED = 0, 2, 3


def texts(name, count):
    """Plan requests of a bundled stance with the body moved, as JSON."""
    rng, request = np.random.default_rng(1), msgspec.to_builtins(read_request(name))
    place, found = np.array(request["stance"]["body"]["position"]), []
    for _ in range(count):
        request["stance"]["body"]["position"] = (place + rng.uniform(-0.1, 0.1, 3)).tolist()
        found.append(json.dumps(request))
    return found


def planned(text, tmp_path, capsys):
    (tmp_path / "one.json").write_text(text)
    run_command_line(["plan", str(tmp_path / "one.json"), "--json", "--no-explain"])
    return json.loads(capsys.readouterr().out)["load_factor"]


def test_ranks_lines_and_files_alike(tmp_path, capsys):
    asked = texts("slab", 4) + texts("overhang", 2)
    factors = [planned(text, tmp_path, capsys) for text in asked]
    best = int(np.argmax(factors))
    (tmp_path / "some.jsonl").write_text("\n".join(asked))
    assert run_command_line(["screen", str(tmp_path / "some.jsonl"), "--json"]) == DONE
    found = json.loads(capsys.readouterr().out)
    assert found["best"][0] == f"line {best + 1}"
    assert found["proven"]
    assert found["ranking"][0]["load_factor"] == pytest.approx(factors[best], rel=1e-6)
    assert found["candidates"] == len(found["ranking"]) == len(asked)
    for row in found["ranking"]:
        assert row["bound"] >= factors[int(row["candidate"].split()[1]) - 1] - 1e-6
    folder = tmp_path / "stances"
    folder.mkdir()
    for i, text in enumerate(asked):
        (folder / f"{i}.json").write_text(text)
    assert run_command_line(["screen", str(folder), "--best", "2", "--within", "0.1%"]) == DONE
    out = capsys.readouterr().out
    assert f"{best}.json is the best: no other has a load factor above {factors[best]:.4f}" in out
    assert "stances needed a program" in out


def test_leaves_out_what_cannot_be_planned_and_says_so(tmp_path, capfd):
    (good,), (floating,) = texts("wall-300", 1), texts("wall-300-floating", 1)
    (tmp_path / "some.jsonl").write_text("\n".join(["{}", floating, good]))
    assert run_command_line(["screen", str(tmp_path / "some.jsonl"), "--json"]) == DONE
    found = json.loads(capfd.readouterr().out)
    assert found["best"] == ["line 3"]
    assert set(found["faults"]) == {"line 1", "line 2"}
    assert run_command_line(["screen", str(tmp_path / "some.jsonl")]) == DONE
    assert "1 more cannot be planned" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("content", "status", "told"),
    [("", BAD_INPUT, "has no stances"), ("{}", BAD_INPUT, "line 1"), (None, BAD_INPUT, "No such")],
)
def test_refuses_what_cannot_be_read(tmp_path, capfd, content, status, told):
    path = tmp_path / "some.jsonl"
    if content is not None:
        path.write_text(content)
    assert run_command_line(["screen", str(path)]) == status
    assert told in capfd.readouterr().err


def test_ends_with_3_where_nothing_holds(tmp_path, capfd):
    (tmp_path / "some.jsonl").write_text(texts("wall-300-floating", 1)[0])
    assert run_command_line(["screen", str(tmp_path / "some.jsonl")]) == OVERLOADED
    told = capfd.readouterr()
    assert "no stance has a load factor" in told.out
    assert "set wrist to 'fixed'" in told.err


def test_a_part_of_all_or_more_is_refused(capfd):
    assert run_command_line(["screen", "none.jsonl", "--within", "5"]) == BAD_INPUT
    assert "--within: must be less than 100 %, got '5'" in capfd.readouterr().err
