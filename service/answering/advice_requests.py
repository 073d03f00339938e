"""A plan request with an advice taken: what its plan gives is what the advice promised."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import msgspec
from msgspec.structs import replace

from planner import HAND_PATH, Advice, hand_path
from service.requests import PlanRequest

__all__ = ["advised"]


def advised(request: PlanRequest, advice: Advice) -> PlanRequest:
    """Return a request with the changes of an advice about it, which asks for no advice itself.

    Parameters
    ----------
    request : PlanRequest
    advice : Advice
        From the reply to it.
    """
    want = [each for each in request.want if each != "advice"]
    message = msgspec.to_builtins(replace(request, want=want))
    given = message["stance"]["hands"]
    hands: dict[int, Any] = dict(enumerate(map(deepcopy, given)))
    # a hand that is a copy comes before what else is told of it, one that is let go after all
    for path, value in sorted(advice.changes.items(), key=lambda change: change[0].count(".")):
        hand = HAND_PATH.fullmatch(path)
        if hand is None:
            _put(message, path, value)
        elif hand[2] is not None:
            _put(hands[int(hand[1])], hand[2], value)
        elif value is not None:
            like = HAND_PATH.fullmatch(value)
            assert like is not None  # by what an advice is
            hands[int(hand[1])] = deepcopy(given[int(like[1])])
    gone = {path for path, value in advice.changes.items() if value is None}
    message["stance"]["hands"] = [
        each for i, each in sorted(hands.items()) if hand_path(i) not in gone
    ]
    return msgspec.convert(message, PlanRequest)


def _put(part: dict[str, Any], path: str, value: Any) -> None:
    """Set a field of a message, or take it away."""
    *way, last = path.split(".")
    for name in way:
        inner = part.get(name)
        part[name] = dict(inner) if isinstance(inner, Mapping) else {}
        part = part[name]
    if value is None:
        part.pop(last, None)
    else:
        part[last] = value
