"""What a plan takes, above raw Clarabel and beside other ways to the same plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from msgspec import structs

from benchmarks.cvxpy_users import Parametrised, Query, rebuilt
from benchmarks.measured_stances import payload, question_of, request
from benchmarks.plain_programs import (
    Clarabel,
    Qoco,
    highs,
    least,
    scaled,
    si,
    tie,
    unique,
    whole_blocks,
)
from benchmarks.race import TURN, WARM, Way, race
from benchmarks.results import Line, Table, lines, span
from hand_models.parameters import bundled_draws
from planner.deadline import DeadlineError
from planner.prepare import HandSets, Sets, assemble
from planner.programs import conic, program, solvers, stance_program
from planner.question import Question
from planner.solving import plan
from service.answering import dispatch
from service.answering.questions import question
from service.wire import ServiceName

__all__ = ["plan_tables"]

GIVEN_AWAY = 1e-3
"""Part of the least utilisation by which a plan's may be more, for less tension."""

AGREEMENT = 1e-5
"""How far another way's utilisation may be from a plan's."""

HEAVY = 160.0
"""Mass that overloads the stances [kg]."""

SOON = 5e-3
"""A deadline after which there is a plan, and no explanation yet [s]."""

FEW = 4
"""Stances that are asked for again and again, where caches count."""


class Known(NamedTuple):
    """All that is known of a measured stance before the clock starts."""

    question: Question
    hands: HandSets
    sets: Sets
    utilisation: float


def known(number: int) -> Known:
    """A measured stance, its hands' sets and its utilisation."""
    asked = question_of(number)
    _, hands = assemble(asked, None, asked.needed_wrench())
    sets = hands.sets(hands.at_rest())
    return Known(asked, hands, sets, solvers.unique(sets.data).value)


class Rivals:
    """Other ways to the plans of some stances, each a function of the stance's number."""

    def __init__(self, stances: Sequence[Known]) -> None:
        self.stances = stances
        own = [scaled(each.sets) for each in stances]
        plain = [si(each.question, each.sets) for each in stances]
        used = [each.utilisation for each in stances]
        settings = program.SHARP_SETTINGS
        self.unique = Clarabel([unique(data) for data in own], settings)
        self.whole = whole_blocks([each.sets.data for each in stances])
        usual = stance_program.CLARABEL_SETTINGS
        self.least = Clarabel([least(data) for data in own], usual)
        self.tie = Clarabel([tie(data, u) for data, u in zip(own, used, strict=True)], usual)
        self.si = Clarabel([unique(data) for data in plain], {})
        self.qoco = Qoco([unique(data) for data in own])
        self.plain = [least(data) for data in plain]
        self.queries = [
            Query(
                each.sets.spaces,
                each.hands.transports,
                each.question.needed_wrench(),
                np.split(data.w, np.cumsum([len(hand.unit) for hand in each.sets.data.hands])[:-1]),
            )
            for each, data in zip(stances, plain, strict=True)
        ]
        self.parametrised = Parametrised(self.queries[0])

    def check(self, number: int) -> None:
        """Raise unless all ways come to the same utilisation."""
        expected = self.stances[number].utilisation
        query = self.queries[number]
        for name, got in (
            ("Clarabel", self.unique.updated(number).x[-1]),
            ("Clarabel, zeros kept", self.whole.updated(number).x[0]),
            ("Clarabel, SI", self.si.fresh(number).x[-1]),
            ("QOCO", self.qoco.updated(number).x[-1]),
            ("least utilisation", self.least.updated(number).x[-1]),
            ("HiGHS", highs(self.plain[number]).fun),
            ("CVXPY rebuilt", rebuilt(query)),
            ("CVXPY with DPP", self.parametrised.solve(query)),
        ):
            if not abs(got - expected) <= AGREEMENT:
                raise AssertionError(f"{name}: utilisation {got}, not {expected}")
        planned = plan(question_of(number)).utilisation or float("nan")
        if not -AGREEMENT <= planned - expected <= GIVEN_AWAY * expected + AGREEMENT:
            raise AssertionError(f"plan: utilisation {planned}, not {expected}")

    def two_solves(self, number: int) -> None:
        """Least utilisation, then the tie-break."""
        self.least.updated(number)
        self.tie.updated(number)


