"""Scans of which a share is tested at all times, and the whole with the slow tests."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st


def some_and_all(name: str, cases: Iterable[Any], step: int) -> pytest.MarkDecorator:
    """One argument of a test: each so manieth of the cases, and in the slow part all of them."""
    cases = list(cases)
    return pytest.mark.parametrize(
        name, [cases[::step], pytest.param(cases, marks=pytest.mark.slow)], ids=["some", "all"]
    )


def given_some(
    some: int, many: int, *drawn: st.SearchStrategy, **named: st.SearchStrategy
) -> Callable:
    """What `hypothesis.given` does, with some examples, and in the slow part with many."""

    def decorate(test: Callable[..., None]) -> Callable[[int], None]:
        @pytest.mark.parametrize("examples", [some, pytest.param(many, marks=pytest.mark.slow)])
        @functools.wraps(test, updated=())
        def with_examples(examples: int) -> None:
            settings(max_examples=examples, deadline=None)(given(*drawn, **named)(test))()

        # or pytest would look for fixtures of the test's own arguments
        del with_examples.__wrapped__
        return with_examples

    return decorate
