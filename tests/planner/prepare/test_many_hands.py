"""Plans for 1 to 16 hands: each verified, and held against HiGHS."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.programs import CAP_SLACK
from planner.question import Question
from planner.result import Plan
from planner.robots import Robot
from planner.solving import plan
from tests.suite.helpers import peer
from tests.suite.helpers.crawlers import crawler_in, crawler_question
from tests.suite.helpers.efforts import promised, told_effort

UNPROVEN = 1e-2
"""How far plans may be from the least utilisation that warn that it is not proven.

A palm's stiffness rises within 0.02 mm, and a search for floating wrists may end there."""


@pytest.fixture(scope="module")
def crawler(tmp_path_factory) -> Robot:
    return crawler_in(tmp_path_factory.mktemp("crawler"))


def check(asked: Question, margin: Plan, effort: Plan, tolerance: float) -> None:
    """Both plans are verified; on the sets that they used HiGHS finds nothing better."""
    asked = replace(asked, body_wrench=margin.body_wrench)
    for answer in (margin, effort):
        assert answer.status == "optimal", answer.reason
        assert answer.verified
        assert [hand.limb for hand in answer.hands] == [hand.limb for hand in asked.stance.hands]
        assert answer.utilisation <= 1.0 + CAP_SLACK
        assert answer.effort == pytest.approx(told_effort(asked, answer), rel=1e-6)
    best = peer.least_utilisation(asked, [hand.space for hand in margin.hands])
    assert best.status == 0, best.message
    used = max(hand.utilisation for hand in margin.hands)
    # where a search for floating wrists ended early, which it says, another may be a little better
    early = UNPROVEN if margin.warnings else 0.0
    assert best.fun - tolerance <= used <= best.fun + tolerance + early
    assert effort.effort <= margin.effort + 1e-9
    if not effort.warnings:
        assert promised(asked, effort, 1.0 + CAP_SLACK) <= 10.0 * tolerance


@pytest.mark.parametrize("joints", [False, True], ids=["hands alone", "with joints"])
@pytest.mark.parametrize("count", [1, 2, 5, 8, 16])
def test_hands_with_fixed_wrists(crawler, count, joints):
    asked = crawler_question(crawler, count, joints=joints)
    margin = plan(asked)
    check(asked, margin, plan(replace(asked, objective="min_effort")), 2e-6)


@pytest.mark.parametrize(
    ("count", "floating", "joints"),
    [
        (1, 1, True),
        (2, 2, True),
        pytest.param(5, 2, False, marks=pytest.mark.slow),
        pytest.param(16, 1, True, marks=pytest.mark.slow),
    ],
)
def test_some_hands_float(crawler, count, floating, joints):
    asked = crawler_question(crawler, count, floating, joints=joints)
    margin = plan(asked)
    assert [hand.wrist is not None for hand in margin.hands] == [i < floating for i in range(count)]
    check(asked, margin, plan(replace(asked, objective="min_effort")), 2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("count", range(1, 17))
def test_every_number_of_hands(crawler, count):
    for floating in (0, min(count, 4)):
        # odd stances have joints, and even ones do not
        asked = crawler_question(crawler, count, floating, joints=count % 2 == 1, seed=floating)
        margin = plan(asked)
        check(asked, margin, plan(replace(asked, objective="min_effort")), 2e-5)
