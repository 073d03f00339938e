"""The ``crux`` command: its exit statuses, what it prints where, and a process that runs it."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE

DONE, FAILED, BAD_INPUT, OVERLOADED = 0, 1, 2, 3


def result(capfd: pytest.CaptureFixture[str]) -> dict:
    """The one line of JSON on standard output, with nothing on standard error."""
    out, err = capfd.readouterr()
    assert err == ""
    assert out.endswith("\n")
    assert out.count("\n") == 1
    return json.loads(out)


def complaint(capfd: pytest.CaptureFixture[str]) -> str:
    """The one line on standard error, with nothing on standard output."""
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("crux: ")
    assert err.count("\n") == 1
    return err


def process(*arguments: str, given: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    """The command in a process of its own, in the checkout."""
    return subprocess.run(
        [sys.executable, "-m", "service", *arguments],
        input=given,
        capture_output=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "80"},
        timeout=PATIENCE,
        check=False,
    )
