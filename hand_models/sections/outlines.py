"""Rock in the planes of many fingers as points along its boundary, each with its share of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.sections.section import Complexes, Section

__all__ = ["Outlines"]

FAR: Final = 1e3
"""Where points are that stand for no rock [m]."""

NOTHING: Final = 1e-12
"""Their lengths [m]."""

ROUNDING: Final = 1e-9
"""Of how many parts a piece has."""


class Outlines(NamedTuple):
    """Rock in the planes of n fingers.

    Attributes
    ----------
    points : ndarray of complex, shape (n, p)
        s + i t of places on the rock, in any order [m].
    lengths : ndarray, shape (n, p)
        Of the rock's boundary that each stands for [m].
    """

    points: Complexes
    lengths: Array

    @classmethod
    def of(
        cls, sections: Sequence[Section | None], reach: float, spacing: float, least: int
    ) -> Outlines:
        """Gather sections, one for each finger; None where there is no rock.

        Parameters
        ----------
        sections : sequence of Section or None, length n
        reach : float
            How far from the origin rock counts [m].
        spacing : float
            Of the points, at most [m].
        least : int
            How many points there are at least.
        """
        taken = [_points(section, reach, spacing) for section in sections]
        shape = len(taken), max([least, *(len(each.points) for each in taken)])
        made = cls(np.full(shape, complex(FAR)), np.full(shape, NOTHING))
        for i, each in enumerate(taken):
            for values, own in zip(made, each, strict=True):
                values[i, : len(own)] = own
        return made


def _points(section: Section | None, reach: float, spacing: float) -> Outlines:
    """Return places in the middle of equal parts of the boundary within reach."""
    found = [Outlines(np.zeros(0, dtype=complex), np.zeros(0))]
    for chain in () if section is None else section.outline(reach, spacing):
        begin, step = chain[:-1], np.diff(chain)
        size = np.abs(step)
        part = -(begin * step.conj()).real / np.maximum(size * size, NOTHING**2)
        near = np.abs(begin + np.clip(part, 0.0, 1.0) * step) <= reach
        # runs of pieces that come within reach
        ends = np.diff(near.astype(np.int8), prepend=0, append=0).nonzero()[0]
        for first, last in ends.reshape(-1, 2).tolist():
            found.append(_parts(chain[first : last + 1], size[first:last], spacing))
    points, lengths = (np.concatenate(values) for values in zip(*found, strict=True))
    kept = np.abs(points) <= reach
    return Outlines(points[kept], lengths[kept])


def _parts(chain: Complexes, size: Array, spacing: float) -> Outlines:
    """Return places in the middle of equal parts of a chain whose pieces have these lengths [m]."""
    at = np.append(0.0, np.cumsum(size))
    count = max(math.ceil(at[-1] / spacing - ROUNDING), 1)
    middle = (np.arange(count) + 0.5) * (at[-1] / count)
    piece = np.clip(np.searchsorted(at, middle, side="right") - 1, 0, len(size) - 1)
    way = np.diff(chain)[piece] / np.maximum(size[piece], NOTHING)
    points = chain[piece] + (middle - at[piece]) * way
    return Outlines(points, np.full(count, at[-1] / count))
