"""What every command has: a version, completion, more or less said, and a status in its colour."""

from __future__ import annotations

import io
import os
import pty
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import msgspec
import pytest
from click.shell_completion import ShellComplete
from rich.console import Console

from hand_models.studies import STUDY_MODULES
from hand_models.tile import surface_names
from service.answering import planned
from service.commands.cli import COMMANDS_BY_NAME, crux, run_command_line
from service.commands.stances import bundled, limbs_of, read_request
from service.commands.studies import STUDY_NAMES, SURFACE_NAMES
from service.requests import RouteRequest
from service.tables import print_plan
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED
from tests.suite.helpers.requests import HEAVY, put, wall_request


@pytest.mark.parametrize(
    "words",
    [
        ["plan", "slab"],
        pytest.param(["redundancy", "slab"], marks=pytest.mark.slow),
        ["wrench-space", "slab", "--hand", "front_left", "--opening"],
        ["body-space", "ledge"],
        ["body-space", "ledge", "--com"],
        ["sweep", "slab", "--vary", "load.mass=100,120"],
        pytest.param(["study", "fig06"], marks=pytest.mark.slow),
    ],
    ids=" ".join,
)
def test_quiet_commands_print_no_table(words, tmp_path, capfd):
    """Tables have a rule below their heads, and a command prints some if it is not quiet."""
    folder = ["-o", str(tmp_path)] if words[0] in ("sweep", "study") else []
    status = run_command_line([*words, *folder])
    assert "───" in capfd.readouterr().out
    assert run_command_line([*words, *folder, "-q"]) == status
    out = capfd.readouterr().out
    assert "───" not in out
    # and the outcome is there
    assert len(out.split()) > 3


@pytest.mark.slow
def test_a_result_that_has_no_sentence_is_a_line_for_each_row_if_quiet(capfd):
    for quiet, times in ([], 1), (["-q"], 3):
        few = ["simulate", "slab", "--draws", "20", "--replanned", "1"]
        assert run_command_line([*few, *quiet]) == DONE
        out = capfd.readouterr().out
        assert out.count("no tile and no palm slips") == times
        assert ("───" in out) == (not quiet)


def completed(*words: str) -> list[str]:
    """Complete the last word as a shell would; what completes to a file is left out."""
    *before, begun = words
    items = ShellComplete(crux, {}, "crux", "_CRUX_COMPLETE").get_completions(before, begun)
    return [item.value for item in items if item.type == "plain"]


def test_the_version_is_that_of_the_distribution(capfd):
    assert run_command_line(["--version"]) == DONE
    assert capfd.readouterr().out == f"crux {version('crux-climb')}\n"


