"""A hand whose wrist stays where it is: from settled fingers to a WrenchSpace (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
and the palm's shear and pressing. Everything is affine in them:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y,

and so are the loads of the motors and of the structure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from hand_models.errors import EmptySetError
from hand_models.frames import Array, Indices
from hand_models.hand import FINGERS, SettledHand
from hand_models.row_layout import RowLayout, row_layout
from hand_models.structure import HELD
from hand_models.wrench_space import Row, WrenchSpace

__all__ = ["TensionLimit", "parallelepiped", "tension_limits", "wrench_space"]


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
        each tile's half-planes (with both signs of its lateral load); each tendon's tension, motor
        torque [N·m] and motor current [A]; the shear of a finger's tiles together, the pressing of
        its tip; the palm; and, as wrench rows, what the hand holds in the directions `HELD`. Hard
        rows: tension, palm loads not negative; no tile dragged backwards; a joint's stop and a
        frame beside its tile only push; a nail that clings neither lifts nor slips nor closes its
        finger; with friction in the tendons, no tension below closing, where they would stick. A
        nail has a column for the load along it, and two limit rows.
    """
    maximum = settled.hand.maximum_tension
    if tension_limit is not None:
        maximum = min(maximum, tension_limit)
    touching = settled.touching
    finger_of = settled.finger_of
    fingers = len(FINGERS)
    engaged = [i for i in range(fingers) if touching[finger_of == i].any()]
    reacting = engaged if settled.grasp.lateral else []
    palm = settled.palm
    layout = row_layout(
        settled.tiles,
        tuple(engaged),
        tuple(reacting),
        settled.surface.pieces(),
        tuple((i, j) for i, j, _ in settled.stops),
        bool(palm.engaged),
        settled.hand.finger.friction > 0.0,
    )

    # each tile's wrench: of a unit of shear, normal and lateral load
    units = np.concatenate(
        [settled.axes, np.cross(settled.positions[:, None, :], settled.axes)], axis=2
    )
    at_zero = np.einsum("tk,tkw->tw", settled.loads[..., 0], units[:, :2])
    per_newton = np.einsum("tk,tkw->tw", settled.loads[..., 1], units[:, :2])
    origin = at_zero.sum(axis=0)
    generators = np.zeros((6, len(layout.columns)))
    np.add.at(generators.T, finger_of, per_newton)
    lateral_column = np.full(fingers, -1)
    lateral_column[reacting] = fingers + np.arange(len(reacting))
    if reacting:
        shares = settled.lateral_shares
        mine = np.flatnonzero(shares * (lateral_column[finger_of] >= 0))
        np.add.at(
            generators.T, lateral_column[finger_of[mine]], shares[mine, None] * units[mine, 2]
        )
    for column, tile in zip(layout.nail_columns, np.flatnonzero(settled.nails), strict=True):
        generators[:, column] = units[tile, 0]
    if palm.engaged:
        x, y, z = palm.centre
        generators[:, -2] = (-1.0, 0.0, 0.0, 0.0, -z, y)
        generators[:, -1] = (0.0, 0.0, 1.0, y, -x, 0.0)

    L, l0, s = _limit_rows(settled, layout, lateral_column, maximum)
    D = np.zeros((len(HELD), 6))
    D[:, :3] = HELD
    H, h = _hard_rows(settled, layout)
    return WrenchSpace(
        origin=origin,
        generators=generators,
        columns=layout.columns,
        rows=layout.limits + layout.hard,
        L=np.vstack([L, D @ generators]),
        l0=np.concatenate([l0, D @ origin]),
        s=np.concatenate([s, np.full(len(D), settled.hand.structure.hand_load)]),
        H=H,
        h=h,
        D=D,
    )


