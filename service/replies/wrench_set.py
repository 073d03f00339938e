"""A hand's wrenches as generators and rows, by name."""

from __future__ import annotations

from msgspec import Struct

from service.replies.reply import Vector

__all__ = [
    "Generator",
    "Row",
    "WrenchSet",
]


class Generator(Struct):
    """A column of a hand's wrench space: a load, and the wrench per newton of it.

    Of a floating hand a component of its wrist's twist, and the wrench per metre or radian.
    """

    name: str
    wrench: Vector


class Row(Struct, kw_only=True):
    """An inequality of a hand's wrench space.

    ``limit`` rows: load = coefficients · y + constant, at most utilisation · capacity; in newtons,
    for ``motor_torque`` and ``joint_torque`` in newton-metres, for ``motor_current`` in amperes.
    ``hard`` rows: coefficients · y at most capacity, whatever the utilisation.
    """

    name: str
    kind: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None
    coefficients: Vector
    constant: float
    capacity: float


class WrenchSet(Struct, kw_only=True):
    """A hand's wrenches, origin + Σ y · generator, for the loads y that the rows allow."""

    origin: Vector
    generators: list[Generator]
    rows: list[Row]
