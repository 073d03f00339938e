"""The program that a function of `planner.programs` solves, without solving it."""

import math
from collections.abc import Callable

import pytest

from planner.programs.conic import OUT_OF_TIME, Outcome
from planner.programs.stance_program import StanceProgram


def program_of(solve: Callable, *given) -> StanceProgram:
    """Return the program that a function solves."""
    taken, late = [], Outcome(False, OUT_OF_TIME, 0, math.nan)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(StanceProgram, "run", lambda asked: taken.append(asked) or (late, None))
        solve(*given)
    return taken[0]
