"""Every question of the suite is answered as it is recorded."""

from __future__ import annotations

from functools import cache

import pytest

from tests.suite.answers import fields, read_answers, recorded_here
from tests.suite.comparison import MISSING, Difference
from tests.suite.problems import Problem, problems
from tests.suite.table import answer

SLOW = (pytest.mark.slow, pytest.mark.timeout(1800))

LEAST = 0.0 if recorded_here() else 1e-2
"""Other versions of solver and linear algebra, and kernels for other processors, end in other last
digits, and weigh ties otherwise: with them a status or a limit that changes is found, and a number
that jumps."""

FREE = set() if recorded_here() else {"blocking", "irreducible", "sufficient"}
"""An irreducible infeasible set is one of many, and so is what else would do."""

recorded = cache(read_answers)
"""Each file is read once."""


@cache
def known_fields(kind: str) -> set[str]:
    """Return the fields that some recorded answer to problems of a kind has."""
    return set().union(*map(fields, recorded(kind).values()))


@pytest.mark.parametrize(
    "problem",
    [
        pytest.param(each, id=each.label, marks=SLOW if each.slow or i % 8 else ())
        for i, each in enumerate(problems())
    ],
)
def test_the_answer_is_as_recorded(problem: Problem) -> None:
    changes = problem.changes(recorded(problem.kind)[problem.name], answer(problem), LEAST)
    changes = [each for each in changes if not is_new(each, problem.kind)]
    found = [each for each in changes if not FREE.intersection(each.names)]
    assert [str(each) for each in found][:10] == []


def is_new(change: Difference, kind: str) -> bool:
    """Whether a field is one that no recorded answer to problems of a kind has."""
    return change.expected == MISSING and change.field not in known_fields(kind)


def test_no_answer_has_a_field_that_no_record_has() -> None:
    quickest = {each.kind: each for each in reversed(list(problems())) if not each.slow}
    changes = {
        kind: each.changes(recorded(kind)[each.name], answer(each))
        for kind, each in quickest.items()
    }
    found = {c.field for kind, some in changes.items() for c in some if is_new(c, kind)}
    assert sorted(found) == []


def test_every_problem_has_an_answer_and_every_answer_a_problem() -> None:
    names: dict[str, list[str]] = {}
    for each in problems():
        names.setdefault(each.kind, []).append(each.name)
    for kind, expected in names.items():
        assert list(read_answers(kind)) == expected


def test_there_are_many_questions_and_the_loose_ones_say_why() -> None:
    everything = list(problems())
    assert len(everything) >= 300
    assert all(reason for each in everything for _, reason in each.loose.values())
