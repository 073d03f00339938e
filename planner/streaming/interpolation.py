"""Plans of all wrenches near a centre, by convex interpolation of 13 solved plans, with their gap.

About a centre w₀ the plans y₀ of w₀ and y_k± of w₀ ± δ_k e_k along the six axes k are solved. Loads
that balance a wrench depend linearly on that wrench, and limits are convex, so for every wrench w
with

    t_k = (w − w₀)_k / δ_k,    Σ |t_k| ≤ 1,

the mixture y = y₀ + Σ |t_k| (y_k± − y₀) is a plan of w, with a utilisation of at most the same
mixture of theirs. A lower bound of the least utilisation is known, too: what the multipliers of
each of the 13 plans prove is valid for every wrench (`planner.streaming.affine_bounds`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array
from planner.programs import WRENCH_UNIT
from planner.streaming.stream_stance import StreamStance

__all__ = ["PER_RADIUS", "Interpolation"]

PER_RADIUS: Final = WRENCH_UNIT / WRENCH_UNIT[0]
"""δ over the radius, which is that of the forces [1, m]: moments have a lever of 0.1 m."""


@dataclass(frozen=True, eq=False)
class Interpolation:
    """Plans of the body wrenches near a centre, interpolated between 13 solved plans.

    Attributes
    ----------
    centre : ndarray, shape (6,)
        Body wrench w₀ at the centre, in B [N, N·m].
    radius : float
        Distance δ from the centre to the solved plans along a force [N].
    middle : ndarray, shape (n,)
        Loads y₀ at the centre, for one hand after the other [N].
    sides : ndarray, shape (12, n)
        Differences y_k± − y₀ [N]: first for + along the six axes, then for −.
    slopes, constants : ndarray, shapes (c, 6), (c,)
        Lower bounds of the utilisation of a wrench w: slopes · w + constants [1/N, 1/(N·m)].
    utilisation, most : float
        Utilisation at the centre, and the largest of the 13 plans.
    """

    centre: Array
    radius: float
    middle: Array
    sides: Array
    slopes: Array
    constants: Array
    utilisation: float
    most: float
    _per: Array

    @classmethod
    def about(cls, stance: StreamStance, centre: Array, radius: float) -> Interpolation | None:
        """Solve the 13 plans about a centre, and return their interpolation.

        Parameters
        ----------
        stance : StreamStance
        centre : ndarray, shape (6,)
            Body wrench in B [N, N·m].
        radius : float
            Distance from the centre to the solved plans along a force [N].

        Returns
        -------
        Interpolation or None
            None if one of the 13 wrenches has no proven plan, or no lower bound is known.
        """
        per = 1.0 / (radius * PER_RADIUS)
        steps = np.diag(1.0 / per)
        loads, cuts, used, first = [], [], [], None
        for aside in (np.zeros(6), *steps, *-steps):
            solved = stance.solve(centre + aside, first)
            if solved is None:
                return None
            first = first or solved
            loads.append(solved.loads.ravel())
            used.append(solved.outcome.value)
            found = stance.affine_bound(centre + aside, solved)
            if found is not None:
                cuts.append(found)
        if not cuts:
            return None
        middle, *others = loads
        return cls(
            centre=centre,
            radius=radius,
            middle=middle,
            sides=np.array(others) - middle,
            slopes=np.array([one.slope for one in cuts]),
            constants=np.array([one.constant for one in cuts]),
            utilisation=used[0],
            most=max(used),
            _per=per,
        )

    def distance(self, wrench: Array) -> float:
        """Return the relative distance ``Σ |t|`` of a body wrench (6,) from the centre.

        The interpolation is valid up to a distance of 1.
        """
        return float(np.abs((wrench - self.centre) * self._per).sum())

    def at(self, wrench: Array) -> tuple[float, Array]:
        """Return the relative distance ``Σ |t|`` and the interpolated loads of a body wrench.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Body wrench in B [N, N·m].

        Returns
        -------
        distance : float
            ``Σ |t|``; the loads are a plan only if it is at most 1.
        loads : ndarray, shape (n,)
            Loads y, for one hand after the other [N].
        """
        t = (wrench - self.centre) * self._per
        parts = np.empty(12)
        forth, back = parts[:6], parts[6:]
        np.maximum(t, 0.0, out=forth)
        np.subtract(forth, t, out=back)
        loads = parts @ self.sides
        loads += self.middle
        return float(np.add.reduce(parts)), loads

    def bound(self, wrench: Array) -> float:
        """Return a lower bound of the least utilisation for a body wrench (6,) in B [N, N·m]."""
        return float(np.maximum.reduce(self.slopes @ wrench + self.constants))
