"""Plans of all wrenches near one, from 13 that are solved: a convex interpolation, with its gap.

About a centre w₀ the plans y₀ of w₀ and y_k± of w₀ ± δ_k e_k along the six axes are solved. Loads
that balance a wrench do so linearly, and limits are convex, so for every wrench with

    t_k = (w − w₀)_k / δ_k,    Σ |t_k| ≤ 1,

the mixture y = y₀ + Σ |t_k| (y_k± − y₀) is a plan of w, its utilisation at most the same mixture of
theirs. How far that is from the least is known from below: what the multipliers of each of the 13
prove holds for every wrench (`planner.streaming.affine_bounds`).
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
    """Plans of the wrenches about a centre.

    Attributes
    ----------
    centre : ndarray, shape (6,)
        w₀ in B [N, N·m].
    radius : float
        δ of forces [N].
    middle : ndarray, shape (n,)
        y₀ of all hands, one after the other [N].
    sides : ndarray, shape (12, n)
        y_k± − y₀: first along + of the axes, then along −.
    slopes, constants : ndarray, shapes (c, 6), (c,)
        Least utilisation ≥ slopes · w + constants.
    utilisation, most : float
        Of the plan of the centre, and the largest of the 13.
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
        """Solve the 13 plans; None where one of them has no plan, or no proof."""
        per = 1.0 / (radius * PER_RADIUS)
        steps = np.diag(1.0 / per)
        loads, cuts, used = [], [], []
        for aside in (np.zeros(6), *steps, *-steps):
            solved = stance.solve(centre + aside)
            if solved is None:
                return None
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
        """Return Σ |t|; the interpolation is for wrenches where it is at most 1."""
        return float(np.abs((wrench - self.centre) * self._per).sum())

    def at(self, wrench: Array) -> tuple[float, Array]:
        """Return Σ |t| and the loads y of a wrench, all hands' one after the other, (n,) [N]."""
        t = (wrench - self.centre) * self._per
        parts = np.empty(12)
        forth, back = parts[:6], parts[6:]
        np.maximum(t, 0.0, out=forth)
        np.subtract(forth, t, out=back)
        loads = parts @ self.sides
        loads += self.middle
        return float(np.add.reduce(parts)), loads

    def bound(self, wrench: Array) -> float:
        """Return a lower bound of a wrench's least utilisation."""
        return float(np.maximum.reduce(self.slopes @ wrench + self.constants))
