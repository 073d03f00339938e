"""Random stances, planned, and what solvers take for them: our scaling, and SI data as they are.

One to four hands with fixed wrists on random holds of a random wall, under the robot's own weight
or a body wrench that the hands can give.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from benchmarks.plain_programs import Clarabel, Conic, scaled, si, unique
from benchmarks.results import Line, Table
from planner.prepare import Sets, assemble
from planner.programs import LOAD_UNIT, program
from planner.solving import plan
from tests.suite.helpers.stances import random_question

__all__ = ["Answer", "answer", "answers", "iteration_tables"]

WORDS = {"Solved": "solved", "AlmostSolved": "almost solved", "PrimalInfeasible": "infeasible"}
"""Shorter than the solver's."""

CHUNK = 8
"""Stances that a worker takes at a time."""


class Count(NamedTuple):
    """One solve.

    Attributes
    ----------
    iterations : int
    status : str
        The solver's word.
    error : float
        Of the tensions, as far as they are from those of the plan [N]; NaN without a plan.
    """

    iterations: int
    status: str
    error: float


class Answer(NamedTuple):
    """What became of a random stance.

    Attributes
    ----------
    seed : int
    plan : Count
    reason : str
        Of the plan.
    scaled : Count
        Its program in our scaling, with the planner's settings.
    si : Count
        In SI units, with the solver's own settings.
    sharp : Count
        The same with the planner's tolerances.
    """

    seed: int
    plan: Count
    reason: str
    scaled: Count
    si: Count
    sharp: Count


def answer(seed: int) -> Answer:
    """Plan a random stance, and count."""
    question = random_question(seed)
    found = plan(question)
    tensions = np.array(
        [[finger.tendon_tension for finger in hand.fingers] for hand in found.hands or ()]
    )
    _, hands = assemble(question, None, question.needed_wrench())
    sets = hands.sets(hands.at_rest())
    settings = program.SHARP_SETTINGS
    tolerances = {name: value for name, value in settings.items() if name.startswith("tol_")}
    plain = unique(si(question, sets))
    return Answer(
        seed,
        Count(found.solver.iterations, found.status, 0.0 if len(tensions) else np.nan),
        found.reason,
        _count(unique(scaled(sets)), settings, sets, LOAD_UNIT, tensions),
        _count(plain, {}, sets, 1.0, tensions),
        _count(plain, tolerances, sets, 1.0, tensions),
    )


def _count(
    conic: Conic, settings: Mapping[str, Any], sets: Sets, unit: float, tensions: np.ndarray
) -> Count:
    ended = Clarabel([conic], settings).fresh(0)
    error = np.nan
    if len(tensions) and str(ended.status) in ("Solved", "AlmostSolved"):
        firsts = np.cumsum([0, *(len(space.columns) for space in sets.spaces[:-1])])
        # the tensions come first of each hand's loads
        found = unit * np.array(ended.x)[firsts[:, None] + np.arange(tensions.shape[1])]
        error = float(np.abs(found - tensions).max())
    return Count(ended.iterations, str(ended.status), error)


def answers(
    seeds: Sequence[int], workers: int, tick: Callable[[], object] = lambda: None
) -> list[Answer]:
    """Answer random stances, in order, on several processes."""
    if workers == 1:
        return list(_ticking(map(answer, seeds), tick))
    # solvers and linear algebra have threads of their own, which a fork would not survive
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        return list(_ticking(pool.map(answer, seeds, chunksize=CHUNK), tick))


def _ticking(found: Iterable[Answer], tick: Callable[[], object]) -> Iterable[Answer]:
    for each in found:
        tick()
        yield each


def iteration_tables(found: Sequence[Answer]) -> list[Table]:
    """Sum up: iterations, how solves and plans ended, how far tensions are from the plans'."""
    optimal = [each.plan.status == "optimal" for each in found]
    rows = []
    for name, counts in (
        ("plan", [each.plan for each in found]),
        ("its program in our scaling", [each.scaled for each in found]),
        ("… in SI units, default settings", [each.si for each in found]),
        ("… in SI units, the plan's tolerances", [each.sharp for each in found]),
    ):
        iterations = [count.iterations for count in counts]
        off = [count.error for count in itertools.compress(counts, optimal) if count.error >= 0.0]
        ended = Counter(WORDS.get(count.status, count.status) for count in counts)
        cells = [f"{np.percentile(iterations, p):.0f}" for p in (50, 99, 100)]
        cells.append(f"{np.percentile(off, 99):.1f} N" if off and name != "plan" else "")
        wrong = sum(
            count.status == "PrimalInfeasible" and each.plan.status in ("optimal", "overloaded")
            for count, each in zip(counts, found, strict=True)
        )
        words = [f"{number} {word}" for word, number in ended.most_common() if word != "infeasible"]
        words.append(f"{ended['infeasible']} infeasible" + (f" ({wrong} wrongly)" if wrong else ""))
        cells.append(", ".join(words))
        rows.append(Line(name, tuple(cells)))
    return [
        Table(
            f"Iterations of {len(found)} random real stances",
            ("median", "99 %", "worst", "off, 99 %", "ended as"),
            rows,
            "off: how far tensions are from those of the plan, where that is optimal.",
        )
    ]
