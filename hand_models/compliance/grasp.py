"""A grasp with a compliant wrist: its wrenches and limits at poses, and the set about a pose.

A pose ξ of the wrist determines the loads e (of tiles, tendons, the palm) and the wrench w on the
rock. Limit rows are affine in the loads, or linear in the wrench, with capacities s at the
utilisation u; hard rows are linear in the loads:

    P e + p ≤ u s,    D w ≤ u s,    Q e ≤ q.

With e and w linearised about a pose they are a `WrenchSpace`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.compliance.compliant_finger import COMPLEX_STEP
from hand_models.compliance.link import Numbers
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = [
    "CompliantGrasp",
    "Evaluation",
    "GraspLoads",
    "LoadRows",
    "complex_steps",
    "rows_of_range",
    "slopes",
]


class GraspLoads(NamedTuple):
    """Loads and wrenches of a grasp at m poses of its wrist.

    Attributes
    ----------
    elements : ndarray, shape (m, k)
        e, k loads in the order that the class of the grasp describes [N, or N·m for torques].
    wrenches : ndarray, shape (m, 6)
        w, wrench on the rock [N, N·m].
    reached : ndarray of bool, shape (m,)
        Whether every phalanx with a contact still meets rock.
    """

    elements: Numbers
    wrenches: Numbers
    reached: NDArray[np.bool_]


class LoadRows(NamedTuple):
    """Limit rows and hard rows of a grasp's loads e and wrenches w.

    Attributes
    ----------
    names : tuple of Row
        Limit rows of the loads, limit rows of the wrench, then hard rows.
    P, p : ndarray, shapes (n, k), (n,)
        Limit rows P e + p ≤ u s, utilisation u.
    D : ndarray, shape (nd, 6)
        Limit rows D w ≤ u s.
    s : ndarray, shape (n + nd,)
        Capacities of all limit rows, those of the loads first.
    Q, q : ndarray, shapes (nh, k), (nh,)
        Hard rows Q e ≤ q.
    """

    names: tuple[Row, ...]
    P: Array
    p: Array
    D: Array
    s: Array
    Q: Array
    q: Array


class Evaluation(NamedTuple):
    """Wrenches at m poses of a wrist, and how near its limits the grasp is.

    Attributes
    ----------
    wrenches : ndarray, shape (m, 6)
        Wrench on the rock [N, N·m].
    utilisation : ndarray, shape (m,)
        Largest load over capacity of all limit rows; infinite where a phalanx meets no rock.
    limiting : ndarray of int, shape (m,)
        Index of the limit row with the largest utilisation.
    violation : ndarray, shape (m,)
        Largest violation of the hard rows; not above zero where all are satisfied [N].
    """

    wrenches: Array
    utilisation: Array
    limiting: Indices
    violation: Array

    @property
    def holds(self) -> NDArray[np.bool_]:
        """Return whether each pose is within every limit and hard row, shape (m,)."""
        return (self.utilisation <= 1.0) & (self.violation <= 0.0)


class CompliantGrasp(ABC):
    """Interface of a grasp with a compliant wrist: a whole hand, or a gripper in a plane.

    Attributes
    ----------
    columns : tuple of str, length d
        Names of the components of a pose of its wrist.
    range_rows : tuple of Row, length 2 d
        Hard rows that keep a pose within a range, from `rows_of_range`.
    load_rows : LoadRows
        Limit rows and hard rows of its loads and wrenches.
    """

    columns: ClassVar[tuple[str, ...]]
    range_rows: ClassVar[tuple[Row, ...]]
    load_rows: LoadRows

    @abstractmethod
    def loads_at(self, twists: Numbers) -> GraspLoads:
        """Return loads and wrenches at poses of the wrist.

        Parameters
        ----------
        twists : ndarray, shape (m, d)
            m poses of the wrist, real or with imaginary steps (`complex_steps`).
        """

    @property
    def limits(self) -> tuple[Row, ...]:
        """Limit rows, in the order that `Evaluation.limiting` indexes."""
        return self.load_rows.names[: len(self.load_rows.s)]

    def evaluate(self, twists: Array) -> Evaluation:
        """Return wrenches, utilisation and violations of limits at poses of the wrist.

        Parameters
        ----------
        twists : ndarray, shape (m, d)
            m poses.
        """
        rows, found = self.load_rows, self.loads_at(twists)
        lost = ~found.reached[:, None]
        with np.errstate(invalid="ignore"):
            loads = [found.elements @ rows.P.T + rows.p, found.wrenches @ rows.D.T]
            used = np.where(lost, np.inf, np.concatenate(loads, axis=1) / rows.s)
            broken = np.where(lost, np.inf, found.elements @ rows.Q.T - rows.q)
        most = broken.max(axis=1, initial=-np.inf)
        return Evaluation(found.wrenches, used.max(axis=1), used.argmax(axis=1), most)

    def sieve(self, twists: Array) -> Indices:
        """Return the indices of the poses that may be within the limits, by a quick test.

        All of them by default; a subclass may rule out poses before their full evaluation.

        Parameters
        ----------
        twists : ndarray, shape (m, d)
            m poses.
        """
        return np.arange(len(twists))

    def linearised(
        self, twist: ArrayLike | None = None, *, within: ArrayLike | None = None
    ) -> WrenchSpace:
        """Return the wrench space linearised about a pose of the wrist.

        Parameters
        ----------
        twist : array_like, shape (d,), optional
            ξ₀, pose of the wrist [m, rad]; at rest by default.
        within : array_like, shape (d,), optional
            Largest change of each component of ξ from ξ₀ [m, rad], added as hard rows; no such rows
            by default.
        """
        at = self._pose(twist)
        none = np.zeros((0, len(at))), np.zeros(0)
        return self._about(at, self.loads_at(complex_steps(at)), *none, within)

    def _pose(self, twist: ArrayLike | None) -> Array:
        return self.at_rest if twist is None else np.asarray(twist, dtype=float)

    @property
    def at_rest(self) -> Array:
        """Pose of the wrist at rest, shape (d,)."""
        return np.zeros(len(self.columns))

    def _about(
        self, at: Array, found: GraspLoads, more: Array, most: Array, within: ArrayLike | None
    ) -> WrenchSpace:
        """Return the set about a pose, of what `complex_steps` from it give.

        With the hard rows ``more ξ ≤ most`` besides those of the loads.
        """
        rows = self.load_rows
        start, slope = _affine(found.elements, at)
        origin, generators = _affine(found.wrenches, at)
        H, h = np.vstack([rows.Q @ slope, more]), np.concatenate([rows.q - rows.Q @ start, most])
        names = rows.names
        if within is not None:
            inverse = np.diag(1.0 / np.asarray(within, dtype=float))
            sides = np.vstack([inverse, -inverse])
            H, h = np.vstack([H, sides]), np.concatenate([h, 1.0 + sides @ at])
            names += self.range_rows
        return WrenchSpace(
            origin=origin,
            generators=generators,
            columns=self.columns,
            rows=names,
            L=np.vstack([rows.P @ slope, rows.D @ generators]),
            l0=np.concatenate([rows.P @ start + rows.p, rows.D @ origin]),
            s=rows.s,
            H=H,
            h=h,
            D=rows.D,
        )


def complex_steps(at: Array) -> Numbers:
    """Return copies of a pose for complex-step derivatives.

    Parameters
    ----------
    at : ndarray, shape (d,)
        The pose.

    Returns
    -------
    ndarray of complex, shape (d, d)
        Row i is the pose with an imaginary step in component i.
    """
    return np.asarray(at + 1j * COMPLEX_STEP * np.eye(len(at)))


def slopes(values: Numbers) -> Array:
    """Return derivatives from function values at `complex_steps`.

    Parameters
    ----------
    values : ndarray of complex, shape (d, k)
        Value of the function, k numbers, at each of the d steps.

    Returns
    -------
    ndarray, shape (k, d)
        Column i is the derivative by component i.
    """
    return np.asarray(values.imag.T / COMPLEX_STEP)


def _affine(values: Numbers, at: Array) -> tuple[Array, Array]:
    """Return values at zero, and their slopes, of complex steps; without what is rounding alone."""
    slope = slopes(values)
    slope = np.where(np.abs(slope) > BASE_TOLERANCES.force, slope, 0.0)  # [N/m, N/rad]
    return values[0].real - slope @ at, slope


def rows_of_range(columns: tuple[str, ...]) -> tuple[Row, ...]:
    """Return the names of 2 d hard rows that keep a pose within a range, upper bounds first.

    ``columns``: names of the d components of the pose.
    """
    return tuple(
        Row(None, None, "wrist_range", "hard", f"wrist_range/{name.removeprefix('wrist/')}{sign}")
        for sign in "+-"
        for name in columns
    )
