"""Limits of a question that its hands cannot keep."""

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from planner.question import Limits, Question
from service.answering import question
from service.commands.stances import read_request


def floating() -> Question:
    """The bundled stance of which two hands float at 50 N, without further limits."""
    return question(read_request("wall-300-floating"))


def test_a_least_tension_above_a_floating_hands_preload_is_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"rear_right, 50 N, .*; got 50.5 N") as caught:
        replace(floating(), limits=Limits(least_tension=50.5))
    assert caught.value.field == "limits.least_tension"
    assert replace(floating(), limits=Limits(least_tension=50.0)).limits.least_tension == 50.0


@pytest.mark.parametrize("preload", [None, np.array([60.0, 60.0, 36.0, 60.0])])
def test_the_least_of_four_preloads_counts_and_without_them_the_closing_tension(
    preload: np.ndarray | None,
) -> None:
    asked = floating()
    hands = [
        replace(hand, tendon_preload=preload) if hand.wrist == "floating" else hand
        for hand in asked.stance.hands
    ]
    held = asked.stance.robot.hand.closing_tension if preload is None else 36.0
    stance = replace(asked.stance, hands=hands)
    replace(asked, stance=stance, limits=Limits(least_tension=held))
    with pytest.raises(InvalidInputError, match=f"{held:g} N"):
        replace(asked, stance=stance, limits=Limits(least_tension=held + 0.1))
