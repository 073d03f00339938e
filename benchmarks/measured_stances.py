"""The stances that are measured: four pinches on a vertical wall, each time on other cylinders."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import msgspec
import numpy as np

from hand_models.rock import Cylinder
from planner.question import Question
from service.answering.questions import question
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.requests import wall_request

__all__ = ["document", "payload", "question_of", "request", "twin_of"]

TWIN = 1e-9
"""By how much the cylinders of twins differ, relatively: alike, and yet new to every cache."""


def document(number: int, twin: int = 0) -> dict[str, Any]:
    """A request: for each number four other cylinders of 270 to 330 mm, and another load."""
    rng = np.random.default_rng(number)
    asked = wall_request(mass=float(rng.uniform(90.0, 110.0)))
    asked["load"]["com"] = rng.uniform(-0.03, 0.03, 3).tolist()
    for hand in asked["stance"]["hands"]:
        hand["hold"]["diameter"] = float(rng.uniform(0.27, 0.33)) * (1.0 + twin * TWIN)
        hand["pose"]["position"] = (
            np.array(hand["pose"]["position"]) + rng.uniform(-0.02, 0.02, 3)
        ).tolist()
    return asked


def payload(number: int, twin: int = 0) -> bytes:
    """The request as it travels."""
    return msgspec.json.encode(document(number, twin))


def request(number: int, twin: int = 0) -> PlanRequest:
    """The request, parsed."""
    return decode_request(payload(number, twin), PlanRequest)


def question_of(number: int, twin: int = 0, want: tuple[str, ...] = ()) -> Question:
    """The request in the planner's own terms."""
    return replace(question(request(number, twin)), want=frozenset(want))


def twin_of(question: Question, twin: int) -> Question:
    """A question about cylinders as a twin of it."""
    hands = tuple(
        replace(hand, hold=Cylinder(hand.hold.diameter * (1.0 + twin * TWIN)))
        for hand in question.stance.hands
    )
    return replace(question, stance=replace(question.stance, hands=hands))
