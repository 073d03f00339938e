"""What types alone cannot say of a request.

Every number is finite, and nothing is asked that this version cannot do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import msgspec

from hand_models.base import InvalidInputError, UnsupportedError
from service import requests

__all__ = ["check"]


class _Later(NamedTuple):
    """Values of a field that this version supports, and what to tell who gives another."""

    supported: tuple[object, ...]
    advice: str


_OMIT = "leave it out"

_OBJECTIVE = _Later(("max_margin", "min_effort"), "valid are max_margin and min_effort")

LATER: Final[dict[type, dict[str, _Later]]] = {
    requests.PlanRequest: {
        "objective": _OBJECTIVE,
        "confidence": _Later((None,), f"{_OMIT}: tile limits are nominal"),
    },
    requests.RouteRequest: {"objective": _OBJECTIVE},
}
"""By message and field, what this version supports of the fields that later versions will."""

BULK: Final[dict[type, tuple[str, ...]]] = {requests.Mesh: ("vertices", "faces")}
"""By message, long lists of numbers that their model checks as arrays."""


def check(value: object, path: str = "") -> None:
    """Check a decoded request, or a part of it, for what its type does not ensure.

    Raises
    ------
    InvalidInputError
        If a number is not finite.
    UnsupportedError
        If a field has a value that this version does not support.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InvalidInputError(f"must be a finite number, got {value}", field=path)
    elif isinstance(value, msgspec.Struct):
        later = {k: v for kind in type(value).__mro__ for k, v in LATER.get(kind, {}).items()}
        for name in value.__struct_fields__:
            part, field = getattr(value, name), f"{path}.{name}" if path else name
            if name in later and part not in later[name].supported:
                raise UnsupportedError(
                    f"{_given(part)}not supported in this version; {later[name].advice}",
                    field=field,
                )
            if name not in BULK.get(type(value), ()):
                check(part, field)
    elif isinstance(value, Mapping):
        for name, part in value.items():
            check(part, f"{path}.{name}" if path else str(name))
    elif isinstance(value, (list, tuple)):
        for i, part in enumerate(value):
            check(part, f"{path}[{i}]")


def _given(value: Any) -> str:
    return f"{value} is " if isinstance(value, str) else ""