def _limit_rows(
    settled: SettledHand, layout: RowLayout, lateral_column: Indices, maximum: float
) -> tuple[Array, Array, Array]:
    """Return L, l0 and s of all limit rows but the last, those of the whole hand's force."""
    finger_of, loads, palm = settled.finger_of, settled.loads, settled.palm
    tile, a_shear, a_normal, a_lateral, capacity = layout.planes
    n = len(layout.limits) - len(HELD)
    L, l0, s = np.zeros((n, len(layout.columns))), np.zeros(n), np.empty(n)

    k = len(tile)
    planar = np.column_stack([a_shear, a_normal])
    index = np.arange(k)
    L[index, finger_of[tile]] = (planar * loads[tile, :, 1]).sum(axis=1)
    l0[:k] = (planar * loads[tile, :, 0]).sum(axis=1)
    s[:k] = capacity
    if (lateral_column >= 0).any():
        L[index, lateral_column[finger_of[tile]]] += a_lateral * settled.lateral_shares[tile]

    drive = settled.hand.drive
    tendon = np.arange(len(FINGERS))
    for per_newton, at_zero, most in (
        (1.0, 0.0, maximum),
        (drive.torque_per_newton, 0.0, drive.maximum_torque),
        (drive.current_per_newton, drive.no_load_current, drive.maximum_current),
    ):
        L[k + tendon, tendon] = per_newton
        l0[k + tendon] = at_zero
        s[k + tendon] = most
        k += len(tendon)

    structure = settled.hand.structure
    shears = np.zeros((len(FINGERS), 2))
    np.add.at(shears, finger_of, loads[:, 0])
    engaged, tips = list(layout.engaged), list(layout.tips)
    for of, load, most in (
        (engaged, shears[engaged], structure.finger_shear),
        (finger_of[tips], loads[tips, 1], structure.fingertip_force),
    ):
        row = k + np.arange(len(of))
        L[row, of] = load[:, 1]
        l0[row] = load[:, 0]
        s[row] = most
        k += len(of)

    for column, nail in zip(layout.nail_columns, np.flatnonzero(settled.nails), strict=True):
        for piece in settled.nail_limits(int(nail)):
            L[k, [int(finger_of[nail]), column]] = piece.a_normal * loads[nail, 1, 1], piece.a_shear
            l0[k] = piece.a_normal * loads[nail, 1, 0]
            s[k] = piece.capacity
            k += 1

    if palm.engaged:
        L[-2, -2] = L[-1, -1] = 1.0
        s[-2:] = palm.shear_limit, palm.pressing_limit
    return L, l0, s


def _hard_rows(settled: SettledHand, layout: RowLayout) -> tuple[Array, Array]:
    """Return H and h."""
    finger_of, loads = settled.finger_of, settled.loads
    nh = len(layout.hard)
    H, h = np.zeros((nh, len(layout.columns))), np.zeros(nh)
    tendon = np.arange(len(FINGERS))
    H[tendon, tendon] = -1.0
    k = len(tendon)
    for tiles, component in ((np.flatnonzero(settled.touching), 0), (list(layout.frames), 1)):
        row = k + np.arange(len(tiles))
        H[row, finger_of[tiles]] = -loads[tiles, component, 1]
        h[row] = loads[tiles, component, 0]
        k += len(tiles)
    for finger, _, torque in settled.stops:
        # in newtons of tension, so that rows stay commensurate
        scale = max(abs(float(torque[1])), 1e-6)
        H[k, finger] = -torque[1] / scale
        h[k] = torque[0] / scale
        k += 1
    for column, tile, (rows, most) in zip(
        layout.nail_columns, np.flatnonzero(settled.nails), settled.nail_rows, strict=True
    ):
        H[k : k + len(most), [int(finger_of[tile]), column]] = rows
        h[k : k + len(most)] = most
        k += len(most)
    if layout.sticking:
        for finger in layout.drawing:
            H[k, finger], h[k] = -1.0, -settled.closing_tension
            k += 1
    if settled.palm.engaged:
        H[-2, -2] = H[-1, -1] = -1.0
    return H, h


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
