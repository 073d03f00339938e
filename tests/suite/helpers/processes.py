"""The ``crux`` command in a session of its own, to be watched and interrupted."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE, PAUSES, soon

PROC = Path("/proc")

watched = pytest.mark.skipif(not (PROC / "self/stat").exists(), reason="needs /proc")


def ran(tmp_path: Path, program: str) -> subprocess.CompletedProcess[str]:
    """A program of a user's own, in a file, that has ended by itself."""
    path = tmp_path / "program.py"
    path.write_text(program)
    return subprocess.run(
        [sys.executable, str(path)],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        timeout=PATIENCE,
        check=False,
    )


def begun(*arguments: str, before: str = "", **more: object) -> subprocess.Popen[bytes]:
    """A command that has just been started, in a process that runs some code before it."""
    return subprocess.Popen(
        [sys.executable, "-c", f"{before}\nfrom service.__main__ import main; main()", *arguments],
        cwd=ROOT,
        # a command whose files cannot grow would leave half of its modules' code
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "80", "PYTHONDONTWRITEBYTECODE": "1"},
        start_new_session=True,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | more,
    )


def until(true: Callable[[], object], process: subprocess.Popen[bytes]) -> None:
    """Wait for something that comes before the process ends."""

    def came() -> bool:
        if true():
            return True
        assert process.poll() is None, process.communicate()
        return False

    # what a process does meanwhile may be over soon
    assert soon(came, longest=PAUSES[0])


def alive(session: int) -> dict[int, tuple[int, str]]:
    """Parent and command line of the processes of a session that have not ended."""
    found = {}
    for pid in map(int, filter(str.isdigit, os.listdir(PROC))):
        try:
            # one system call: tests ask often, beside the processes that they wait for
            if os.getsid(pid) != session:
                continue
            entry = PROC / str(pid)
            state, parent = (entry / "stat").read_text().rpartition(")")[2].split()[:2]
            if state != "Z":
                words = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                found[pid] = int(parent), words
        except (OSError, ValueError):
            continue
    return found


def workers(process: subprocess.Popen[bytes]) -> list[int]:
    """Processes that work for a command."""
    own = alive(process.pid)
    # those that are forked keep the words of the one that they are forked from
    forked = {pid for pid, (_, words) in own.items() if "forkserver import main" in words}
    return [
        pid
        for pid, (parent, words) in own.items()
        if "spawn_main" in words or (pid in forked and parent in forked)
    ]


def loaded(process: subprocess.Popen[bytes], library: str) -> bool:
    """Whether a process has a library in its memory."""
    return library in (PROC / str(process.pid) / "maps").read_text()


def ended(process: subprocess.Popen[bytes]) -> tuple[int, str]:
    """Its status, and what it says on standard error, once all its processes have ended."""
    _, error = process.communicate(timeout=PATIENCE)
    assert soon(lambda: not alive(process.pid)), alive(process.pid)
    return process.returncode, error.decode()
