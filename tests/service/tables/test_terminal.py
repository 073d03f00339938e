"""Messages on standard error: wrapped at words on a terminal, one line in a file."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios

import pytest

from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import BAD_INPUT
from tests.suite.helpers.patience import PATIENCE


def told(width: int | None, *arguments: str) -> str:
    """Standard error of the command, a terminal of this width or a pipe."""
    command = [sys.executable, "-m", "service", *arguments]
    env = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    env |= {"PYTHONPATH": str(ROOT), "TERM": "xterm"}
    ours, theirs = os.pipe() if width is None else pty.openpty()
    with open(ours, "rb", buffering=0) as screen:
        if width is not None:
            fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 30, width, 0, 0))
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=theirs,
            env=env,
            cwd=ROOT,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode == BAD_INPUT
        # read what is there before the terminal closes
        said = screen.read(4096)
        os.close(theirs)
    return said.decode().replace("\r\n", "\n")


@pytest.mark.parametrize("width", [40, 100])
def test_a_terminal_has_messages_wrapped_at_words(width: int) -> None:
    wrong = ("plan", "no-such-stance-of-any-kind")
    whole, wrapped = told(None, *wrong), told(width, *wrong)
    assert whole.startswith("crux: STANCE: no such file")
    assert whole.count("\n") == 1
    assert len(whole) > width
    lines = wrapped.splitlines()
    assert len(lines) > 1
    assert max(map(len, lines)) <= width
    assert wrapped.split() == whole.split()