@pytest.mark.parametrize("command", ["plan", "query", "wrench-space", "body-space", "stream"])
def test_names_of_stances_are_completed(command):
    assert completed(command, "") == list(bundled())
    assert completed(command, "wall-300-") == ["wall-300-floating", "wall-300-joints"]


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["plan", "wall-300-"], ["wall-300-floating", "wall-300-joints"]),
        (["wrench-space", "boulders", "--hand", "front_"], ["front_right", "front_left"]),
    ],
)
def test_bash_offers_the_names(words, names, tmp_path):
    command = Path(sys.executable).with_name("crux")
    script = f"""
        PATH={shlex.quote(str(command.parent))}:$PATH
        eval "$(_CRUX_COMPLETE=bash_source crux)"
        COMP_WORDS=(crux {shlex.join(words)}) COMP_CWORD={len(words)} COMPREPLY=()
        _crux_completion crux
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    told = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert sorted(told.stdout.split()) == sorted(names)


def test_names_of_commands_routes_and_studies_are_completed():
    assert completed("") == sorted(COMMANDS_BY_NAME)
    assert completed("s") == ["schema", "screen", "serve", "simulate", "stream", "study", "sweep"]
    assert completed("route", "") == list(bundled(RouteRequest))
    assert completed("study", "fig1") == [name for name in STUDY_NAMES if name.startswith("fig1")]


def test_names_that_completion_knows_are_all_there_are():
    assert (*STUDY_MODULES, "measure") == STUDY_NAMES
    assert surface_names() == SURFACE_NAMES


def test_limbs_are_those_of_the_stance(stance_file):
    assert completed("wrench-space", "wall-300", "--hand", "") == [*limbs_of("wall-300")]
    assert set(limbs_of("wall-300")) == set(limbs_of(None))
    limbs = ("nose", "tail")
    request = wall_request()
    for i, limb in enumerate(limbs):
        request = put(request, ("stance", "hands", i, "limb"), limb)
    del request["stance"]["hands"][2:]
    assert completed("wrench-space", stance_file(request), "--hand", "") == ["nose", "tail"]
    assert completed("wrench-space", "no-such-file", "--hand", "rear") == [
        "rear_right",
        "rear_left",
    ]


@pytest.mark.slow
def test_less_is_said_where_asked(stance_file, capfd):
    words = ["plan", stance_file(wall_request(HEAVY))]
    assert run_command_line(words) == OVERLOADED
    whole = capfd.readouterr().out.splitlines()
    for place in (0, 1):
        assert run_command_line([*words[:place], "--quiet", *words[place:]]) == OVERLOADED
        out, error = capfd.readouterr()
        assert out.startswith("OVERLOADED ")
        assert len(out.splitlines()) < 5 < len(whole)
        assert error == ""
    # an error is said all the same
    assert run_command_line(["-q", "plan", "nowhere"]) == BAD_INPUT
    assert len(capfd.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("place", [0, 1])
def test_more_is_said_where_asked(place, stance_file, capfd):
    words = ["plan", stance_file(wall_request())]
    assert run_command_line(words) == DONE
    assert capfd.readouterr().err == ""
    assert run_command_line([*words[:place], "-v", *words[place:]]) == DONE
    solver, time = capfd.readouterr().err.splitlines()
    assert "iterations" in solver
    assert solver.startswith("crux: ")
    assert time.startswith("crux: took ")


RED, GREEN = "\x1b[1;31m", "\x1b[1;32m"


@pytest.mark.parametrize(
    ("status", "colour"),
    [("optimal", GREEN), ("overloaded", RED), ("infeasible", RED), ("failed", RED)],
)
def test_a_status_has_its_colour(status, colour):
    reply = planned(read_request("wall-300")).reply
    reply = msgspec.structs.replace(reply, status=status)
    out = Console(file=io.StringIO(), force_terminal=True, color_system="standard", no_color=False)
    print_plan(reply, out, brief=True)
    assert out.file.getvalue().startswith(f"{colour}{status.upper()}\x1b[0m")


def on_a_terminal(
    arguments: Sequence[str], stream: str = "stdout", status: int = DONE, **more: str
) -> str:
    """What a command writes to a terminal that one of its streams is."""
    ours, theirs = pty.openpty()
    env = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
    process = subprocess.Popen(
        [sys.executable, "-c", "from service.__main__ import main; main()", *arguments],
        cwd=ROOT,
        env=env | {"TERM": "xterm", "COLUMNS": "80"} | more,
        **{"stdout": subprocess.DEVNULL, stream: theirs},
    )
    os.close(theirs)
    told = b""
    try:
        # while it runs: a terminal that nobody reads is soon full
        while part := os.read(ours, 1 << 16):
            told += part
    except OSError:
        # Linux says so where nothing more can come
        pass
    assert process.wait() == status
    os.close(ours)
    return told.decode()


@pytest.mark.skipif(sys.platform == "win32", reason="no terminals of this kind")
def test_colours_are_for_terminals_and_for_who_wants_them():
    words = ["-q", "plan", "wall-300"]
    assert f"{GREEN}OPTIMAL" in on_a_terminal(words)
    assert "\x1b[1;32m" not in on_a_terminal(words, NO_COLOR="1")
    piped = subprocess.run(
        [sys.executable, "-c", "from service.__main__ import main; main()", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert piped.stdout.startswith("OPTIMAL ")
    assert "\x1b" not in piped.stdout


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no terminals of this kind")
def test_a_terminal_shows_that_advice_is_looked_for(stance_file):
    words = ["plan", stance_file(wall_request(HEAVY))]
    assert "searching for feasible changes" in on_a_terminal(words, "stderr", OVERLOADED)
    assert on_a_terminal(["-q", *words], "stderr", OVERLOADED) == ""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no terminals of this kind")
def test_a_study_shows_how_far_it_is(tmp_path):
    words = ["study", "fig06", "-o", str(tmp_path)]
    told = on_a_terminal(words, stream="stderr")
    assert "fig06" in told
    assert "%" in told
    assert on_a_terminal(["-q", *words], stream="stderr") == ""


def test_numbers_in_doubt_are_named_even_where_less_is_said(stance_file, capfd):
    request = put(wall_request(), ("body_wrench",), [1.09, 0, 0, 0, -0.144, 0])
    request.pop("load", None)
    path = stance_file(request)
    for command in ("plan", "body-space"):
        assert run_command_line([command, path, "-q"]) == DONE
        out, error = capfd.readouterr()
        (line,) = error.splitlines()
        assert line.startswith("crux: warning: body_wrench: it holds up 1.09 N")
        assert "warning" not in out
        # with tables all warnings are among these, once
        assert run_command_line([command, path]) == DONE
        out, error = capfd.readouterr()
        assert "".join(out.split()).count("isitinN,orinkN?") == 1
        assert "body_wrench" not in error


def test_a_stream_names_a_number_in_doubt_once(capfd, monkeypatch):
    lines = b"[1.09,0,0,0,-0.144,0]\n[1.2,0,0,0,-0.144,0]\n[-1082,0,0,0,144,0]\n"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(lines)))
    assert run_command_line(["stream", "wall-300", "-q"]) in {DONE, OVERLOADED}
    first, other = capfd.readouterr().err.splitlines()
    assert first.startswith("crux: line 1: warning: body_wrench: it holds up 1.09 N")
    assert first.endswith("is it in N, or in kN?")
    assert other.startswith("crux: line 3: warning: body_wrench: a force of 1082 N")
