"""Ways in joint space: proof that they are clear, and a search for them (RRT-Connect).

Two trees grow toward each other from both ends of the way (Kuffner and LaValle, *RRT-Connect: an
efficient approach to single-query path planning*, IEEE International Conference on Robotics and
Automation, 2000). The search is deterministic.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from planner import deadline
from planner.motion.collisions import JointSpace, NearestPair
from planner.motion.settings import MOTION_SETTINGS

__all__ = ["Clear", "check_way", "search_way", "way_length"]


class Clear(NamedTuple):
    """Least distances along a way of straight lines in joint space.

    Attributes
    ----------
    nearest : NearestPair
        The least distance at the postures that were looked at.
    bound : float
        Proven lower bound of all distances anywhere on the way [m]; minus infinity if it is not
        clear.
    """

    nearest: NearestPair
    bound: float

    @property
    def clear(self) -> bool:
        """True if the way is proven to be clear."""
        return self.bound > -np.inf


def check_way(space: JointSpace, postures: Array, margin: float) -> Clear:
    """Prove that straight lines between postures are clear, or find where they are not.

    Intervals are halved until no distance can fall below half of the least one, or of the margin,
    between two postures, by the distances at both and bounds of how much they change.

    Parameters
    ----------
    space : JointSpace
    postures : ndarray, shape (m, d)
        Joint angles of the postures [rad].
    margin : float
        Least distance at every posture that is looked at, above 0 [m].

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    values = space.clearances(postures)
    worst, least = postures[values.min(axis=1).argmin()], float(values.min())
    first, second = postures[:-1], postures[1:]
    low, high, bound = values[:-1], values[1:], least
    while least >= margin and len(first):
        deadline.check("a limb's way was proven to be clear")
        motion = space.motions(second - first)
        proven = np.minimum(np.minimum(low, high), 0.5 * (low + high - motion)).min(axis=1)
        open_ = proven < 0.5 * least
        bound = min(bound, float(proven[~open_].min(initial=np.inf)))
        if not open_.any():
            return Clear(space.nearest(worst), bound)
        first, second, low, high = first[open_], second[open_], low[open_], high[open_]
        middle = 0.5 * (first + second)
        between = space.clearances(middle)
        if between.min() < least:
            worst, least = middle[between.min(axis=1).argmin()], float(between.min())
        first, second = np.concatenate([first, middle]), np.concatenate([middle, second])
        low, high = np.concatenate([low, between]), np.concatenate([between, high])
    if least >= margin:
        return Clear(space.nearest(worst), bound)
    return Clear(space.nearest(worst), -np.inf)


class _Tree:
    """Postures that were reached, each from an earlier one."""

    def __init__(self, roots: Array) -> None:
        self._nodes, self._parents = list(roots), [-1] * len(roots)

    def nearest(self, target: Array) -> int:
        away = np.array(self._nodes) - target
        return int(np.einsum("nd,nd->n", away, away).argmin())

    def grow(
        self, space: JointSpace, target: Array, margin: float, most: float
    ) -> tuple[int, bool]:
        """Grow straight to a posture, as far as it is clear and at most so far [rad].

        Return the last node, and whether it is the target.
        """
        at = self.nearest(target)
        start = self._nodes[at]
        way = target - start
        length = float(np.linalg.norm(way))
        if length > most:
            way, target = way * (most / length), start + way * (most / length)
        clear, postures = _clear_part(space, start, target, margin)
        step = MOTION_SETTINGS.node_step
        done = clear / len(postures) * min(length, most)
        count = int(np.ceil(done / step)) if clear else 0
        for k in np.ceil(np.linspace(0.0, clear, count + 1)[1:]).astype(int).tolist():
            self._nodes.append(postures[k - 1])
            self._parents.append(at)
            at = len(self._nodes) - 1
        return at, clear == len(postures) and length <= most

    def branch(self, at: int) -> list[Array]:
        """Return the postures from a node back to its root."""
        found = []
        while at >= 0:
            found.append(self._nodes[at])
            at = self._parents[at]
        return found

    def __getitem__(self, at: int) -> Array:
        node: Array = self._nodes[at]
        return node


