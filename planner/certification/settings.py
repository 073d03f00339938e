"""Tolerances of the check of certificates, and the sizes that it works with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["CERTIFICATION_SETTINGS", "CertificationSettings"]


@dataclass(frozen=True, slots=True)
class CertificationSettings:
    """Tolerances and sizes of the check of a certificate."""

    rounding: float = 1e-12
    """Part of the magnitudes of a sum's terms by which the sum may be wrong [1]: it has fewer than
    a thousand roundings of 1.1e-16 each. A state within it counts as held."""
    factor_error: float = 1e-6
    """Relative tolerance of a route's load factors [1]: twice the feasibility of linear programs,
    1e-7, with room for badly scaled ones."""
    balance_error: float = 1e-7
    """Largest residual of a route's balance of forces, in the certificate's unit of wrenches."""
    first_directions: int = 16
    """Directions that all states are compared with; those left, with four times as many, and so on.
    """
    block: int = 200_000
    """States that are reached together."""
    compared: int = 8_000
    """States that are compared with directions together: arrays of 1 to 20 MB. With all of a block
    together, a wall of 510 placements takes 0.8 GB in place of 0.35, and no less time."""
    neighbours: int = 16
    """States next to one, about."""
    programs: int = 64
    """Linear programs of one hand that are solved as one, which takes less time."""


CERTIFICATION_SETTINGS: Final = CertificationSettings()
