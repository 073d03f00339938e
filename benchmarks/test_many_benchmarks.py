"""Many plans at once: in this process, and in processes that are kept open."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from benchmarks.measured_stances import request
from planner.processes import cores
from service.processes import Planners

pytestmark = pytest.mark.slow

MANY = 200
"""New stances of four hands."""


@pytest.fixture(scope="module", params=[1, 2])
def planners(request) -> Iterator[Planners]:
    with Planners(request.param) as opened:
        # programs are built before
        opened.plan_many(requests(0)[:40])
        yield opened


def requests(first: int) -> list:
    return [request(number) for number in range(first, first + MANY)]


@pytest.mark.slow
@pytest.mark.benchmark(group=f"plan_many, {MANY} new stances on {cores()} cores")
def test_plan_many(benchmark, planners):
    rounds = iter(range(1, 100))

    def new() -> tuple[tuple, dict]:
        return (requests(MANY * next(rounds)),), {}

    replies = benchmark.pedantic(planners.plan_many, setup=new, rounds=5)
    assert len(replies) == MANY
    assert all(reply.verified for reply in replies)
