"""The program that a function of `planner.programs` solves, without solving it."""

from collections.abc import Callable

import pytest

from planner.programs.conic import LATE
from planner.programs.stance_program import StanceProgram


def program_of(solve: Callable, *given) -> StanceProgram:
    """Return the program that a function solves."""
    taken = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(StanceProgram, "run", lambda asked: taken.append(asked) or (LATE, None))
        solve(*given)
    return taken[0]
