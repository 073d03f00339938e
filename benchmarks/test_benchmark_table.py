"""The command that measures everything runs, and puts its tables where they belong."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from benchmarks.race import race
from benchmarks.results import BEGIN, END, Line, Table, into, markdown, span, times
from tests.suite.helpers.checkout import ROOT


def test_ways_take_turns_and_ratios_are_of_the_same_round():
    order = []
    ways = {name: lambda k, name=name: order.append((name, k)) for name in ("a", "b", "c")}
    timed = race(ways, 3)
    assert [len(timed.times[name]) for name in "abc"] == [3, 3, 3]
    # two rounds to warm up, then three that count
    assert [k for _, k in order] == [3, 3, 3, 4, 4, 4, 0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert [name for name, _ in order[6:]] == ["a", "b", "c", "b", "c", "a", "c", "a", "b"]
    order.clear()
    ticks = []
    race(ways, 3, lambda: ticks.append(1), turn=2)
    assert order[6:] == [
        *(("a", 0), ("a", 1), ("b", 0), ("b", 1), ("c", 0), ("c", 1)),
        *(("b", 2), ("c", 2), ("a", 2)),
    ]
    assert len(ticks) == 3
    timed.times.update(a=np.array([1.0, 2.0, 4.0]), b=np.array([3.0, 2.0, 2.0]))
    assert timed.median("a") == 2.0
    assert timed.ratio("b", "a") == 1.0


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(12.34, "12.3 s"), (0.9996, "1.00 s"), (0.0123, "12.3 ms"), (4.56e-5, "45.6 µs")],
)
def test_durations_have_three_digits(seconds, text):
    assert span(seconds) == text


def test_tables_are_put_between_the_marks_and_nowhere_else(tmp_path):
    file = tmp_path / "some.md"
    file.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    text = markdown([Table("Title", ("median",), [Line("this", (times(2.0),))], "Note.")])
    assert text == "**Title**\n\n| what | median |\n| --- | ---: |\n| this | 2.00 |\n\nNote.\n"
    for _ in range(2):
        into(file, text)
        assert file.read_text() == f"before\n{BEGIN}\n\n{text}\n{END}\nafter\n"
    file.write_text(f"{END} {BEGIN}")
    with pytest.raises(ValueError, match="once each"):
        into(file, "")


@pytest.mark.slow
def test_the_command_measures_every_part(tmp_path):
    pytest.importorskip("qoco")
    pytest.importorskip("pycapacity")
    page, plot = tmp_path / "performance.md", tmp_path / "growth.png"
    page.write_text(f"# crux\n\n{BEGIN}\n{END}\n")
    options = ["--quick", "--workers", "1", "--page", str(page), "--plot", str(plot)]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    text = page.read_text()
    for line in (
        "parsed request",
        "plan_many",
        "QOCO",
        "HiGHS",
        "rebuilt",
        "pycapacity",
        "hpp-centroidal",
    ):
        assert line in done.stdout
        assert line in text
    assert plot.read_bytes().startswith(b"\x89PNG")
