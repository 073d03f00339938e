"""A plan request with an advice taken: what its plan gives is what the advice promised."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any, Final

import msgspec
import numpy as np
from msgspec.structs import replace

from planner import HAND_PATH, Advice, hand_path
from service.requests import PlanRequest

__all__ = ["advised", "rewritten"]

ABSENT: Final = object()
"""The value of a field that is not there."""

ROUNDED: Final = 1e-9
"""By how much a number may be another and yet is taken as the same, relative where it is above 1:
that of a pose which was moved there and back."""

LISTS: Final = (list, tuple)

ORIENTATION: Final = "orientation"
"""Fields whose four numbers are normalised when they are read."""


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


def rewritten(text: bytes, before: PlanRequest, after: PlanRequest) -> bytes:
    """Return a request's text with what is different in another request, and all else as it was.

    Fields keep their order, and numbers that do not change the digits they were written with.

    Parameters
    ----------
    text : bytes
        JSON.
    before, after : PlanRequest
        The request that the text is, and the one that is wanted.
    """
    found = _rewritten(msgspec.Raw(text), msgspec.to_builtins(before), msgspec.to_builtins(after))
    return msgspec.json.encode(found)


def _rewritten(text: msgspec.Raw, before: Any, after: Any) -> Any:
    """Return a part of a message: as it was written where it stays, else with what is new in it."""
    if before == after or (isinstance(after, float) and _is_rounded(before, after)):
        return text
    if isinstance(before, dict) and isinstance(after, dict):
        given = msgspec.json.decode(text, type=dict[str, msgspec.Raw])
        # what is in neither was written though it is the default
        stays: dict[str, Any] = {
            name: part for name, part in given.items() if name in after or name not in before
        }
        for name, value in after.items():
            was = before.get(name, ABSENT)
            stays[name] = given.get(name, value)
            if name in given and not (name == ORIENTATION and _is_turned_by_nothing(was, value)):
                stays[name] = _rewritten(given[name], was, value)
        return stays
    if isinstance(before, LISTS) and isinstance(after, LISTS) and before:
        parts = msgspec.json.decode(text, type=list[msgspec.Raw])
        made_of = [(_most_like(before, each, i), each) for i, each in enumerate(after)]
        return [_rewritten(parts[j], before[j], each) for j, each in made_of]
    return after


def _is_rounded(before: Any, after: float) -> bool:
    """Return whether a number differs from another by rounding alone."""
    return isinstance(before, float) and abs(after - before) <= ROUNDED * max(1.0, abs(before))


def _is_turned_by_nothing(before: Sequence[float], after: Sequence[float]) -> bool:
    """Return whether two quaternions are the same rotation, but for rounding."""
    was, now = (np.array(each) / math.hypot(*each) for each in (before, after))
    return bool(min(abs(was - now).max(), abs(was + now).max()) <= ROUNDED)


def _most_like(before: Sequence[Any], one: Any, place: int) -> int:
    """Return which entry of a list one of another was made of: of objects, the most alike."""
    if not isinstance(one, dict):
        return min(place, len(before) - 1)

    def alike(j: int) -> int:
        other = before[j]
        return sum(other.get(name) == value for name, value in one.items())

    return max(range(len(before)), key=alike)


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
