"""The one place where the suite reaches the code: messages, command lines, and nothing else."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

from click.testing import CliRunner

from hand_models.experiments import pulling
from hand_models.studies import load_study
from service.answering import dispatch
from service.commands.cli import run_command_line

__all__ = ["KEYS", "ask"]

KEYS = ("plan", "wrench_space", "body_space")
"""Fields of a problem that are messages at the key of that name."""

ROBOTS = Path(__file__).parent / "robots"
"""Where the files are that command lines name."""


def ask(problem: dict[str, Any]) -> dict[str, Any]:
    """Return what the code says of a problem, whole.

    Parameters
    ----------
    problem : dict
        With one of the fields ``plan``, ``wrench_space``, ``body_space`` (a request), ``stream``
        (its declaration; ``set_points`` are body wrenches for it), ``payload`` (text, sent to
        ``key`` as it is) and ``command`` (arguments; ``stdin`` is a request for it, ``coarse``
        numbers of the study's module).
    """
    if "command" in problem:
        return _command(problem)
    if "stream" in problem:
        return _stream(problem["stream"], problem["set_points"])
    if "payload" in problem:
        return _message(problem["key"], problem["payload"])
    (key,) = (key for key in KEYS if key in problem)
    return _message(key, json.dumps(problem[key]))


def _message(key: str, payload: str) -> dict[str, Any]:
    return json.loads(dispatch.handle(f"crux/robosimian/{key}", payload.encode()).payload)


def _stream(request: dict[str, Any], wrenches: list[list[float]]) -> dict[str, Any]:
    declared = _message("stream", json.dumps(request))
    if "error" in declared:
        return declared
    asked = ({"v": 1, "stream": declared["stream"], "body_wrench": w} for w in wrenches)
    points = [_message("set_points", json.dumps(request)) for request in asked]
    return {"declared": declared, "points": points}


def _command(problem: dict[str, Any]) -> dict[str, Any]:
    """Run a command line; its JSON, its tables and its exit status are the answer."""
    arguments = [str(ROBOTS / a) if a.endswith(".toml") else a for a in problem["command"]]
    given = json.dumps(problem["stdin"]) if "stdin" in problem else None
    with _coarse(problem), TemporaryDirectory() as folder:
        if arguments[0] in ("route", "study"):
            arguments += ["-o", folder]
        with CliRunner().isolation(given) as (out, *_):
            status = run_command_line([*arguments, "--json"])
            told = out.getvalue().decode("utf-8").splitlines()
        tables = {
            file.name: [
                {name: _cell(text) for name, text in row.items()}
                for row in csv.DictReader(file.read_text(encoding="utf-8").splitlines())
            ]
            for file in sorted(Path(folder).glob("*.csv"))
        }
    # before click 8.2, what goes to standard error is among it
    said = [json.loads(line) for line in told if line.startswith("{")]
    return {"exit": status, "said": said, **tables}


def _cell(text: str) -> str | float:
    """Return a table's cell, as a number if it is one."""
    try:
        return float(text)
    except ValueError:
        return text


@contextmanager
def _coarse(problem: dict[str, Any]) -> Iterator[None]:
    """Make a study coarser while it runs."""
    numbers = problem.get("coarse")
    if not numbers:
        yield
        return
    study = load_study(problem["command"][1])
    with ExitStack() as patched:
        # figures share their search and pull
        for module, name in ((study, "STUDY_SETTINGS"), (pulling, "PULLING_SETTINGS")):
            settings = getattr(module, name)
            own = {key: value for key, value in numbers.items() if hasattr(settings, key)}
            patched.enter_context(patch.object(module, name, replace(settings, **own)))
        yield
