"""Work beside a solver: in another thread if there is time for it, and by its own caller if not."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from planner import deadline
from planner.deadline import Overlap, begin_overlap, overlap
from planner.programs import solvers
from planner.solving import KnownStance, solve
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.stances import ask, on_wall, program_data


def me() -> str:
    return threading.current_thread().name


def test_a_solver_that_runs_has_the_work_done_by_another_thread():
    data = program_data(ask(on_wall()))
    solvers.unique(data)
    with Overlap(me) as work:
        assert work.begun is None
        solvers.unique(data)
        begun = work.begun
        # the first solver has taken it
        solvers.unique(data)
        assert work.begun is begun
    assert begun.result() == work.result() != me()


def test_without_a_solver_the_caller_does_it():
    with Overlap(me) as work:
        pass
    # it is over: no later solver begins it
    begin_overlap()
    assert work.begun is None
    assert work.result() == me()


def test_who_finds_the_other_thread_busy_does_it_alone():
    free = threading.Event()
    with Overlap(free.wait) as long:
        begin_overlap()
    with Overlap(me) as work:
        begin_overlap()
    assert work.result() == me()
    free.set()
    assert long.result()


def test_what_the_work_raises_is_raised_to_its_caller():
    def fails() -> None:
        raise ZeroDivisionError

    with Overlap(fails) as work:
        begin_overlap()
    with pytest.raises(ZeroDivisionError):
        work.result()
    # the thread goes on
    with Overlap(me) as after:
        begin_overlap()
    after.begun.result()


AT_THE_END = """
import atexit
from tests.suite.helpers.stances import ask, on_wall
from planner.solving.solve import plan
asked = ask(on_wall())
first = plan(asked).utilisation
@atexit.register
def last():
    print(plan(asked).utilisation == first)
"""


def test_plans_are_made_while_the_interpreter_ends():
    ended = subprocess.run(
        [sys.executable, "-c", AT_THE_END],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "True\n", "")


def test_a_plan_is_read_and_checked_by_what_was_prepared_beside_its_solver(monkeypatch):
    threads = []
    prepare, begin = solve.prepare_checks, deadline.begin_overlap
    taken = threading.Event()

    def noted(*given):
        threads.append(me())
        taken.set()
        return prepare(*given)

    def begun():
        """Let no solver be done before the other thread has the work."""
        waits = overlap.waiting.get() is not None
        begin()
        assert not waits or taken.wait(PATIENCE)

    monkeypatch.setattr(solve, "prepare_checks", noted)
    monkeypatch.setattr(deadline, "begin_overlap", begun)
    question = ask(on_wall())
    found = solve.plan(question)
    assert found.verified
    assert len(threads) == 1
    assert threads[0] != me()
    # of a stance that is known, it is known, too
    known = KnownStance(question)
    assert threads[1:] == [me()]
    assert known.plan(known.prepared.wrench).utilisation == found.utilisation
    assert len(threads) == 2
