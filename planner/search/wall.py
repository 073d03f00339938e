"""A wall for the search: placements of hands, poses of the body, and the ends of climbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, Pose
from planner.question import HandOnHold
from planner.reach import ReachTable
from planner.robots import Robot
from planner.screening import ScreeningTable

__all__ = ["Ends", "State", "Wall"]


class State(NamedTuple):
    """A stance by indices.

    Attributes
    ----------
    body : int
        Index of the pose of the body.
    members : tuple of int, length L
        Index of the placement of each limb's hand; −1 for the limb in the air.
    """

    body: int
    members: tuple[int, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Wall:
    """Placements and bodies that climbs are made of, with the tables that bound them.

    Attributes
    ----------
    robot : Robot
    places : tuple of HandOnHold, length P
        Placements; any limb may take any, whatever their own limb is.
    bodies : tuple of Pose, length B
        Poses of the body B in the world frame W, on a grid.
    shifts : ndarray of int, shape (E, 2)
        Pairs of bodies between which the body may be shifted with all hands on the rock, either
        way.
    reach : ReachTable
        Of P placements, B bodies, L limbs.
    screening : ScreeningTable
        Supports of the placements, body wrenches, moments of limbs.
    apart : ndarray of bool, shape (P, P)
        True where two hands may be at both placements at once; false on the diagonal.
    """

    robot: Robot
    places: tuple[HandOnHold, ...]
    bodies: tuple[Pose, ...]
    shifts: Indices
    reach: ReachTable
    screening: ScreeningTable
    apart: NDArray[np.bool_]

    def branches(self, place: int, body: int, limb: int) -> Array:
        """Return the joint angles of a limb in the reach table, shape (a, n) [rad]."""
        n = len(self.robot.chains[self.robot.limbs[limb]].joints)
        return self.reach.branches(place, body, limb)[:, :n]


@dataclass(frozen=True, eq=False, kw_only=True)
class Ends:
    """Stances at which a climb may begin, or has to end, with all hands on the rock.

    Attributes
    ----------
    bodies : ndarray of bool, shape (B,)
        True for the poses of the body that count.
    members : tuple of int, length L, optional
        Placements of the limbs; any by default.
    """

    bodies: NDArray[np.bool_]
    members: tuple[int, ...] | None = None