def plan_tables(rounds: int, few: int, tick: Callable[[], object]) -> list[Table]:
    """Measure, with so many rounds, or few where they are long."""
    rivals = Rivals([known(number) for number in range(rounds + WARM)])
    for number in range(min(rounds, 5)):
        rivals.check(number)
    plans, others = _plans(rivals, rounds, tick), _others(rivals, rounds, tick)
    plans.lines.extend(_seldom(rivals, few, tick))
    return [plans, others]


def _plans(rivals: Rivals, rounds: int, tick: Callable[[], object]) -> Table:
    """A new stance, from request to plan, and parts of the way."""
    # twins: the numbers that the rivals get, on holds that no cache has seen
    count = rounds + WARM
    requests = [request(number, twin=1) for number in range(count)]
    questions = [question_of(number, twin=2) for number in range(count)]
    payloads = [payload(number, twin=3) for number in range(count)]
    extras = ("load_factor", "prices")
    wanting = [question_of(number, twin=4, want=extras) for number in range(count)]

    def sets(asked: Question) -> HandSets:
        return assemble(asked, None, asked.needed_wrench())[1]

    timed = race(
        {
            "floor": rivals.unique.updated,
            "whole": rivals.whole.updated,
            "two": rivals.two_solves,
            "plan": lambda k: plan(question(requests[k])),
            "sets": lambda k: sets(questions[k]),
            "seen": lambda k: sets(rivals.stances[k % FEW].question),
            "again": lambda k: plan(rivals.stances[k % FEW].question),
            "bytes": lambda k: dispatch.handle(ServiceName.PLAN, payloads[k]),
            "extras": lambda k: plan(wanting[k]),
        },
        rounds,
        tick,
        TURN,
    )
    return Table(
        "A plan of four hands, each time another stance",
        ("median", "× floor", "× whole", "× two"),
        lines(
            timed,
            ["floor", "whole", "two"],
            ("raw Clarabel on the same program: update and solve (the floor)", "floor"),
            ("raw Clarabel on whole blocks, zeros kept (whole)", "whole"),
            ("raw Clarabel, least utilisation, then the tie-break (two)", "two"),
            ("**new stance, parsed request → verified plan**", "plan"),
            ("… of that hold → wrench spaces, four hands", "sets"),
            ("… the same where the holds are known from before", "seen"),
            ("… plan on holds known from before", "again"),
            ("request bytes → reply bytes", "bytes"),
            ("new stance with load factor and prices", "extras"),
        ),
        f"Each way answers {TURN} queries in a row, then it is the next one's turn.",
    )


