"""Apply an advice to a plan request: the changed request gets the plan that the advice promised."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import msgspec
import numpy as np
from msgspec import UNSET
from msgspec.structs import replace

from planner import HAND_PATH, Advice, hand_path
from service.requests import PlanRequest

__all__ = ["advised", "rewritten"]


def advised(request: PlanRequest, advice: Advice) -> PlanRequest:
    """Return a plan request with the changes of an advice applied, and without ``want: advice``.

    Parameters
    ----------
    request : PlanRequest
        Request whose reply has the advice.
    advice : Advice
        One advice of that reply; its ``changes`` are values by the paths of the request's fields.

    Returns
    -------
    PlanRequest
        A new request; the given one is unchanged. A plan of the new request has the utilisation
        that the advice names.
    """
    want = [each for each in request.want if each != "advice"]
    message = msgspec.to_builtins(replace(request, want=want))
    given = message["stance"]["hands"]
    hands: dict[int, Any] = dict(enumerate(map(deepcopy, given)))
    # first copy hands, then change their fields, and last remove the hands that let go
    for path, value in sorted(advice.changes.items(), key=lambda change: change[0].count(".")):
        hand = HAND_PATH.fullmatch(path)
        if hand is None:
            _put(message, path, value)
        elif hand[2] is not None:
            _put(hands[int(hand[1])], hand[2], value)
        elif value is not None:
            like = HAND_PATH.fullmatch(value)
            assert like is not None  # an advice has no other values
            hands[int(hand[1])] = deepcopy(given[int(like[1])])
    gone = {path for path, value in advice.changes.items() if value is None}
    message["stance"]["hands"] = [
        each for i, each in sorted(hands.items()) if hand_path(i) not in gone
    ]
    return msgspec.convert(message, PlanRequest)


def rewritten(text: bytes, before: PlanRequest, after: PlanRequest) -> bytes:
    """Edit the JSON text of a request so that it decodes to another request.

    Only fields that differ between the two requests change. All other fields keep their order, and
    their numbers keep their digits.

    Parameters
    ----------
    text : bytes
        JSON text of ``before``.
    before : PlanRequest
        Request that the text decodes to.
    after : PlanRequest
        Request that the new text is to decode to.

    Returns
    -------
    bytes
        JSON text of ``after``.
    """
    found = _rewritten(msgspec.Raw(text), msgspec.to_builtins(before), msgspec.to_builtins(after))
    return msgspec.json.encode(found)


def _rewritten(text: msgspec.Raw, before: Any, after: Any) -> Any:
    """Return a part of a message: its text if it is unchanged, otherwise with the changes."""
    if before == after or (isinstance(after, float) and _is_rounded(before, after)):
        return text
    if isinstance(before, dict) and isinstance(after, dict):
        given = msgspec.json.decode(text, type=dict[str, msgspec.Raw])
        # a field in neither was written with its default value
        stays: dict[str, Any] = {
            name: part for name, part in given.items() if name in after or name not in before
        }
        for name, value in after.items():
            was = before.get(name, UNSET)
            stays[name] = given.get(name, value)
            # the four numbers of an orientation are normalised when they are read
            if name in given and not (name == "orientation" and _is_turned_by_nothing(was, value)):
                stays[name] = _rewritten(given[name], was, value)
        return stays
    if isinstance(before, list | tuple) and isinstance(after, list | tuple) and before:
        parts = msgspec.json.decode(text, type=list[msgspec.Raw])
        made_of = [(_most_like(before, each, i), each) for i, each in enumerate(after)]
        return [_rewritten(parts[j], before[j], each) for j, each in made_of]
    return after


def _is_rounded(before: Any, after: float) -> bool:
    """Return True if two numbers differ by rounding alone."""
    # relative for numbers above 1: the rounding of a pose that was moved there and back
    return isinstance(before, float) and abs(after - before) <= 1e-9 * max(1.0, abs(before))


def _is_turned_by_nothing(before: Sequence[float], after: Sequence[float]) -> bool:
    """Return True if two quaternions are the same rotation up to rounding."""
    was, now = (np.array(each) / math.hypot(*each) for each in (before, after))
    return any(all(map(_is_rounded, was.tolist(), same.tolist())) for same in (now, -now))


def _most_like(before: Sequence[Any], one: Any, place: int) -> int:
    """Return the index of the entry that a new entry was made of: the most similar object."""
    if not isinstance(one, dict):
        return min(place, len(before) - 1)

    def alike(j: int) -> int:
        other = before[j]
        return sum(other.get(name) == value for name, value in one.items())

    return max(range(len(before)), key=alike)


def _put(part: dict[str, Any], path: str, value: Any) -> None:
    """Set a field of a message, or remove it."""
    *way, last = path.split(".")
    for name in way:
        inner = part.get(name)
        part[name] = dict(inner) if isinstance(inner, Mapping) else {}
        part = part[name]
    if value is None:
        part.pop(last, None)
    else:
        part[last] = value
