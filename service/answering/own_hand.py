"""A hand of the caller's own, on its way: from a file into a request, and from there to a robot.

Entries travel as ``{section: {entry: {value, unit, source, note}}}``. Whoever is nearer to the
question has the last word on an entry: the command line over a stance's file, a request over the
service, which may have a hand of its own, over the bundled hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from hand_models.base import InvalidInputError
from hand_models.hand import spiny_hand
from hand_models.parameters import ParameterTable, load_own_hand, own_hand
from service.requests import (
    BodySpaceRequest,
    PlanRequest,
    RouteRequest,
    StreamRequest,
    WrenchSpaceRequest,
)

__all__ = ["over_default", "read_hand", "with_hand"]

R = TypeVar(
    "R", bound=PlanRequest | WrenchSpaceRequest | BodySpaceRequest | StreamRequest | RouteRequest
)


def read_hand(path: Path) -> ParameterTable:
    """Return a file's entries, which together with the bundled ones make a possible hand.

    Raises
    ------
    InvalidInputError
        In one line that names file, entry and value.
    """
    own = load_own_hand(path)
    try:
        spiny_hand(own_hand(own))
    except InvalidInputError as error:
        raise InvalidInputError(str(error), field=str(path)) from None
    return own


def with_hand(request: R, own: ParameterTable | None) -> R:
    """Return a request for a hand with these entries, over those that it names itself."""
    if own is None:
        return request
    return _asking_for(request, request.stance.hand or {}, _entries(own))


def over_default(request: R, default: ParameterTable | None) -> R:
    """Return a request in which what it leaves open of its hand is the service's default."""
    if default is None:
        return request
    return _asking_for(request, _entries(default), request.stance.hand or {})


def _entries(own: ParameterTable) -> dict[str, dict[str, Any]]:
    """Return entries as they travel."""
    entries: dict[str, dict[str, Any]] = msgspec.to_builtins(own.sections)
    return entries


def _asking_for(request: R, low: Mapping[str, Any], high: Mapping[str, Any]) -> R:
    """Return a request with two hands' entries, the second's in place of the first's."""
    hand = {**low, **high}
    for section in low.keys() & high.keys():
        # what is no section is left for its refusal
        if isinstance(high[section], Mapping) and isinstance(low[section], Mapping):
            hand[section] = {**low[section], **high[section]}
    stance = msgspec.structs.replace(request.stance, hand=hand)
    return msgspec.structs.replace(request, stance=stance)
