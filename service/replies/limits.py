"""Limits by name, and what they cost."""

from __future__ import annotations

from msgspec import Struct

__all__ = [
    "LimitName",
    "Price",
]


class LimitName(Struct, kw_only=True):
    """A limit of one hand or its limb, by name."""

    limb: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None


class Price(LimitName, kw_only=True):
    """What one more unit of a limit that binds would take off the utilisation.

    The unit is that of the limit's capacity: ``N``, ``N·m`` or ``A``.
    """

    price: float
    unit: str
