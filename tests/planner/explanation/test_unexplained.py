"""Plans that are not to be explained: the same answers, without the proof of what is in the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.explanation import certificate
from planner.explanation.infeasibility import HardRowSystem
from planner.solving import plan
from tests.suite.helpers.random_questions import FEW, explained
from tests.suite.helpers.stances import ask, on_wall


@pytest.fixture(scope="module")
def infeasible():
    return ask(on_wall(palm=False))


def test_all_but_the_certificate_is_the_same():
    for status in FEW:
        for label, question, answer in explained(status, FEW):
            alone = plan(replace(question, explain=False))
            assert answer.certificate is not None, label
            assert alone.certificate is None, label
            assert alone.status == status, label
            assert alone.verified, label
            for name in (
                "utilisation",
                "effort",
                "load_factor",
                "limiting",
                "unfinished",
                "warnings",
            ):
                assert getattr(alone, name) == getattr(answer, name), f"{label}: {name}"
            if answer.hands is None:
                assert alone.hands is None
                continue
            for mine, theirs in zip(alone.hands, answer.hands, strict=True):
                np.testing.assert_array_equal(mine.tensions, theirs.tensions, err_msg=label)
            # what would be missing within the limits is part of the explanation
            assert answer.reason.startswith(alone.reason), label


def test_that_hands_have_no_loads_at_all_is_told_without_an_explanation_too():
    seen = []
    for label, question, answer in explained("infeasible", FEW):
        alone = plan(replace(question, explain=False))
        none_at_all = answer.certificate.irreducible == ()
        assert ("no loads at all" in alone.reason) == none_at_all, label
        if none_at_all:
            assert alone.reason == answer.reason, label
        seen.append(none_at_all)
    assert any(seen)
    assert not all(seen)


def test_it_is_not_sought_what_is_not_told(infeasible, monkeypatch):
    def sought(*_):
        raise AssertionError("sought")

    monkeypatch.setattr(certificate, "irreducible_set", sought)
    assert plan(replace(infeasible, explain=False)).status == "infeasible"
    with pytest.raises(AssertionError, match="sought"):
        plan(infeasible)


def test_the_sentence_still_says_what_is_missing(infeasible):
    told, alone = plan(infeasible), plan(replace(infeasible, explain=False))
    assert alone.reason.split("; ")[0] == told.reason.split("; ")[0]
    assert "missing" in alone.reason


def test_without_a_bound_that_proves_it_nothing_is_infeasible(infeasible, monkeypatch):
    """The status stands on numbers that are checked, whether they are told or not."""
    monkeypatch.setattr(HardRowSystem, "proves", lambda *_: False)
    assert plan(replace(infeasible, explain=False)).status == "failed"
