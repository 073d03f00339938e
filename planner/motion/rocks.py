"""Rock that limbs are kept clear of: holds where they are in the world, and distances from them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Pose, stored
from hand_models.hand import SettledHand
from hand_models.rock import Hold, TriangleCells
from planner.question import HandOnHold
from planner.scene import SCENE_SETTINGS, smooth_depths

__all__ = ["Rock", "distances_from_rock", "rocks_of"]


class Rock(NamedTuple):
    """A hold in the world.

    Attributes
    ----------
    name : str
        Name in messages.
    hold : Hold
    pose : Pose
        Pose of the hold's frame in the world frame W.
    limbs : frozenset of str
        Limbs whose hand may touch it.
    """

    name: str
    hold: Hold
    pose: Pose
    limbs: frozenset[str]


def rocks_of(hands: Iterable[tuple[HandOnHold, SettledHand]]) -> tuple[Rock, ...]:
    """Return the rock of hands; rock that several have, at the same place, once.

    Parameters
    ----------
    hands : iterable of (HandOnHold, SettledHand)
        Hands of a climb, each closed on its hold. A limb may have several, one after the other.
    """
    found: list[Rock] = []
    for hand, settled in hands:
        pose = hand.pose @ settled.seating.pose
        for i, rock in enumerate(found):
            off = np.append(rock.pose.position - pose.position, rock.pose.rotation - pose.rotation)
            if rock.hold == hand.hold and np.abs(off).max() < 1e-9:  # [m, 1] rounding
                found[i] = rock._replace(limbs=rock.limbs | {hand.limb})
                break
        else:
            found.append(Rock(f"rock of {hand.limb}", hand.hold, pose, frozenset({hand.limb})))
    return tuple(found)


def distances_from_rock(hold: Hold, points: Array, most: float) -> Array:
    """Return how far points are from a hold, shape (n,) [m]; negative inside.

    It is exact, but a lower bound for an ellipsoid.

    Parameters
    ----------
    hold : Hold
    points : ndarray, shape (n, 3)
        Points in the hold's frame [m].
    most : float
        Distance up to which it is measured from triangles [m]; farther points have this one.
    """
    if hold.swept is not None:
        return np.asarray(-smooth_depths([hold.swept], points[None])[0])
    cells = _cells(hold) if hold.cells is None else hold.cells
    return cells.distances(points, most)


@stored("rock as cells", 64)
def _cells(hold: Hold) -> TriangleCells:
    """Return the cells of an outline, or of a hold of one's own; the last ones are kept."""
    far = np.full(3, SCENE_SETTINGS.rock_length)
    return TriangleCells(hold.surface(-far, far))
