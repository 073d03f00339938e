"""Phalanges beside rock, each by the compiled function for one of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.finger.path_state import SETTINGS_RECORD
from hand_models.finger.phalanx_gaps import near_points, phalanx_beside
from hand_models.finger.phalanx_shape import PhalanxShape
from hand_models.sections import Outlines


class Phalanges(NamedTuple):
    """What `phalanx_beside` returns for each of several phalanges, arrays of one shape."""

    gap: np.ndarray
    tile_gap: np.ndarray
    place: np.ndarray
    push: np.ndarray


def beside(
    rock: Outlines,
    shape: PhalanxShape,
    joints: np.ndarray,
    u: np.ndarray,
    depth: np.ndarray,
    near: list[np.ndarray] | None = None,
) -> Phalanges:
    """Return phalanges of one finger beside all of its rock, or beside some of its points each."""
    sides = [values[0] for values in (rock.points, rock.lengths, rock.bare)]
    places = np.broadcast_arrays(joints, u, depth)
    found, bar = [], shape.record
    for i, where in enumerate(zip(*(each.ravel().tolist() for each in places), strict=True)):
        own = sides if near is None else [values[near[i]] for values in sides]
        found.append(phalanx_beside(*own, SETTINGS_RECORD, bar, *where))
    return Phalanges(*(np.reshape(values, np.shape(u)) for values in zip(*found, strict=True)))


def points_near(
    rock: Outlines,
    shape: PhalanxShape,
    joints: np.ndarray,
    u: np.ndarray,
    within: np.ndarray,
) -> list[np.ndarray]:
    """Return the points of its rock on which each phalanx of a finger depends."""
    names = ("points", "lengths", "bare", "centres", "radii", "longest")
    own, bar = [getattr(rock, name)[0] for name in names], shape.record
    places = zip(joints.tolist(), u.tolist(), within.tolist(), strict=True)
    return [near_points(*own, bar, *where) for where in places]