def _seldom(rivals: Rivals, rounds: int, tick: Callable[[], object]) -> list[Line]:
    """What a plan takes where less is at hand than in a loop."""

    def shaped(number: int) -> Question:
        """Return a question whose tiles have other limits in each hand."""
        question = question_of(number, twin=5)
        hands = tuple(
            replace(hand, surface=replace(hand.surface, half_planes=2 + number // 3**i % 3))
            for i, hand in enumerate(question.stance.hands)
        )
        return replace(question, stance=replace(question.stance, hands=hands))

    def first(number: int) -> None:
        conic.WAITING_SOLVERS.clear()
        plan(late[number])

    def heavy(number: int, twin: int, **more: Any) -> Question:
        asked = question_of(number, twin)
        return replace(asked, load=structs.replace(asked.load, mass=HEAVY), **more)

    def soon(number: int) -> None:
        # on a bad moment there is not even a plan in time
        with suppress(DeadlineError):
            plan(hurried[number])

    count = range(rounds + WARM)
    requests = [request(number, twin=6) for number in count]
    shapes, late = [shaped(number) for number in count], [question_of(k, twin=7) for k in count]
    overloaded = [heavy(number, twin=8) for number in count]
    hurried = [heavy(number, twin=9, deadline=SOON) for number in count]
    untold = [heavy(number, twin=13, explain=False) for number in count]
    light = [question_of(number, twin=14) for number in count]
    alone = race({"shape": lambda k: plan(shapes[k]), "first": first}, rounds)
    sure = [question_of(number, twin=11, want=("spread",)) for number in count]
    bare = [question_of(number, twin=12) for number in count]
    spread = race({"spread": lambda k: plan(sure[k]), "plan": lambda k: plan(bare[k])}, rounds)
    beyond = race(
        {
            "explained": lambda k: plan(overloaded[k]),
            "untold": lambda k: plan(untold[k]),
            "soon": soon,
            "plan": lambda k: plan(light[k]),
        },
        rounds,
    )
    among = race(
        {
            "plan": lambda k: plan(question(requests[k])),
            "work": lambda k: rebuilt(rivals.queries[k]),
        },
        rounds,
        tick,
    )
    blank = ("", "", "")
    return [
        Line("new stance, after 20 ms of other work", (span(among.median("plan")), *blank)),
        Line("new stance of a shape that is new, too", (span(alone.median("shape")), *blank)),
        Line(
            "overloaded stance, with what is in the way proven and named, "
            f"{beyond.ratio('explained', 'plan'):.1f} plans",
            (span(beyond.median("explained")), *blank),
        ),
        Line('… the same with `"explain": false`', (span(beyond.median("untold")), *blank)),
        Line(
            f"… the same with a deadline of {span(SOON)}: the explanation is left out",
            (span(beyond.median("soon")), *blank),
        ),
        Line(
            f"spread over {len(bundled_draws())} draws: a plan and a load factor of each, "
            f"{spread.ratio('spread', 'plan'):.0f} plans",
            (span(spread.median("spread")), *blank),
        ),
        Line(
            "first stance: no solver is set up",
            (span(alone.median("first")), *blank),
        ),
    ]


def _others(rivals: Rivals, rounds: int, tick: Callable[[], object]) -> Table:
    """Other ways from the hands' sets to the loads."""
    # the same sets as new objects, so that nothing is known of them
    stances = [
        each.hands.with_sets([replace(space) for space in each.hands.spaces])
        for each in rivals.stances
    ]

    def ours(number: int) -> None:
        hands = stances[number]
        solvers.unique(hands.sets(hands.at_rest()).data)

    ways: dict[str, Way] = {
        "floor": rivals.unique.updated,
        "ours": ours,
        "least": rivals.least.updated,
        "fresh": rivals.unique.fresh,
        "si": rivals.si.fresh,
        "qoco": rivals.qoco.updated,
        "highs": lambda k: highs(rivals.plain[k]),
        "dpp": lambda k: rivals.parametrised.solve(rivals.queries[k]),
        "rebuilt": lambda k: rebuilt(rivals.queries[k]),
    }
    timed = race(ways, rounds, tick, TURN)
    return Table(
        "The same program by other ways: from the hands' sets to the loads",
        ("median", "× floor", "× ours"),
        lines(
            timed,
            ["floor", "ours"],
            ("raw Clarabel, update and solve (the floor)", "floor"),
            ("**ours, written from the rows**", "ours"),
            ("raw Clarabel, set up anew", "fresh"),
            ("raw Clarabel, SI data and default settings, set up anew", "si"),
            ("raw Clarabel, least utilisation alone", "least"),
            ("QOCO, update and solve", "qoco"),
            ("HiGHS (`scipy.optimize.linprog`), least utilisation alone", "highs"),
            ("CVXPY with DPP, SI data and default options", "dpp"),
            ("CVXPY, the problem rebuilt for each query", "rebuilt"),
        ),
        f"Utilisations agree to {AGREEMENT:.0e}.",
    )