def _clear_part(space: JointSpace, start: Array, end: Array, margin: float) -> tuple[int, Array]:
    """Return how many postures on a line are clear before the first that is not, and them all."""
    motion = float(space.motions((end - start)[None]).max())
    count = max(1, int(np.ceil(motion / MOTION_SETTINGS.search_step)))
    postures = start + np.linspace(0.0, 1.0, count + 1)[1:, None] * (end - start)
    done, batch = 0, 16
    while done < count:
        part = postures[done : done + batch]
        good = space.clearances(part, margin).min(axis=1) >= margin
        if not good.all():
            return done + int(good.argmin()), postures
        done += len(part)
        batch *= 2
    return count, postures


def way_length(way: Array) -> float:
    """Return the length of a way of straight lines in joint space, shape (m, d) [rad]."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def search_way(
    space: JointSpace, start: Array, goals: Array, margin: float, seed: int, tries: int
) -> tuple[Array, Clear] | None:
    """Search a clear way from a posture to one of several, shortened by straight lines.

    Parameters
    ----------
    space : JointSpace
    start : ndarray, shape (d,)
        Joint angles [rad].
    goals : ndarray, shape (g, d)
        Joint angles of the postures one of which the way ends in [rad].
    margin : float
        Least distance at the postures that are looked at [m].
    seed : int
        Seed of the random directions.
    tries : int
        Number of directions in which a tree grows, at most.

    Returns
    -------
    way : ndarray, shape (m, d)
        Joint angles at the corners of the way [rad].
    seen : Clear
        Its proof. None is returned if no way was found.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    rng = np.random.default_rng(seed)
    trees = _Tree(start[None]), _Tree(goals)
    ends = np.vstack([start, goals])
    low, high = ends.min(axis=0), ends.max(axis=0)
    most = np.pi
    for k in range(tries):
        deadline.check("a limb's way to its new hold was found")
        # first about the ends, then everywhere
        wide = np.pi * (k + 1) / tries
        lower, upper = np.maximum(low - wide, space.lower), np.minimum(high + wide, space.upper)
        one, other = trees if k % 2 == 0 else trees[::-1]
        at, _ = one.grow(space, rng.uniform(lower, upper), margin, most)
        to, met = other.grow(space, one[at], margin, np.inf)
        if met:
            first, second = one.branch(at), other.branch(to)
            way = [*first[::-1], *second[1:]] if k % 2 == 0 else [*second[::-1], *first[1:]]
            short = _shortened(space, np.array(way), margin, rng)
            seen = check_way(space, short, margin)
            if seen.clear:
                return short, seen
            # something is met between two postures that were looked at: the trees go on
    return None


def _shortened(space: JointSpace, way: Array, margin: float, rng: np.random.Generator) -> Array:
    """Return a way with straight lines between places on it where these are clear."""
    for _ in range(MOTION_SETTINGS.shortcuts):
        if len(way) <= 2:
            break
        lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
        along = np.append(0.0, np.cumsum(lengths))
        a, b = np.sort(rng.uniform(0.0, along[-1], 2))
        i, j = (int(np.searchsorted(along, each, side="right")) - 1 for each in (a, b))
        i, j = min(i, len(way) - 2), min(j, len(way) - 2)
        if i == j:
            continue
        first = way[i] + (a - along[i]) / lengths[i] * (way[i + 1] - way[i])
        second = way[j] + (b - along[j]) / lengths[j] * (way[j + 1] - way[j])
        clear, postures = _clear_part(space, first, second, margin)
        if clear == len(postures):
            way = np.vstack([way[: i + 1], first, second, way[j + 1 :]])
    keep = np.append(True, np.linalg.norm(np.diff(way, axis=0), axis=1) > 0.0)
    return np.asarray(way[keep])
