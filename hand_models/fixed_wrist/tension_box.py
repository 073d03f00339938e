"""The paper's wrench space of a fixed wrist: tensions alone, each up to f_t(max) (Eqs. 14–16).

Tiles are limited by the curve of Eq. 21 itself, not by half-planes; the wrench space has neither
palm nor lateral reactions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, EmptySetError
from hand_models.fixed_wrist.space import wrench_space
from hand_models.hand import FINGERS, SettledHand
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = ["TensionLimit", "parallelepiped", "tension_limits"]


class TensionLimit(NamedTuple):
    """Tension of a finger's tendon at which the first of its tiles exceeds its limit.

    Attributes
    ----------
    finger : str
    tension : float
        f_t(max) of Eq. 15 [N]; infinite where no tile exceeds its limit at any tension.
    phalanx : str or None
        Phalanx of the tile that first exceeds its limit.
    """

    finger: str
    tension: float
    phalanx: str | None


def tension_limits(settled: SettledHand) -> tuple[TensionLimit, ...]:
    """Return the tension f_t(max) of each finger at which its first tile fails (Eqs. 14–15).

    Tiles have the linear law itself, not its half-planes, and no lateral load. Eq. 15 is a fixed
    point ``f ← f · f_s(φ(f)) / |f_c(f)|``; here it is found by bracketing upward from the closing
    tension, which does not depend on the loading angle staying nearly constant.

    Parameters
    ----------
    settled : SettledHand

    Returns
    -------
    tuple of TensionLimit
        One for each finger, in the order of `FINGERS`. A tile that exceeds its limit by closing
        alone gives the largest safe tension below that, zero if there is none.
    """
    limits = []
    for i, finger in enumerate(FINGERS):
        best = TensionLimit(finger, math.inf, None)
        for t in np.flatnonzero((settled.finger_of == i) & settled.touching):
            tension = _tile_tension_limit(settled, int(t))
            if tension < best.tension:
                best = TensionLimit(finger, tension, settled.tiles[t].phalanx)
        limits.append(best)
    return tuple(limits)


def parallelepiped(settled: SettledHand) -> WrenchSpace:
    """Return the paper's fixed-wrist wrench space (Eq. 16): tensions alone, up to f_t(max).

    It has no palm, no lateral reactions, and one limit for each finger, from the curve of Eq. 21
    itself. Tensions begin where no tile is dragged backwards, not at zero as in Eq. 16: a tile
    whose spines have engaged cannot push.

    Parameters
    ----------
    settled : SettledHand

    Returns
    -------
    WrenchSpace
        Columns: four tensions [N]; limit rows: f_t(max) of each finger, named after the phalanx
        that fails first, or the tendon's maximum if that is less.

    Raises
    ------
    EmptySetError
        If a finger's tile exceeds its limit at every tension.
    """
    space = wrench_space(settled)
    fingers = len(FINGERS)
    limits, capacities = [], []
    for limit in tension_limits(settled):
        if limit.tension <= 0.0:
            raise EmptySetError(
                f"the {limit.phalanx} tile of {limit.finger} exceeds its limit at every tension; "
                "place the hand otherwise, or on a stronger surface"
            )
        by_tile = limit.tension < settled.hand.maximum_tension
        name = "f_t_max" if by_tile else "tendon_tension"
        phalanx = limit.phalanx if by_tile else None
        limits.append(Row(limit.finger, phalanx, name, "limit", f"{limit.finger}/{name}"))
        capacities.append(limit.tension if by_tile else settled.hand.maximum_tension)
    hard = np.flatnonzero(np.abs(space.H[:, :fingers]).max(axis=1) > 0.0)
    return WrenchSpace(
        origin=space.origin,
        generators=space.generators[:, :fingers],
        columns=space.columns[:fingers],
        rows=(*limits, *(space.rows[len(space.s) + i] for i in hard)),
        L=np.eye(fingers),
        l0=np.zeros(fingers),
        s=np.array(capacities),
        H=space.H[hard, :fingers],
        h=space.h[hard],
    )


def _tile_tension_limit(settled: SettledHand, t: int) -> float:
    """Return the tension at which one tile's load reaches its limit curve [N]."""
    of_whole = settled.loads[t] / settled.engagement[t]

    def excess(f: Array) -> Array:
        return settled.surface.excess(*(of_whole[:, 0, None] + of_whole[:, 1, None] * f))

    start = settled.closing_tension
    stop = max(10.0 * settled.hand.maximum_tension, 10.0 * start)
    # tensions at which the load crosses the kinks of the curve, φ = 0 and φ_max: between them what
    # holds is convex, so that a load that leaves between two samples is still out at the second
    (t0, t1), (n0, n1) = of_whole.tolist()
    turns = (0.0, math.tan(settled.surface.pull_off_angle))
    kinks = [-(n0 + k * t0) / (n1 + k * t1) for k in turns if n1 + k * t1 != 0.0]
    tensions = np.geomspace(start, stop, 400)
    tensions = np.sort(np.append(tensions, [f for f in kinks if start < f < stop]))
    beyond = np.flatnonzero(excess(tensions) > 0.0)
    if not len(beyond):
        return math.inf
    if beyond[0] == 0:
        forward = max(0.0, -t0 / t1)
        tensions = np.linspace(min(forward, start), start, 400)
        safe = np.flatnonzero(excess(tensions) <= 0.0)
        if not len(safe):
            return 0.0
        first = safe[-1] + 1
    else:
        first = beyond[0]
    low, high = tensions[first - 1], tensions[first]
    return float(
        scipy.optimize.brentq(lambda f: float(excess(np.array([f]))[0]), low, high, xtol=1e-12)
    )
