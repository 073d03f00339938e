"""Rock in the planes of many fingers as points, each of which represents a length of boundary."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, go_on
from hand_models.sections.finger_rock import FingerRock
from hand_models.sections.section import Complexes, Flags, Section
from hand_models.sections.settings import SECTION_SETTINGS

__all__ = ["Outlines"]


class Outlines(NamedTuple):
    """Points on the rock in the planes of n fingers: p points for each, in blocks of 16.

    Fingers with fewer points, or places of strips, are filled up with some 1 km away.

    Attributes
    ----------
    points : ndarray of complex, shape (n, p)
        s + i t of places on the rock, one boundary curve after another [m].
    lengths : ndarray, shape (n, p)
        Length of the rock's boundary that each point represents [m]; beside the tiles the less, the
        less the rock stands out of that under them.
    centres : ndarray of complex, shape (n, p / 16)
        Centre of a bounding circle of each block [m].
    radii : ndarray, shape (n, p / 16)
        Radius of that circle [m].
    halves : ndarray of complex, shape (n, p / 16)
        Vector along each block from its centre, as long as it goes to either side [m].
    thick : ndarray, shape (n, p / 16)
        How far its points are beside the line along that vector, at most [m].
    longest : ndarray, shape (n, p / 16)
        Largest of the lengths in each block [m].
    bare : ndarray of bool, shape (n, p)
        True for rock that the bare frame meets, beside the tiles, and for what fills up.
    places, ways, behind, across : ndarray, shapes (n, c), (n, c), (n, c, k) and (n, k)
        Rock in the strips across each finger's tiles, as in `RockStrips`.
    place_centres, place_radii : ndarray, shape (n, c / 16)
        Centre and radius of a bounding circle of each block of 16 places [m].
    """

    points: Complexes
    lengths: Array
    centres: Complexes
    radii: Array
    halves: Complexes
    thick: Array
    longest: Array
    bare: Flags
    places: Complexes
    ways: Complexes
    behind: Array
    across: Array
    place_centres: Complexes
    place_radii: Array

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Return these arrays as compiled functions take them, those of a kind together."""
        return (
            (self.points, self.lengths, self.bare),
            (self.centres, self.radii, self.halves, self.thick, self.longest),
            (self.places, self.ways, self.behind),
            (self.place_centres, self.place_radii),
            self.across,
        )

    @classmethod
    def of(cls, rocks: Sequence[FingerRock], reach: float, spacing: float) -> Outlines:
        """Sample the boundaries of the rock under fingers.

        Parameters
        ----------
        rocks : sequence of FingerRock, length n
        reach : float
            Distance from the origin beyond which rock is left out [m].
        spacing : float
            Largest distance between neighbouring points [m].
        """
        from hand_models.sections.compiled_outlines import bounds_of_blocks

        block = SECTION_SETTINGS.points_per_circle
        taken = []
        for rock in rocks:
            go_on()
            under = _points(rock.tile, reach, spacing)
            taken.append((under, _standing_out(rock, reach, spacing)))
        blocks = math.ceil(max([1, *(len(a[0]) + len(b[0]) for a, b in taken)]) / block)
        # what stands for no rock is 1 km away, and next to nothing long
        points = np.full((len(taken), blocks * block), complex(1e3))
        lengths = np.full(points.shape, SECTION_SETTINGS.no_length)
        bare = np.zeros(points.shape, dtype=bool)
        for i, (under, beside) in enumerate(taken):
            for values, own, more in zip((points, lengths), under, beside, strict=True):
                values[i, : len(own) + len(more)] = np.concatenate([own, more])
            bare[i, len(under[0]) :] = True
        strips = [rock.strips for rock in rocks]
        k = max(len(each.across) for each in strips)
        in_blocks = math.ceil(max([1, *(len(each.places) for each in strips)]) / block)
        places = np.full((len(rocks), in_blocks * block), 1e3 + 0j)
        ways, behind, across = (
            np.ones_like(places),
            np.zeros((*places.shape, k)),
            np.zeros((len(rocks), k)),
        )
        for i, each in enumerate(strips):
            there = slice(len(each.places))
            places[i, there], ways[i, there] = each.places, each.ways
            behind[i, there] = each.behind
            across[i] = each.across
        longest = lengths.reshape(len(taken), blocks, block).max(axis=-1)
        bounds, circles = bounds_of_blocks(points, block), bounds_of_blocks(places, block)[:2]
        strips_of = places, ways, behind, across
        return cls(points, lengths, *bounds, longest, bare, *strips_of, *circles)

    def distances(self, places: Complexes) -> Array:
        """Return the distance of each of m places from the nearest point of a single finger's rock.

        ``places``: s + i t, shape (m,) [m].
        """
        from hand_models.sections.compiled_outlines import rock_distances

        return rock_distances(places, self.points[0], self.centres[0], self.radii[0])

    def least_distance(self, places: Complexes) -> float:
        """Return the least of `distances`, in much less time than all of them [m]."""
        from hand_models.sections.compiled_outlines import least_distance

        sides = self.points[0], self.centres[0], self.radii[0]
        return least_distance(places, SECTION_SETTINGS.points_per_circle, *sides)


def _standing_out(rock: FingerRock, reach: float, spacing: float) -> tuple[Complexes, Array]:
    """Return places of the rock beside the tiles, and their lengths as of `Outlines`.

    What does not stand out of the rock under the tiles is there already, and counts once.
    """
    places, lengths = _points(rock.frame, reach, spacing)
    if rock.tile is not None and len(places):
        out = rock.tile.clearances(places) / SECTION_SETTINGS.standing_out
        lengths = np.maximum(lengths * np.clip(out, 0.0, 1.0), SECTION_SETTINGS.no_length)
    return places, lengths


def _points(section: Section | None, reach: float, spacing: float) -> tuple[Complexes, Array]:
    """Return places along the boundary within reach, at its corners as well, and their lengths."""
    from hand_models.sections.compiled_polylines import equal_parts

    found: list[tuple[Complexes, Array]] = []
    for chain in () if section is None else section.outline(reach, spacing):
        curve, sizes = np.ascontiguousarray(chain), np.abs(np.diff(chain))
        found.append(equal_parts(curve, sizes, reach, spacing, BASE_TOLERANCES.relative))
    if len(found) == 1:
        return found[0]
    nothing = np.zeros(0, dtype=complex), np.zeros(0)
    points, lengths = (np.concatenate(values) for values in zip(nothing, *found, strict=True))
    return points, lengths
