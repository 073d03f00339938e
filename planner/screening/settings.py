"""Numbers of the screening of stances: of directions that are learnt, and its tolerances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["SCREENING_SETTINGS", "ScreeningSettings"]


@dataclass(frozen=True, slots=True)
class ScreeningSettings:
    """Numbers of directions and stances, and tolerances of bounds."""

    directions: int = 600
    """Directions up to which bounds are learnt; further ones hardly help other stances."""
    together: int = 8
    """Stances from which directions are learnt in one round, before all bounds are lowered."""
    least_share: float = 1e-9
    """Product of a direction and the body wrench up to which it counts as zero [1]; directions have
    a largest component of 1 in `WRENCH_UNIT`."""
    slack: float = 1e-6
    """Relative tolerance of a load factor: of the linear programs' feasibility, twice over."""
    over: float = 1e-9
    """Part of its capacity by which a row of a whole hand may be exceeded by rounding."""
    first_buffer: int = 1024
    """Stances that the first buffer of what passes holds; it doubles when it is full."""
    most_passing: int = 50_000_000
    """Stances that may pass in one call: 1.6 GB of indices."""


SCREENING_SETTINGS: Final = ScreeningSettings()
