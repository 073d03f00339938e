"""What another body wrench on a known stance takes: planned, and streamed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

from benchmarks.measured_stances import question_of
from benchmarks.plain_programs import Clarabel, scaled, unique, whole_blocks
from benchmarks.race import TURN, WARM, race
from benchmarks.results import Table, lines
from planner.prepare import assemble
from planner.programs import WRENCH_UNIT, program
from planner.result import SetPoints
from planner.solving import KnownStance
from planner.streaming import WrenchStream

__all__ = ["known_tables"]

STEP = 0.3
"""How far the wrench goes from one query to the next [N], a tenth of that as moments [N·m]."""

AGREEMENT = 1e-5
"""How far utilisations of the same wrench may be apart."""


def known_tables(rounds: int, tick: Callable[[], object]) -> list[Table]:
    """Measure, with so many rounds, on the way of a wrench that drifts."""
    question = question_of(0)
    needed = question.needed_wrench()
    way = np.random.default_rng(0).normal(size=6)
    way *= STEP / np.linalg.norm(way) * WRENCH_UNIT / WRENCH_UNIT[0]
    places = [number if number < rounds else 0 for number in range(rounds + WARM)]
    wrenches = [needed + place * way for place in places]
    _, hands = assemble(question, None, needed)
    sets = hands.sets(hands.at_rest())
    data, goals = scaled(sets), [wrench / WRENCH_UNIT for wrench in wrenches]
    raw = Clarabel([unique(data._replace(wrench=goal)) for goal in goals], program.SHARP_SETTINGS)
    whole = whole_blocks([sets.data.turned(goal) for goal in goals])
    known = KnownStance(question)
    given: list[SetPoints] = []
    with WrenchStream(question) as stream:
        timed = race(
            {
                "floor": raw.turned,
                "whole": whole.turned,
                "plan": lambda k: known.plan(wrenches[k]),
                "stream": lambda k: given.append(stream.set_points(wrenches[k])),
            },
            rounds,
            tick,
            TURN,
        )
    for number, points in enumerate(given[WARM:]):
        used = known.plan(wrenches[number]).utilisation or np.nan
        assert points.verified
        least = raw.turned(number).x[-1]
        # a plan gives up to a thousandth away for less tension
        assert -AGREEMENT <= used - least <= 1e-3 * least + AGREEMENT
        assert used - AGREEMENT <= points.utilisation <= used + points.gap + AGREEMENT
    sources = Counter(points.source for points in given[WARM:])
    return [
        Table(
            "A known stance of four hands, its body wrench drifting",
            ("median", "× floor", "× whole"),
            lines(
                timed,
                ["floor", "whole"],
                ("raw Clarabel, right-hand side updated, and solve (the floor)", "floor"),
                ("raw Clarabel on whole blocks, zeros kept (whole)", "whole"),
                ("**verified plan, `KnownStance`**", "plan"),
                ("**verified set-points, `WrenchStream`**", "stream"),
            ),
            f"{STEP:g} N from query to query. Set-points: "
            + ", ".join(f"{count} {source}" for source, count in sources.most_common())
            + f"; certified gap of the utilisation at most {max(p.gap for p in given):.1e}; "
            f"99 of 100 within {1e3 * np.percentile(timed.times['stream'], 99):.2f} ms.",
        )
    ]
