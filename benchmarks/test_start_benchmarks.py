"""Processor time of whole commands, from their start: their ratios are what the table tells.

``python -m pytest benchmarks/test_start_benchmarks.py --benchmark-enable -n 0 -m slow``
"""

from __future__ import annotations

import resource
import subprocess
import sys

import pytest

from tests.suite.helpers.checkout import ROOT

pytestmark = pytest.mark.slow

COMMAND = "from service.__main__ import main; main()"


def children() -> float:
    """Processor time of all processes that were started and have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@pytest.mark.benchmark(
    group="start", timer=children, min_rounds=5, max_time=1.0, calibration_precision=1
)
@pytest.mark.parametrize(
    "words",
    [
        ("import click",),
        ("import numpy",),
        ("from service import CruxClient",),
        (COMMAND, "--help"),
        (COMMAND, "--version"),
        (COMMAND, "plan", "wall-300"),
    ],
    ids=lambda words: " ".join(("crux", *words[1:])) if words[0] == COMMAND else words[0],
)
def test_start(benchmark, words: tuple[str, ...]) -> None:
    def run() -> None:
        subprocess.run([sys.executable, "-c", *words], cwd=ROOT, capture_output=True, check=True)

    benchmark.pedantic(run, rounds=5, warmup_rounds=1)
