"""Hands of callers with single numbers of their own, and requests for them."""

from __future__ import annotations

from typing import Any

import msgspec

from hand_models.parameters import ParameterTable, hand_table
from service.answering import with_hand
from service.replies import PlanReply
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.hands import entry_toml
from tests.suite.helpers.requests import wall_request

__all__ = ["THICK", "WEAK", "own", "request_for", "untimed"]


def own(section: str, name: str, value: Any) -> ParameterTable:
    return ParameterTable.read(entry_toml(section, name, value), "own.toml")


def request_for(*parts: ParameterTable, mass: float | None = 50.0) -> PlanRequest:
    request = decode_request(msgspec.json.encode(wall_request(mass)), PlanRequest)
    for part in parts:
        request = with_hand(request, part)
    return request


def untimed(reply: PlanReply) -> dict:
    """A reply without what it took."""
    return {k: v for k, v in msgspec.to_builtins(reply).items() if k not in ("time", "solver")}


THICK = own(
    "finger", "pulley_radii", [2.0 * each for each in hand_table().vector("finger", "pulley_radii")]
)
"""Joint pulleys of twice the radius."""

WEAK = own("tendon", "maximum_tension", 60.0)
