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
        found.append(phalanx_beside(*own, SETTINGS_RECORD, bar, *where)[:4])
    return Phalanges(*(np.reshape(values, np.shape(u)) for values in zip(*found, strict=True)))


def points_near(
    rock: Outlines,
    shape: PhalanxShape,
    joints: np.ndarray,
    u: np.ndarray,
    within: np.ndarray,
) -> list[np.ndarray]:
    """Return the points of its rock on which each phalanx of a finger depends."""
    points, blocks = (tuple([each[0] for each in kind]) for kind in rock.arrays[:2])
    bar = shape.record
    places = zip(joints.tolist(), u.tolist(), within.tolist(), strict=True)
    return [near_points(*points, blocks, bar, *where) for where in places]
