"""Where fingers can be on rock with joints at their limits, many at once (Section 5.7).

A finger has three joints, so three conditions fix it: each phalanx on the rock is one, each joint
at a limit another. With fewer contacts than phalanges, joints at their limits make one link of the
phalanges on both sides. `PATTERNS` lists all such states, `at_limits` finds them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.model import FingerModel, Stop
from hand_models.finger.postures import (
    FREE,
    JOINTS,
    LOWER,
    STOPS,
    UPPER,
    Codes,
    Postures,
    are_clear,
    bear,
)
from hand_models.finger.sequential_closure import NONE
from hand_models.sections import Flags, SectionRows, Span

__all__ = ["OPEN_FIRST", "PATTERNS", "Pattern", "at_limits"]


@dataclass(frozen=True)
class Pattern:
    """A contact state: which joints stand at which limit, and which phalanges bear.

    The phalanges from a free joint to the next one are a link; one of each link bears.

    Attributes
    ----------
    stops : tuple of {'upper', 'lower', None}
        Of each joint; None where it is free.
    bearing : tuple of int
        Phalanges on the rock.
    """

    stops: tuple[Stop | None, ...]
    bearing: tuple[int, ...]


def _links(stops: tuple[Stop | None, ...]) -> list[range]:
    """Return the phalanges of each link that can turn."""
    free = [i for i, stop in enumerate(stops) if stop is None]
    return [range(i, j) for i, j in itertools.pairwise([*free, len(stops)])]


def _patterns() -> Iterator[Pattern]:
    choices: tuple[Stop | None, ...] = (None, "upper", "lower")
    for stops in itertools.product(choices, repeat=JOINTS):
        for bearing in itertools.product(*_links(stops)):
            yield Pattern(stops, bearing)


PATTERNS: Final = tuple(sorted(_patterns(), key=lambda pattern: -len(pattern.bearing)))
"""Every contact state that Eq. 6 can be solved for, those with most contacts first."""

OPEN_FIRST: Final = np.array(
    sorted(
        (i for i, pattern in enumerate(PATTERNS) if not pattern.bearing),
        key=lambda i: -PATTERNS[i].stops.count("lower"),
    )
)
"""Those without contact, the open finger first."""


class _Links(NamedTuple):
    """Patterns as numbers, shapes (3, number of patterns); links count at their first phalanx.

    Attributes
    ----------
    stops : ndarray of int8
    limits : ndarray
        Angle of a joint at its limit [rad].
    bearing : ndarray of bool
    leads : ndarray
        Angle of the phalanx that bears from the link's first [rad].
    alongs, rises : ndarray
        Its joint from the link's, along it and above it [m].
    """

    stops: Codes
    limits: Array
    bearing: Flags
    leads: Array
    alongs: Array
    rises: Array

    def take(self, patterns: Indices) -> _Links:
        """Return those of some patterns."""
        stops, limits, bearing, leads, alongs, rises = self
        return _Links(
            stops[:, patterns],
            limits[:, patterns],
            bearing[:, patterns],
            leads[:, patterns],
            alongs[:, patterns],
            rises[:, patterns],
        )


@lru_cache(maxsize=32)
def _tables(model: FingerModel) -> _Links:
    shape = JOINTS, len(PATTERNS)
    tables = _Links(
        np.array([[STOPS.index(stop) for stop in p.stops] for p in PATTERNS], dtype=np.int8).T,
        np.zeros(shape),
        np.zeros(shape, dtype=bool),
        *np.zeros((3, *shape)),
    )
    for limits, code in ((model.joint_upper, UPPER), (model.joint_lower, LOWER)):
        tables.limits[:] += np.where(tables.stops == code, np.array(limits)[:, None], 0.0)
    for column, pattern in enumerate(PATTERNS):
        for link, bearing in zip(_links(pattern.stops), pattern.bearing, strict=True):
            angle, joint = 0.0, 0.0j
            for i in range(link.start + 1, bearing + 1):
                joint += model.joint_spacing * np.exp(1j * angle)
                angle += tables.limits[i, column]
            there = joint * np.exp(-1j * angle)
            tables.bearing[bearing, column] = True
            tables.leads[link.start, column] = angle
            tables.alongs[link.start, column] = there.real
            tables.rises[link.start, column] = there.imag
    return tables


def at_limits(model: FingerModel, rock: SectionRows, patterns: Indices) -> tuple[Postures, Flags]:
    """Return fingers in the contact states of `PATTERNS` that are asked for.

    And whether each is possible: every phalanx that is to bear finds rock, none stands in it.

    Parameters
    ----------
    model : FingerModel
    rock : SectionRows
        Under each finger.
    patterns : ndarray of int, shape (n,)
    """
    near, _ = model.tile_range
    links = _tables(model).take(patterns)
    fingers = Postures.empty(len(patterns))
    possible, flat = np.ones((2, len(patterns)), dtype=bool)
    before, distance = np.zeros((2, len(patterns)))
    for i in range(JOINTS):
        joint, angle = fingers.joints[i], before + links.limits[i]
        free = (possible & (links.stops[i] == FREE)).nonzero()[0]
        if len(free):
            along, lead, first = links.alongs[i, free], links.leads[i, free], before[free]
            span = Span.of(
                along + near, along + model.joint_spacing, links.rises[i, free] + model.tile_height
            )
            low, high = first + model.joint_lower[i] + lead, first + model.joint_upper[i] + lead
            rests = rock.take(free).rests(joint[free], span, low, high)
            possible[free] = ~(rests.blocked | np.isnan(rests.angle))
            angle[free], distance[free] = rests.angle - lead, rests.distance - along
            flat[free] = rests.flat
        contact = np.full(len(patterns), model.tile_centre)
        kind = np.full(len(patterns), NONE, dtype=np.int8)
        bears = (possible & links.bearing[i]).nonzero()[0]
        if len(bears):
            contact[bears], kind[bears] = bear(
                model, rock.take(bears), joint[bears], angle[bears], distance[bears], flat[bears]
            )
        fingers.put(model, i, (angle, contact, kind, links.stops[i]))
        before = angle
    whole = possible.nonzero()[0]
    possible[whole] = are_clear(model, rock.take(whole), fingers.take(whole))
    return fingers, possible
