"""What is loaded when: libraries that one answer can do without are loaded where they are used."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import click
import pytest

from service.commands.cli import COMMANDS_BY_NAME, crux
from tests.suite.helpers.checkout import ROOT

HEAVY = ("scipy", "trimesh", "cvxpy", "pinocchio", "matplotlib", "numba")
COMMAND = "from service.__main__ import main; main()"


def loaded(code: str, *arguments: str, env: dict[str, str] | None = None) -> set[str]:
    """Modules that a program has loaded when it ends, whatever it prints."""
    code = f"""
import atexit, json, sys
atexit.register(lambda: print("\\n" + json.dumps(list(sys.modules))))
{code}
"""
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        env=env,
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_a_name_of_an_index_is_had_without_the_libraries_behind_others() -> None:
    for statement, absent in [
        ("from service import CruxClient", (*HEAVY, "numpy", "rich", "planner.solving")),
        (
            "from service import PlanRequest, ServiceError",
            (*HEAVY, "numpy", "zenoh", "planner.solving"),
        ),
        ("from hand_models import Pose, Cylinder", (*HEAVY, "hand_models.hand")),
        (
            "from planner import Load, Limits",
            ("scipy.optimize", "trimesh", "numba", "cvxpy", "clarabel", "planner.solving"),
        ),
        ("from planner import plan", ("scipy.sparse", "trimesh", "numba", "cvxpy", "matplotlib")),
    ]:
        assert not {*absent} & loaded(statement)


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], []])
def test_the_command_tells_of_itself_without_numbers(arguments: list[str]) -> None:
    code = f"""
import contextlib
with contextlib.suppress(SystemExit):
    {COMMAND.replace("; ", chr(10) + "    ")}
"""
    assert not {*HEAVY, "numpy", "msgspec", "zenoh", "rich"} & loaded(code, *arguments)


def test_completion_waits_for_no_numbers() -> None:
    for words in [
        "crux pl",
        "crux study f",
        "crux route s",
        "crux holds wall.ply --s",
        "crux wrench-space wall-300 --hand f",
        "crux stream w",
        "crux serve --",
    ]:
        last = len(words.split()) - 1
        asked = {"_CRUX_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(last)}
        assert not {*HEAVY, "numpy", "rich"} & loaded(COMMAND, env=os.environ | asked)


def test_one_plan_loads_what_it_needs() -> None:
    found = loaded(COMMAND, "plan", "wall-300", "--json")
    assert {"numpy", "clarabel"} <= found
    absent = {"trimesh", "numba", "cvxpy", "matplotlib", "distributed", "pyarrow", "rich", "pandas"}
    absent |= {f"scipy.{name}" for name in ("linalg", "optimize", "sparse", "spatial", "special")}
    assert not absent & found


def test_a_process_of_the_service_has_all_of_it_before_the_first_question() -> None:
    code = "from service.processes import answering; answering(None, None)"
    found = loaded(code)
    # CVXPY is for what the fast ways leave over: whoever meets that loads it
    assert {"trimesh", "scipy.optimize", "scipy.spatial", "clarabel", "highspy"} <= found
    compiled = {f"hand_models.rock.compiled_{part}" for part in ("cells", "cuts", "smoothing")}
    assert compiled <= found


def test_what_is_told_of_a_command_is_how_its_own_help_begins() -> None:
    for name in COMMANDS_BY_NAME:
        with click.Context(crux) as context:
            command = crux.get_command(context, name)
        assert command is not None
        assert command.name == name
        assert COMMANDS_BY_NAME[name].words == command.get_short_help_str(1000)


def test_threads_may_be_the_first_to_solve() -> None:
    code = """
import sys, threading
import planner, scipy
sys.setswitchinterval(1e-5)
failed = []
def use(path):
    found = scipy
    try:
        for part in path.split("."):
            found = getattr(found, part)
    except BaseException as error:
        failed.append(repr(error))
paths = ["optimize.linprog", "spatial.ConvexHull", "linalg.lapack.dpotrf", "sparse.csr_array",
         "spatial.transform.Rotation", "special.ndtri", "stats.qmc", "ndimage.correlate1d"]
threads = [threading.Thread(target=use, args=(path,)) for path in 2 * paths]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(failed)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
