"""Static equilibrium of friction contacts, beside hpp-centroidal-dynamics."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.race import race
from benchmarks.results import Line, Table, span, times
from planner.programs import solvers
from tests.suite.helpers import centroidal_peer
from tests.suite.helpers.friction_contacts import EDGES, our_margin, random_case, stance_of

__all__ = ["centroidal_tables"]

CASES = 60


def centroidal_tables(rounds: int, tick: Callable[[], object]) -> list[Table]:
    """Measure, with so many rounds of all cases."""
    rng = np.random.default_rng(7)
    cases = [random_case(rng) for _ in range(CASES)]
    margins, seconds = centroidal_peer.timed(cases, EDGES, rounds)
    stances = [stance_of(case) for case in cases]

    def whole(number: int) -> float | None:
        return our_margin(cases[number % CASES])

    def margin(number: int) -> None:
        solvers.margin(stances[number % CASES])

    for case, other in zip(cases, margins, strict=True):
        mine = our_margin(case)
        assert (mine is None) == (other is None)
        assert mine is None or abs(mine - other) <= 1e-6 * max(1.0, abs(mine))
    timed = race({"whole": whole, "margin": margin}, rounds * CASES, tick)
    theirs = float(np.median(seconds))
    return [
        Table(
            "Equilibrium margin of 3 to 5 friction contacts",
            ("median", "× theirs"),
            [
                Line(
                    "hpp-centroidal-dynamics, from contacts to margin",
                    (span(theirs), times(1.0)),
                ),
                Line(
                    "ours: contacts as hands, to margin",
                    (span(timed.median("whole")), times(timed.median("whole") / theirs)),
                ),
                Line(
                    "… of that the program",
                    (span(timed.median("margin")), times(timed.median("margin") / theirs)),
                ),
            ],
            f"{CASES} random stances; margins equal to 1e-6. Theirs runs in its own process.",
        )
    ]
