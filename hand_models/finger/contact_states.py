"""Find what touches and holds in an increment of closing fingers: a complementarity problem.

Of a contact state, which phalanges are on the rock or held by their spines, which joints stand at
their limits and which spines are caught, the linearised torques give the turns of the joints and
the forces of the contacts (`hand_models.finger.closing`). What then pulls more than it holds, would
be in the rock or beyond a limit is switched, and the state tried again: of those fingers alone that
have switched anything.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.path_state import (
    CATCHING,
    CAUGHT,
    EYE,
    HELD,
    JOINTS,
    LOST,
    OFF,
    ON,
    PULLED,
    Around,
    Codes,
    Drive,
    PathState,
    held_share,
    largest,
    put,
    take,
    times,
)
from hand_models.sections import Flags
from hand_models.tile import pull_strength

__all__ = ["RESTS", "ROUNDING", "Linearised", "contact_states", "forces_on"]

RESTS: Final = 1e-10
"""Turn that counts as none: in an increment at the end of the path, or past a limit [rad]."""

GIVES: Final = 1.0 / 4800.0
"""Growth of gaps before their spines hold, in parts of a tile's length."""

STEADY: Final = 1e-3
"""Turn at one tension up to which joints are in balance, so that what pulls spines off is no error
of an increment [rad]."""

NEARS: Final = 1.0 / 2400.0
"""Gap, in parts of a tile's length, up to which a phalanx may come to the rock in an increment in
which others move as well: one after the other, so that the least gaps are those of the path."""

SWITCHES: Final = 20
"""Most switches of contacts and stops at an increment."""

LONGEST: Final = 4
"""Length of the longest circle of contact states that is detected [switches]."""

DIGITS: Final = 3 ** np.arange(4 * JOINTS)
"""Place values of the codes of a contact state, each of which is one of three."""

SLOWER: Final = 4.0
"""How much damping takes off the forces of contacts that come back to the rock."""

STIFF: Final = 10.0
"""Damping with which joints are slow, in parts of the torque of the proximal joint at the
closing tension over a turn of one radian."""

SOFT: Final = 1e-11
"""Compliance of contacts, so that those that coincide have forces [m/N]."""

ROUNDING: Final = 1e-9
"""Rounding of forces [N] and torques [N·m]."""


class Forces(NamedTuple):
    """Torques on fingers [N·m], their slopes in f and their −∂/∂q, and the tiles' shears [N]."""

    torque: Array
    slope: Array
    stiffness: Array
    shears: Array


class Linearised(NamedTuple):
    """Fingers in their contact states, a row each.

    Attributes
    ----------
    mode, stop, spines : ndarray of int, shape (n, 3)
    off : ndarray, shape (n, 3)
        As of `PathState`.
    settled : ndarray of bool, shape (n,)
        Whether nothing of that is to be switched any more.
    active, caught : ndarray of bool, shape (n, 3)
        Which phalanges have a contact that bears, and which spines are on the rock.
    torque, slope : ndarray, shape (n, 3)
    stiffness : ndarray, shape (n, 3, 3)
        As of `Forces`.
    damped : ndarray, shape (n, 3, 3)
        Stiffness with damping.
    turn, normals : ndarray, shape (n, 3, 2)
        Of joints [rad] and of contacts [N]: now, and per newton of s.
    size : ndarray, shape (n,)
        The largest turn [rad].
    clear : ndarray, shape (n,)
        Part of the turn up to which no other phalanx comes to the rock, at most 1.
    gap : ndarray, shape (n, 3)
        After it, as far as the stride allows [m].
    """

    mode: Codes
    stop: Codes
    spines: Codes
    off: Array
    settled: Flags
    active: Flags
    caught: Flags
    torque: Array
    slope: Array
    stiffness: Array
    damped: Array
    turn: Array
    normals: Array
    size: Array
    clear: Array
    gap: Array


