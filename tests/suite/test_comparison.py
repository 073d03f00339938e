"""The comparison of answers finds what differs, and nothing else."""

from __future__ import annotations

import copy
import math
import random
from dataclasses import replace
from typing import Any

import pytest

from tests.suite.answers import fields, read_answers, rounded, told
from tests.suite.comparison import MISSING, differences, worst
from tests.suite.problems import Problem, problem, problems

TOLERANCE = 1e-9


@pytest.fixture
def plan() -> dict[str, Any]:
    """A recorded plan with prices."""
    found = read_answers("limits")
    return next(copy.deepcopy(a) for a in found.values() if len(a.get("prices") or ()) > 2)


def changed(answer: dict[str, Any], *path: str | int, to: Any) -> dict[str, Any]:
    """A copy with another value at a path."""
    answer = copy.deepcopy(answer)
    part: Any = answer
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = to(part[path[-1]]) if callable(to) else to
    return answer


TILE = ("hands", 0, "fingers", 1, "tiles", 0)


def test_an_answer_is_equal_to_itself(plan: dict[str, Any]) -> None:
    assert differences(plan, copy.deepcopy(plan)) == []


@pytest.mark.parametrize(
    "path",
    [("utilisation",), ("body_wrench", 0), ("hands", 0, "fingers", 1, "tendon_tension")],
)
def test_a_changed_digit_is_found(plan: dict[str, Any], path: tuple) -> None:
    found = differences(plan, changed(plan, *path, to=lambda x: x * (1.0 + 1e-7)))
    assert worst(found) > TOLERANCE
    assert len(found) == 1
    assert found[0].path.endswith(str(path[-1]) if isinstance(path[-1], str) else "[0]")
    rounding = differences(plan, changed(plan, *path, to=lambda x: x * (1.0 + 1e-13)))
    assert 0.0 < worst(rounding) < TOLERANCE


def test_a_small_number_is_measured_by_the_largest_of_its_kind() -> None:
    hands = [{"shear": 1e-9}, {"shear": 500.0}]
    assert worst(differences(hands, [{"shear": 2e-9}, {"shear": 500.0}])) < TOLERANCE
    found = differences(hands, [{"shear": 1e-9}, {"shear": 500.0 + 5e-6}])
    assert [each.path for each in found] == ["[1].shear"]
    assert found[0].size == pytest.approx(1e-8)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("status",), "overloaded!"),
        (("verified",), None),
        (("utilisation",), None),
        (("certificate",), 0.0),
        ((*TILE, "contact"), "nothing"),
        (("limiting", "limit"), "other"),
        (("hands", 0, "palm", "engaged"), [9]),
    ],
)
def test_names_and_nulls_are_exact(plan: dict[str, Any], path: tuple, value: Any) -> None:
    assert worst(differences(plan, changed(plan, *path, to=value))) == math.inf


def test_a_missing_and_an_added_field_are_found(plan: dict[str, Any]) -> None:
    less = copy.deepcopy(plan)
    del less["hands"][0]["fingers"][1]["tiles"][0]["shear"]
    for pair in ((plan, less), (less, plan)):
        (found,) = differences(*pair)
        assert found.path == "hands[0].fingers[1].tiles[0].shear"
        assert found.size == math.inf
    fewer = changed(plan, "hands", to=lambda hands: hands[:-1])
    assert [each.path for each in differences(plan, fewer)] == ["hands.length"]


def test_sets_have_no_order_but_all_their_rows(plan: dict[str, Any]) -> None:
    shuffled = changed(plan, "prices", to=lambda rows: random.Random(0).sample(rows, len(rows)))
    assert shuffled["prices"] != plan["prices"]
    assert differences(plan, shuffled) == []
    assert worst(differences(plan, changed(plan, "prices", to=lambda rows: rows[1:]))) > TOLERANCE
    dearer = changed(plan, "prices", 0, "price", to=lambda price: price + 1e-7)
    assert worst(differences(plan, dearer)) > TOLERANCE
    renamed = changed(plan, "prices", 0, "limit", to="other")
    assert worst(differences(plan, renamed)) == math.inf


