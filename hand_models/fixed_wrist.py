"""A hand whose wrist stays where it is: from settled fingers to a WrenchSpace (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
and the palm's shear and pressing. Everything is affine in them:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from hand_models.errors import EmptySetError
from hand_models.frames import Array, Indices
from hand_models.hand import FINGERS, SettledHand, Tile
from hand_models.spines import HalfPlane
from hand_models.wrench_space import Row, WrenchSpace

__all__ = ["TensionLimit", "parallelepiped", "tension_limits", "wrench_space"]

PALM_SHEAR = "palm_shear"
PALM_PRESSING = "palm_pressing"


class TensionLimit(NamedTuple):
    """How far a tendon can be tightened before a tile of its finger lets go.

    Attributes
    ----------
    finger : str
    tension : float
        f_t(max) of Eq. 15 [N]; infinite where no tile ever lets go.
    phalanx : str or None
        The one that lets go first.
    """

    finger: str
    tension: float
    phalanx: str | None


def wrench_space(settled: SettledHand, tension_limit: float | None = None) -> WrenchSpace:
    """Return the wrenches on the rock, in H, that a settled hand carries with its wrist fixed.

    Parameters
    ----------
    settled : SettledHand
    tension_limit : float, optional
        A caller's cap on every tendon [N]; the hand's own maximum if that is less.

    Returns
    -------
    WrenchSpace
        Columns: four tensions, the lateral reactions, palm shear and palm pressing [N]. Limit rows:
        each tile's half-planes (with both signs of its lateral load), each tendon, the palm. Hard
        rows: tension, palm loads not negative; no tile dragged backwards; a joint's stop only
        pushes.
    """
    maximum = settled.hand.maximum_tension
    if tension_limit is not None:
        maximum = min(maximum, tension_limit)
    touching = settled.touching
    finger_of = settled.finger_of
    lateral = settled.grasp.lateral
    fingers = len(FINGERS)
    reacting = [i for i in range(fingers) if lateral and touching[finger_of == i].any()]
    palm = settled.palm
    layout = _layout(
        settled.tiles,
        tuple(reacting),
        settled.surface.pieces(),
        tuple((i, j) for i, j, _ in settled.stops),
        bool(palm.engaged),
    )
    m = len(layout.columns)

    # each tile's wrench: of a unit of shear, normal and lateral load
    units = np.concatenate(
        [settled.axes, np.cross(settled.positions[:, None, :], settled.axes)], axis=2
    )
    at_zero = np.einsum("tk,tkw->tw", settled.loads[..., 0], units[:, :2])
    per_newton = np.einsum("tk,tkw->tw", settled.loads[..., 1], units[:, :2])
    generators = np.zeros((6, m))
    np.add.at(generators.T, finger_of, per_newton)
    shares = settled.lateral_shares
    lateral_column = np.full(fingers, -1)
    lateral_column[reacting] = fingers + np.arange(len(reacting))
    if reacting:
        mine = np.flatnonzero(shares * (lateral_column[finger_of] >= 0))
        np.add.at(
            generators.T, lateral_column[finger_of[mine]], shares[mine, None] * units[mine, 2]
        )
    if palm.engaged:
        x, y, z = palm.centre
        generators[:, -2] = (-1.0, 0.0, 0.0, 0.0, -z, y)
        generators[:, -1] = (0.0, 0.0, 1.0, y, -x, 0.0)

    # limit rows: tiles, then tendons, then the palm
    tile, a_shear, a_normal, a_lateral, capacity = layout.planes
    n = len(tile)
    nl = len(layout.limits)
    L, l0, s = np.zeros((nl, m)), np.zeros(nl), np.empty(nl)
    planar = np.column_stack([a_shear, a_normal])
    index = np.arange(n)
    L[index, finger_of[tile]] = (planar * settled.loads[tile, :, 1]).sum(axis=1)
    l0[:n] = (planar * settled.loads[tile, :, 0]).sum(axis=1)
    s[:n] = capacity
    if reacting:
        L[index, lateral_column[finger_of[tile]]] += a_lateral * shares[tile]
    tendon = np.arange(fingers)
    L[n + tendon, tendon] = 1.0
    s[n : n + fingers] = maximum
    if palm.engaged:
        L[-2, -2] = L[-1, -1] = 1.0
        s[-2:] = palm.shear_limit, palm.pressing_limit

    # hard rows: tension, no tile dragged backwards, stops, palm
    nh = len(layout.hard)
    H, h = np.zeros((nh, m)), np.zeros(nh)
    H[tendon, tendon] = -1.0
    dragged = np.flatnonzero(touching)
    row = fingers + np.arange(len(dragged))
    H[row, finger_of[dragged]] = -settled.loads[dragged, 0, 1]
    h[row] = settled.loads[dragged, 0, 0]
    first_stop = fingers + len(dragged)
    for k, (finger, _, torque) in enumerate(settled.stops):
        # in newtons of tension, so that rows stay commensurate
        scale = max(abs(float(torque[1])), 1e-6)
        H[first_stop + k, finger] = -torque[1] / scale
        h[first_stop + k] = torque[0] / scale
    if palm.engaged:
        H[-2, -2] = H[-1, -1] = -1.0
    return WrenchSpace(
        origin=at_zero.sum(axis=0),
        generators=generators,
        columns=layout.columns,
        rows=layout.limits + layout.hard,
        L=L,
        l0=l0,
        s=s,
        H=H,
        h=h,
    )


class _Layout(NamedTuple):
    """Names and constant coefficients, which only depend on what touches."""

    columns: tuple[str, ...]
    limits: tuple[Row, ...]
    hard: tuple[Row, ...]
    planes: tuple[Indices, Array, Array, Array, Array]


@lru_cache(maxsize=512)
def _layout(
    tiles: tuple[Tile, ...],
    reacting: tuple[int, ...],
    pieces: tuple[HalfPlane, ...],
    stops: tuple[tuple[int, int], ...],
    palm: bool,
) -> _Layout:
    columns = [f"{finger}/tension" for finger in FINGERS]
    columns += [f"{FINGERS[i]}/lateral" for i in reacting]
    limits, hard = [], []
    planes: list[tuple[int, float, float, float, float]] = []
    touching = [i for i, tile in enumerate(tiles) if tile.contact != "none"]
    for i in touching:
        finger, phalanx = tiles[i].finger, tiles[i].phalanx
        pulls = 0
        for piece in pieces:
            pulls += piece.limit == "pull_off"
            label = f"{finger}/{phalanx}/{piece.limit}" + (f"_{pulls}" if pulls > 1 else "")
            signs = (("+", 1.0), ("-", -1.0)) if FINGERS.index(finger) in reacting else (("", 0.0),)
            for sign, factor in signs:
                limits.append(Row(finger, phalanx, piece.limit, "limit", label + sign))
                planes.append(
                    (i, piece.a_shear, piece.a_normal, factor * piece.a_lateral, piece.capacity)
                )
    for finger in FINGERS:
        limits.append(Row(finger, None, "tendon_tension", "limit", f"{finger}/tendon_tension"))
        hard.append(Row(finger, None, "slack_tendon", "hard", f"{finger}/slack_tendon"))
    for i in touching:
        finger, phalanx = tiles[i].finger, tiles[i].phalanx
        label = f"{finger}/{phalanx}/dragged_backwards"
        hard.append(Row(finger, phalanx, "dragged_backwards", "hard", label))
    for finger_index, joint in stops:
        finger, phalanx = FINGERS[finger_index], ("proximal", "middle", "distal")[joint]
        hard.append(Row(finger, phalanx, "joint_stop", "hard", f"{finger}/{phalanx}/joint_stop"))
    if palm:
        columns += [PALM_SHEAR, PALM_PRESSING]
        limits += [Row(None, None, name, "limit", name) for name in (PALM_SHEAR, PALM_PRESSING)]
        hard += [
            Row(None, None, f"{name}_reversed", "hard", f"{name}_reversed")
            for name in (PALM_SHEAR, PALM_PRESSING)
        ]
    table = np.array(planes).reshape(-1, 5)
    return _Layout(
        tuple(columns),
        tuple(limits),
        tuple(hard),
        (table[:, 0].astype(np.intp), table[:, 1], table[:, 2], table[:, 3], table[:, 4]),
    )


def tension_limits(settled: SettledHand) -> tuple[TensionLimit, ...]:
    """Return f_t(max) of each finger and the phalanx that lets go first (Eqs. 14–15).

    With the linear law itself, not its half-planes, and no lateral load. Eq. 15 is a fixed point
    ``f ← f · f_s(φ(f)) / |f_c(f)|``; here it is found by bracketing upward from the closing
    tension, which does not depend on the loading angle staying nearly constant. A tile that is
    beyond its limit by closing alone gives the largest tension below that is safe, zero if there is
    none.
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
    """Return the paper's own fixed-wrist wrench space (Eq. 16): tensions alone, up to f_t(max).

    No palm, no lateral reactions, and one limit for each finger, from the curve of Eq. 21 itself.
    Tensions begin where no tile is dragged backwards, not at zero as in Eq. 16: a tile that has
    caught the rock cannot push it.

    Parameters
    ----------
    settled : SettledHand

    Returns
    -------
    WrenchSpace
        Columns: four tensions [N]; limit rows: f_t(max) of each finger, named after the phalanx
        that lets go first, or the tendon's maximum if that is less.

    Raises
    ------
    EmptySetError
        If a finger's tiles are beyond their limits at every tension.
    """
    space = wrench_space(settled)
    fingers = len(FINGERS)
    limits, capacities = [], []
    for limit in tension_limits(settled):
        if limit.tension <= 0.0:
            raise EmptySetError(
                f"the {limit.phalanx} tile of {limit.finger} lets go at any tension"
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

    def excess(f: Array) -> Array:
        load = settled.loads[t, :, 0, None] + settled.loads[t, :, 1, None] * f
        angle = np.arctan2(-load[1], load[0])
        strength = settled.surface.strength(np.clip(angle, -np.pi / 2, np.pi / 2))
        return np.asarray(np.hypot(load[0], load[1]) - strength)

    start = settled.closing_tension
    stop = max(10.0 * settled.hand.maximum_tension, 10.0 * start)
    # tensions at which the load crosses the kinks of the curve, φ = 0 and φ_max: between them what
    # holds is convex, so that a load that leaves between two samples is still out at the second
    (t0, t1), (n0, n1) = settled.loads[t].tolist()
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
    return float(brentq(lambda f: float(excess(np.array([f]))[0]), low, high, xtol=1e-12))