def contact_states(
    drive: Drive, state: PathState, around: Around, least: Array, length: float, slack: float
) -> Linearised:
    """Return the contact states in which fingers go on.

    Parameters
    ----------
    drive : Drive
    state : PathState
        Where they are, and with what contacts to begin.
    around : Around
    least : ndarray, shape (n, 3)
        Gaps at which spines hold, infinite for those that are not caught [m].
    length : float
        Of a tile [m].
    slack : float
        By how much a gap may be negative without being closed [m].
    """
    rows = np.arange(len(state.s))
    found = own = _tried(drive, state, around, least, length, slack)
    codes = np.stack([_code(state, around), _code(own, around)])
    for left in range(SWITCHES - 1, 0, -1):
        # those that go round in a circle, and are now as they will be when the tries are used up
        ends = own.settled.copy()
        for period in range(1, len(codes)):
            if left % period == 0:
                ends |= codes[-1] == codes[-1 - period]
        go = (~ends).nonzero()[0]
        if not len(go):
            break
        rows, own, codes = rows[go], take(own, go), codes[-LONGEST:, go]
        drive, around, least = take(drive, go), take(around, go), least[go]
        state = take(state, go)._replace(
            mode=own.mode, stop=own.stop, spines=own.spines, off=own.off
        )
        own = _tried(drive, state, around, least, length, slack)
        put(found, rows, own)
        codes = np.concatenate([codes, _code(own, around)[None]])
    return found


def _code(state: PathState | Linearised, around: Around) -> Indices:
    """Return a number for each contact state."""
    holds = around.share > state.off
    digits = np.concatenate([state.mode, state.stop + 1, state.spines, holds], axis=1)
    return np.asarray(digits @ DIGITS)


def _tried(
    drive: Drive, state: PathState, around: Around, least: Array, length: float, slack: float
) -> Linearised:
    """Return what becomes of fingers in their contact states, and these after the next switch."""
    mode, stop, spines, off = state.mode, state.stop, state.spines, state.off
    gives = GIVES * length
    forces = forces_on(drive, state, around)
    damped = forces.stiffness + state.damping[:, None, None] * EYE
    active, held = mode != OFF, stop != 0
    apart = around.gap - np.where(mode == HELD, least, 0.0)
    turn, normals = _solve(drive, state, around, forces, damped, active, apart)
    size = np.abs(turn[..., 0]).max(axis=1)
    # gaps that close, by no more than the first of them has room
    change = times(around.d_gap, turn[..., 0])
    nears = ~active & (change < 0.0) & (around.gap > NEARS * length)
    clear = np.where(nears, around.gap / -change, 1.0).min(axis=1).clip(0.0, 1.0)
    part = np.minimum(clear, state.stride / np.maximum(size, RESTS))[:, None]
    # contacts that would pull more than they hold, or push across a gap
    share = held_share(state, around)
    caught = share > 0.0
    over = _over(drive, share, active, forces.shears, normals[..., 0])
    over = np.where(caught & ((part < 1.0) | (size > STEADY)[:, None]), 0.0, over)
    pushes = (mode == HELD) & (normals[..., 0] > ROUNDING)
    # gaps that would close, or grow beyond what spines let them
    gap = around.gap + part * change
    # damped joints may be slow in leaving where they should not be
    slow = (state.damping > STIFF * drive.torque)[:, None]
    closes = ~active & ~nears & (gap < -slack) & ((change < 0.0) | ~slow)
    grows = ~active & caught & (gap > least + gives) & ((change > 0.0) | ~slow)
    balance = forces.torque - times(damped, turn[..., 0])
    balance -= times(around.b, np.where(active, normals[..., 0], 0.0))
    frees = held & (stop * balance < -ROUNDING * drive.torque[:, None])
    there = state.q + part * turn[..., 0]
    high, low = there > drive.upper + RESTS, there < drive.lower - RESTS
    high, low = ~held & high, ~held & low
    # contacts that joints cannot bring to the rock, as others or stops are in the way
    cannot = np.where(active & (mode == ON), SOFT * normals[..., 0] - gives, 0.0)
    switches = (over > 0.0) | pushes | closes | grows | frees | high | low | (cannot > 0.0)
    settled = ~switches.any(axis=1)
    if not settled.all():
        # of contacts one at a time, the worst
        one = largest(over)
        spines = np.where(one & caught, PULLED, spines).astype(np.int8)
        off = np.where(one & caught, around.share, off)
        mode = np.where((one & ~caught) | (one & (mode == HELD)) | pushes, OFF, mode)
        mode = np.where(largest(cannot), OFF, mode)
        one = largest(np.where(closes, -gap, np.where(grows, gap - least, 0.0)))
        mode = np.where(one, np.where(closes, ON, HELD), mode).astype(np.int8)
        again = one & closes & (spines == LOST)
        spines = np.where(again, CAUGHT, spines).astype(np.int8)
        off = np.where(again, 0.0, off)
        stop = np.where(frees, 0, np.where(high, 1, np.where(low, -1, stop))).astype(np.int8)
    return Linearised(
        mode,
        stop,
        spines,
        off,
        settled,
        active,
        caught,
        forces.torque,
        forces.slope,
        forces.stiffness,
        damped,
        turn,
        normals,
        size,
        clear,
        gap,
    )