def test_rows_that_are_nearly_alike_need_no_sorting() -> None:
    rows = [[1.0, 2.0], [1.0 + 1e-13, -2.0], [1.0, 2.0]]
    others = [[1.0, -2.0], [1.0 - 1e-13, 2.0]]
    assert worst(differences({"vertices": rows}, {"vertices": others})) < TOLERANCE
    assert worst(differences({"vertices": rows}, {"vertices": others[:1]})) > TOLERANCE
    assert worst(differences({"vertices": rows}, {"vertices": []})) == math.inf


def test_an_order_that_counts_is_kept() -> None:
    assert worst(differences({"wrench": [1.0, 2.0]}, {"wrench": [2.0, 1.0]})) > TOLERANCE


def test_what_is_not_unique_or_badly_conditioned_has_its_own_tolerance(plan: dict) -> None:
    other = changed(plan, "limiting", "limit", to="other")
    other = changed(other, "prices", 0, "price", to=lambda price: price + 1e-8)
    strict = Problem("kind", "name", {})
    loose = Problem("kind", "name", {}, loose={"limiting": (None, "tie"), "prices": (1e-5, "")})
    assert len({each.names[0] for each in strict.changes(plan, other)}) == 2
    assert loose.changes(plan, other) == []
    further = changed(other, "prices", 0, "price", to=lambda price: price + 1e-6)
    assert loose.changes(plan, further)
    assert loose.changes(plan, changed(other, "utilisation", to=0.1))
    assert replace(loose, loose={"*": (None, "")}).changes(plan, {}) == []


def test_what_is_told_has_no_words_nor_clocks() -> None:
    reply = {"status": "optimal", "reason": "…", "time": {"total": 1.0}, "utilisation": 1.0 / 3.0}
    assert told(reply) == {"status": "optimal", "utilisation": 0.3333333333333}
    error = {"v": 1, "error": {"kind": "invalid", "field": "stance", "message": "…"}}
    assert told(error) == {"error": {"kind": "invalid", "field": "stance"}}


def test_large_sets_are_measured_whatever_the_order_of_their_rows() -> None:
    cube = [[x, y, z, 0.0, 0.0, 0.0] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    normals = [[float(s * (i == k)) for i in range(6)] for k in range(3) for s in (-1, 1)]
    flat = [[float(i == k) for i in range(6)] for k in range(3, 6)]

    def measured(points: list, extent: float) -> dict[str, Any]:
        equations = {"normals": flat, "offsets": [0.0] * 3}
        faces = {"normals": normals, "offsets": [extent] * 6, "equations": equations}
        return told({"vertices": points, "half_spaces": faces})

    known = measured(cube, 1.0)
    assert worst(differences(known, measured([*cube[::-1], cube[3]], 1.0))) < TOLERANCE
    assert worst(differences(known, measured(cube, 1.0 + 1e-7))) > TOLERANCE
    assert worst(differences(known, measured(cube[1:], 1.0))) > TOLERANCE


def test_problems_are_found_by_name() -> None:
    one = next(problems("holds/*"))
    assert problem(one.label) is one
    assert one.request["stance"]["hands"]
    assert {each.kind for each in problems("holds")} == {"holds"}


def test_a_record_has_the_digits_that_are_compared() -> None:
    strict = Problem("kind", "name", {}, loose={"prices": (None, "tie"), "effort": (1e-4, "flat")})
    answer = {"wrench": [1234.56789012345, 1e-13], "prices": [1.0], "effort": 0.123456789, "n": 4}
    kept = rounded(strict, answer)
    assert kept == {"wrench": [1234.5678901, 0.0], "effort": 0.123457, "n": 4}
    assert strict.changes(kept, answer) == []


def test_fields_are_named_without_places() -> None:
    answer = {"hands": [{"limb": "a"}, {"palm": {"force": [1.0, 2.0]}}]}
    assert fields(answer) == {"hands", "hands.limb", "hands.palm", "hands.palm.force"}
    (found,) = differences({"hands": [{"limb": "a"}]}, {"hands": [{"limb": "a", "new": 1}]})
    assert (found.expected, found.field) == (MISSING, "hands.new")
