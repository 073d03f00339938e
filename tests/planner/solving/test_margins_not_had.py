"""Margins that a stance cannot have within the cap: a finding says what it does without them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner import Plan, plan
from planner.result import Finding
from tests.suite.helpers.stances import limited


def found(answer: Plan) -> list[Finding]:
    return [each for each in answer.findings if each.kind == "margin_not_had"]


@pytest.mark.parametrize("wrist", ["fixed", pytest.param("compliant", marks=pytest.mark.slow)])
def test_a_margin_that_costs_the_plan_is_named_with_what_goes_without(wrist: str) -> None:
    answer = plan(limited("wall-300", wrist, hold_margin=5.0))
    bare = plan(limited("wall-300", wrist))
    assert (answer.status, bare.status) == ("overloaded", "optimal")
    (finding,) = found(answer)
    assert (finding.field, finding.unit) == ("limits.hold_margin", "1")
    assert finding.value == pytest.approx(bare.utilisation, abs=5e-3 if wrist != "fixed" else 1e-6)
    assert finding.message in answer.warnings
    assert finding.message.startswith("with a hold_margin of 5 N there is no plan within")


def test_all_margins_are_named() -> None:
    answer = plan(limited("ledge", least_tension=60.0, hold_margin=200.0))
    assert answer.status == "overloaded"
    (finding,) = found(answer)
    assert "hold_margin of 200 N and least_tension of 60 N" in finding.message
    assert finding.value == pytest.approx(plan(limited("ledge")).utilisation)


def test_nothing_is_said_of_margins_that_are_had_or_do_not_decide() -> None:
    assert not found(plan(limited("wall-300", hold_margin=2.0)))
    # overloaded with or without
    answer = plan(limited("boulders", hold_margin=5.0))
    assert answer.status == "overloaded"
    assert not found(answer)
    quiet = replace(limited("wall-300", hold_margin=5.0), explain=False)
    assert not found(plan(quiet))