def forces_on(drive: Drive, state: PathState, around: Around) -> Forces:
    """Return the torques of springs, tendons and drag in their contact states."""
    mode, f = state.mode, np.minimum(state.s, drive.closing)[:, None]
    share = held_share(state, around)
    caught = share > 0.0
    closing = (state.s < drive.closing)[:, None]
    catching = CATCHING * drive.closing[:, None]
    dragged = state.been | (mode == ON)
    # where a joint's stop carries what a phalanx does, its spines are drawn in by nothing
    bears = (mode != OFF) | (state.stop == 0)
    across = (state.s - drive.closing)[:, None].clip(0.0) / catching
    part = np.where(dragged, 1.0, across) * bears
    drag = np.where(caught, drive.drag * part, 0.0)
    shears = drag * share * f
    d_shears = (drag * f)[..., None] * around.d_share
    # per newton of s
    late = caught & bears & ~dragged
    grows = np.where(closing, drag, np.where(late, drive.drag * f / catching, 0.0))
    grows = grows * share
    normals = np.where(mode != OFF, state.normals, 0.0)
    stiffness = (
        EYE * drive.stiffness[:, None, :]
        + np.einsum("nj,nijk->nik", normals, around.d_b)
        - np.einsum("nj,nijk->nik", shears, around.d_a)
        - around.a @ d_shears
    )
    springs = drive.preload + drive.stiffness * state.q
    torque = f * drive.pull - springs + times(around.a, shears)
    slope = np.where(closing, drive.pull, 0.0) + times(around.a, grows)
    return Forces(torque, slope, stiffness, shears)


def _solve(
    drive: Drive,
    state: PathState,
    around: Around,
    forces: Forces,
    damped: Array,
    active: Flags,
    apart: Array,
) -> tuple[Array, Array]:
    """Return turns of joints and normals of contacts, (n, 3, 2): now, and per newton.

    ``apart``: how far contacts are from where they should be [m].
    """
    n, stop = len(state.s), state.stop
    held = (stop != 0)[..., None]
    A, b = np.zeros((n, 2 * JOINTS, 2 * JOINTS)), np.zeros((n, 2 * JOINTS, 3))
    A[:, :JOINTS, :JOINTS] = np.where(held, EYE, damped)
    A[:, :JOINTS, JOINTS:] = np.where(held, 0.0, around.b * active[:, None, :])
    A[:, JOINTS:, :JOINTS] = np.where(active[..., None], around.d_gap, 0.0)
    part = drive.torque / (drive.torque + SLOWER * state.damping)
    A[:, JOINTS:, JOINTS:] = np.where(active[..., None], -SOFT * part[:, None, None] * EYE, EYE)
    limit = np.where(stop > 0, drive.upper, drive.lower)
    b[:, :JOINTS, 0] = np.where(held[..., 0], limit - state.q, forces.torque)
    b[:, :JOINTS, 1] = np.where(held[..., 0], 0.0, forces.slope)
    # contacts come back to the rock at once, what damping needs for that is no force on them
    b[:, JOINTS:, 2] = np.where(active, -apart, 0.0)
    found = np.asarray(np.linalg.solve(A, b), dtype=float)
    found[:, :JOINTS, 0] += found[:, :JOINTS, 2]
    found[:, JOINTS:, 0] += part[:, None] * found[:, JOINTS:, 2]
    return found[:, :JOINTS, :2], found[:, JOINTS:, :2]


def _over(drive: Drive, share: Array, active: Flags, shears: Array, normals: Array) -> Array:
    """Return by how much contacts pull more than they hold [N], not above 0 where they hold."""
    pull = np.maximum(-normals, 0.0)
    caught, share = share > 0.0, np.maximum(share, ROUNDING)
    most, least, steepest, exponent, friction = (drive.limits[:, i, None] for i in range(5))
    shear, pulls = shears / share, pull / share
    strength = pull_strength(most, least, steepest, exponent, np.arctan2(pulls, shear))
    # the drag that a pull needs at last: without a tension nothing would stay that springs pull
    drag = drive.drag * drive.closing[:, None]
    beyond = np.maximum(np.hypot(shear, pulls) - strength, friction * pulls - drag)
    over = np.where(caught, share * beyond, pull)
    return np.where(active & (pull > ROUNDING), over - ROUNDING, 0.0)
