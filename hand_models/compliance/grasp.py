"""What every compliant grasp tells of poses of its wrist: wrenches, limits, a set about a pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = ["CompliantGrasp", "Evaluation", "Verdict", "range_rows"]


class Verdict(NamedTuple):
    """How near its limits a grasp is at m poses of its wrist.

    Attributes
    ----------
    utilisation : ndarray, shape (m,)
        The largest of all limit rows; infinite where a phalanx finds no rock.
    limiting : ndarray of int, shape (m,)
        That row.
    violation : ndarray, shape (m,)
        By how much the hard rows are broken at most; not above zero where they hold [N].
    """

    utilisation: Array
    limiting: Indices
    violation: Array

    @property
    def holds(self) -> NDArray[np.bool_]:
        """Whether nothing lets go, shape (m,)."""
        return (self.utilisation <= 1.0) & (self.violation <= 0.0)


class Evaluation(NamedTuple):
    """Wrenches on the rock, shape (m, 6) [N, N·m], and how near its limits the grasp is."""

    wrenches: Array
    verdict: Verdict


class CompliantGrasp(Protocol):
    """A grasp that gives way: a whole hand, or a gripper in a plane."""

    @property
    def limits(self) -> tuple[Row, ...]:
        """Limit rows, which `Verdict.limiting` counts."""

    def sieve(self, twists: Array) -> Indices:
        """Return which poses may hold; those left out do not."""

    def evaluate(self, twists: Array) -> Evaluation:
        """Return wrenches and limits at wrist poses of shape (m, d)."""

    def linearised(
        self, twist: ArrayLike | None = None, *, within: ArrayLike | None = None
    ) -> WrenchSpace:
        """Return the set linearised at a pose, of d columns."""


def range_rows(
    columns: Sequence[str], at: Array, within: ArrayLike
) -> tuple[Array, Array, tuple[Row, ...]]:
    """Return hard rows (H, h, names) that keep a wrist within a box about a pose.

    Parameters
    ----------
    columns : sequence of str
        Names of the pose's components, such as ``wrist/vx``.
    at : ndarray, shape (d,)
        The middle of the box [m, rad].
    within : array_like, shape (d,)
        Its half widths.
    """
    inverse = np.diag(1.0 / np.asarray(within, dtype=float))
    sides = np.vstack([inverse, -inverse])
    names = tuple(
        Row(None, None, "wrist_range", "hard", f"wrist_range/{name.split('/')[1]}{sign}")
        for sign in "+-"
        for name in columns
    )
    return sides, 1.0 + sides @ at, names
