"""Random postures of a limb, looked up by where they put its hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from hand_models.base import Array
from planner.limbs import LimbChain
from planner.reach.settings import REACH_SETTINGS

__all__ = ["Starts"]


class Starts:
    """Random postures of a limb in a k-d tree of their hand poses; always the same ones.

    Parameters
    ----------
    chain : LimbChain
    """

    def __init__(self, chain: LimbChain) -> None:
        rng, n = np.random.default_rng(0), len(chain.lower)
        low, high = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
        self._angles = rng.uniform(low, high, (REACH_SETTINGS.postures, n))
        self._reach = chain.reach
        self._tree: Any = scipy.spatial.cKDTree(self._features(chain.frames(self._angles)))

    def near(self, targets: Array, first: int, end: int) -> Array:
        """Return joint angles whose hands are near poses, shape (N, end − first, n).

        Parameters
        ----------
        targets : ndarray, shape (N, 3, 4)
            Axes and origins of H in B.
        first, end : int
            Ranks of the postures among the nearest: from first to end − 1.
        """
        ranks = list(range(first + 1, end + 1))
        _, nearest = self._tree.query(self._features(targets), ranks)
        return np.ascontiguousarray(self._angles[nearest])

    def _features(self, frames: Array) -> Array:
        """Return nine numbers of each pose, near each other for poses that are."""
        axes = frames[:, :, :2].reshape(len(frames), 6)
        return np.hstack([frames[:, :, 3] / self._reach, REACH_SETTINGS.axis_weight * axes])
