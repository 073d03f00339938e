"""Settings of wrench spaces: sizes up to which vertices are listed, and tolerances."""

from __future__ import annotations

from dataclasses import dataclass

from hand_models.base import BASE_TOLERANCES

__all__ = ["SETTINGS"]


@dataclass(frozen=True, slots=True)
class WrenchSpaceSettings:
    """Sizes up to which a set's vertices and facets are listed, and tolerances of polytopes."""

    tolerance: float = BASE_TOLERANCES.relative
    """Relative tolerance of the geometry of polytopes; a set thinner than this share is flat."""
    most_rows: int = 250
    """Largest number of coupled rows whose polytope is listed: each row takes a linear program."""
    most_pairs: int = 100_000
    """Largest number of pairs of vertices searched for edges in a cut; see ``pairs_per_vertex``."""
    pairs_per_vertex: int = 5
    """The largest number of pairs is this many per vertex where that exceeds ``most_pairs``."""
    numbers_at_once: int = 2_000_000
    """Numbers in one part of a table that is computed part by part: 16 MB."""
    row_clearance: float = 1e-6
    """Distance by which a redundant row must clear a bounding box to be left out at once."""


SETTINGS = WrenchSpaceSettings()
