"""What types alone cannot say of a request.

Every number is finite, and nothing is asked that this version cannot do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, NamedTuple

import msgspec

from hand_models.base import InvalidInputError, UnsupportedError

__all__ = ["check"]


class _Later(NamedTuple):
    """Values of a field that this version supports, and what to tell who gives another."""

    supported: tuple[object, ...]
    advice: str


LATER: Final = {
    "objective": _Later(("max_margin", "min_effort"), "valid are max_margin and min_effort"),
    "confidence": _Later((None,), "leave it out: tile limits are nominal"),
}
"""What this version supports of the fields that later versions will."""

BULK: Final = ("vertices", "faces")
"""Long lists of numbers of a mesh, which its model checks as arrays."""


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
        for name in value.__struct_fields__:
            part, field = getattr(value, name), f"{path}.{name}" if path else name
            if name in LATER and part not in LATER[name].supported:
                given = f"{part} is " if isinstance(part, str) else ""
                raise UnsupportedError(
                    f"{given}not supported in this version; {LATER[name].advice}", field=field
                )
            if name not in BULK:
                check(part, field)
    elif isinstance(value, Mapping):
        for name, part in value.items():
            check(part, f"{path}.{name}" if path else str(name))
    elif isinstance(value, (list, tuple)):
        for i, part in enumerate(value):
            check(part, f"{path}[{i}]")
