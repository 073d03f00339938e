"""The largest loads that count where no limit does: far beyond any strength."""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array
from planner.programs.scaled_rows import LOAD_UNIT, WRENCH_UNIT

__all__ = ["LOAD_BOX", "load_box"]

LOAD_BOX: Final = 1e4
"""Bound on every load, in `LOAD_UNIT`, where no limit counts: far beyond any strength."""


def load_box(wrench: Array) -> float:
    """Return the bound on every load, in `LOAD_UNIT`, where no limit counts, for a body wrench.

    `LOAD_BOX`, or a hundred times the force that the body needs if that is more, as for bodies of
    a tonne and above. With larger loads hands do little but squeeze each other, where hard rows
    nearly contradict the balance.

    Parameters
    ----------
    wrench : ndarray, shape (nb,)
        Body wrench, then prescribed components of hands' wrenches, in `WRENCH_UNIT`.
    """
    force = float(np.linalg.norm(wrench[:3] * WRENCH_UNIT[:3]))
    return max(LOAD_BOX, 100.0 * force / LOAD_UNIT)
