"""The programs solved: each is built once for a shape of stance, kept, and given new data after.

Programs have room for more than a stance, and one serves nearly all stances of so many hands
(`Shape.with_room`).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from typing import Any, Final, TypeVar

import numpy as np

from hand_models.base import Array
from planner import deadline
from planner.programs.outcome import LATE, Outcome, Reached
from planner.programs.program import (
    Curved,
    Effort,
    LoadFactor,
    Margin,
    Nearest,
    Reach,
    TieBreak,
    Unique,
)
from planner.programs.stance_data import ROOM, Shape, StanceData
from planner.programs.stance_program import StanceProgram

__all__ = [
    "SLACK",
    "build_ahead",
    "building",
    "built",
    "curved",
    "effort",
    "least_tensions",
    "load_factor",
    "margin",
    "nearest",
    "nearest_body",
    "reach",
    "tie_break",
    "unique",
]

SLACK: Final = 1e-6
"""What the tie-break may give away of the least utilisation; also its tolerance at a cap."""

SHARP_SLACK: Final = 1e-9
"""The same where the least utilisation has all its digits."""

_builders = [ThreadPoolExecutor(1, "program-builder")]
"""The one thread that builds programs: CVXPY counts its variables for all threads, and loses count
where two build at a time. Who cannot wait for it goes on without."""

P = TypeVar("P", bound=StanceProgram)


def built(kind: type[P], shape: Shape, *further: int) -> P | None:
    """Return a program for a shape, built on first use and kept.

    It has room for other shapes, if there is a map to leave out what is not there. None if the
    deadline comes before: it will be there for a later question.
    """
    program = _awaited(kind, shape.with_room(), *further)
    if program is not None and program.compiled.map is None:
        program = _awaited(kind, shape, *further)
    return program


def _awaited(kind: type[P], shape: Shape, *further: int) -> P | None:
    """Return the program for that very shape; None if the deadline comes before."""
    try:
        program = building(kind, shape, *further).result(deadline.left())
    except TimeoutError:
        return None
    assert isinstance(program, kind)
    return program


@lru_cache(maxsize=128)
def building(kind: type[StanceProgram], shape: Shape, *further: int) -> Future[StanceProgram]:
    """Begin to build the program for that very shape, once; return what will be it.

    Parameters
    ----------
    kind : type of StanceProgram
    shape : Shape
    *further : int
        Of the kind, beside the shape.
    """
    return _builders[0].submit(kind, shape, *further)


def build_ahead(hands: int) -> None:
    """Begin to build what plans of up to so many hands with fixed wrists need; do not wait for it.

    So the first of them need not wait for it either.
    """
    for count in range(hands, 0, -1):
        room = Shape(6, (ROOM,) * count)
        for kind in (Unique, LoadFactor):
            building(kind, room)


def _after_fork() -> None:
    """Begin anew in a forked process: threads, and what they held, did not come along."""
    _builders[0] = ThreadPoolExecutor(1, "program-builder")
    building.cache_clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _ask(kind: Any, data: StanceData, *question: Any, further: Sequence[int] = ()) -> Outcome:
    """Solve a program of that kind, if it is there in time."""
    program = built(kind, data.shape, *further)
    outcome: Outcome = LATE if program is None else program.solve(data, *question)
    return outcome


def margin(data: StanceData) -> Outcome:
    """Solve `Margin`, built once for each shape."""
    return _ask(Margin, data)


def unique(data: StanceData, share: float = 1.0) -> Outcome:
    """Solve `Unique`, built once for each shape."""
    return _ask(Unique, data, share)


def curved(data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
    """Solve `Curved`, built once for each shape."""
    return _ask(Curved, data, root, near)


def tie_break(data: StanceData, cap: float) -> Outcome:
    """Solve `TieBreak`, built once for each shape."""
    return _ask(TieBreak, data, cap)


def least_tensions(data: StanceData, utilisation: float) -> Outcome:
    """Solve `TieBreak` at a utilisation that has all its digits, or where needed near it."""
    outcome = LATE
    for slack in (SHARP_SLACK, SLACK):
        outcome = tie_break(data, utilisation + slack * max(1.0, abs(utilisation)))
        if outcome.solved or deadline.expired():
            break
    return outcome


def effort(data: StanceData, cap: float) -> Outcome:
    """Solve `Effort`, built once for each shape."""
    return _ask(Effort, data, cap)


def load_factor(data: StanceData) -> Outcome:
    """Solve `LoadFactor`, built once for each shape."""
    return _ask(LoadFactor, data)


def reach(
    data: StanceData, goal: Array, B: Array, cap: float = 1.0, K: Sequence[Array] | None = None
) -> Reached:
    """Solve `Reach`, built once for each shape."""
    program = built(Reach, data.shape, len(goal))
    if program is None:
        return Reached(LATE, np.full(len(goal), np.nan))
    return program.solve(data, goal, B, cap, K)


def nearest(data: StanceData) -> Outcome:
    """Solve `Nearest`, built once for each shape."""
    return _ask(Nearest, data)


def nearest_body(data: StanceData) -> Outcome:
    """Solve `Nearest` with all given wrenches of hands kept, built once for each shape."""
    return _ask(Nearest, data, further=(len(data.wrench) - 6,))
