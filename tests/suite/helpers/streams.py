"""Questions that a stream takes."""

from __future__ import annotations

from dataclasses import replace

from msgspec import structs

from planner.question import Question
from planner.streaming.stream_stance import StreamStance


def streamable(question: Question) -> Question:
    """The question without what streams refuse, under the wrench that its load needs."""
    question = replace(
        question,
        objective="max_margin",
        limits=structs.replace(question.limits, tension_change=None),
        present={},
    )
    return replace(question, body_wrench=StreamStance(question).first)
