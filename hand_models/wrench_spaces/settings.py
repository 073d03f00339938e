"""Numbers of the room of wrench spaces: how much it works through before it gives up."""

from __future__ import annotations

from dataclasses import dataclass

from hand_models.base import BASE_TOLERANCES

__all__ = ["SETTINGS"]


@dataclass(frozen=True, slots=True)
class WrenchSpaceSettings:
    """Sizes up to which sets are listed, and tolerances that are the room's own."""

    tolerance: float = BASE_TOLERANCES.relative
    """Relative tolerance of the geometry of polytopes, and of what is flat."""
    most_rows: int = 250
    """Coupled rows whose polytope is listed: each takes a linear program."""
    most_pairs: int = 100_000
    """Pairs of vertices that a cut looks through for edges: 20,000 vertices have some 60,000."""
    pairs_per_vertex: int = 5
    """The same for each vertex, if that is more."""
    numbers_at_once: int = 2_000_000
    """Numbers of a table that is worked through part by part: 16 MB."""
    row_clearance: float = 1e-6
    """Distance by which a row must clear a bounding box to be left out at once."""


SETTINGS = WrenchSpaceSettings()
