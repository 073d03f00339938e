"""Find the contact states of closing fingers in one increment: a complementarity problem.

A contact state says which phalanges touch the rock or are held by their spines, which joints are at
their limits, and which spines are caught. For a given contact state the linearised torques give the
turns of the joints and the forces of the contacts (`hand_models.finger.closing`). Then every
contact that pulls beyond its strength, every phalanx that would enter the rock and every joint that
would pass a limit is switched, and the state is solved again, until nothing switches.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.path_state import (
    JOINT_COUNT,
    UNIT_MATRIX,
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
from hand_models.finger.settings import CONTACT_CODES, SETTINGS
from hand_models.sections import Flags
from hand_models.tile import pull_strength

__all__ = ["Linearised", "contact_states", "forces_on"]

CODE_DIGITS: Final = 3 ** np.arange(4 * JOINT_COUNT)
"""Place values (base 3) that turn a contact state into one integer."""


class Forces(NamedTuple):
    """Torques and shears of n fingers in their contact states, and derivatives of the torques.

    Attributes
    ----------
    torque : ndarray, shape (n, 3)
        Torque on each joint of springs, tendon and drag [N·m].
    slope : ndarray, shape (n, 3)
        Derivative of ``torque`` by the path parameter s [m].
    stiffness : ndarray, shape (n, 3, 3)
        −∂(torque)/∂q [N·m/rad], contact forces included, for the joint angles q.
    shears : ndarray, shape (n, 3)
        Shear of each tile [N].
    """

    torque: Array
    slope: Array
    stiffness: Array
    shears: Array


class Linearised(NamedTuple):
    """Linearised solution of n fingers in their contact states, a row for each finger.

    Attributes
    ----------
    mode, stop, spines : ndarray of int, shape (n, 3)
        Contact of each phalanx, stop of each joint, spines of each tile; codes as in `PathState`.
    off : ndarray, shape (n, 3)
        ψ, share of each tile's spines that were pulled off.
    settled : ndarray of bool, shape (n,)
        Whether the contact state needs no further switch.
    active, caught : ndarray of bool, shape (n, 3)
        Whether each phalanx has a contact, and whether spines of its tile hold on the rock.
    torque, slope : ndarray, shape (n, 3)
        Torque on each joint [N·m], and its slope per newton of the path parameter s [m].
    stiffness : ndarray, shape (n, 3, 3)
        −∂(torque)/∂q [N·m/rad].
    damped : ndarray, shape (n, 3, 3)
        ``stiffness`` plus damping.
    turn, normals : ndarray, shape (n, 3, 2)
        Turns of the joints [rad] and normal loads of the contacts [N]: in this increment, and per
        newton of s.
    size : ndarray, shape (n,)
        The largest turn [rad].
    clear : ndarray, shape (n,)
        Part of the turn, at most 1, before another phalanx reaches the rock.
    gap : ndarray, shape (n, 3)
        Gaps after the part of the turn that ``clear`` and the stride allow [m].
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
    """Return the contact state of each finger for its next increment, with its linearised solution.

    Active-set iteration: contacts are switched until they agree with their forces and gaps, 20
    times at most.

    Parameters
    ----------
    drive : Drive
    state : PathState
        Joint angles, and the contact states to begin with.
    around : Around
        Gaps, engagement and lever arms at these angles.
    least : ndarray, shape (n, 3)
        Gaps that spines keep from growing, infinite for tiles without caught spines [m].
    length : float
        Length of a tile [m].
    slack : float
        Tolerance on negative gaps [m].
    """
    rows = np.arange(len(state.s))
    found = own = _tried(drive, state, around, least, length, slack)
    codes = np.stack([_code(state, around), _code(own, around)])
    most_switches, longest_circle = 20, 4
    for left in range(most_switches - 1, 0, -1):
        # those that go round in a circle, and are now as they will be when the tries are used up
        ends = own.settled.copy()
        for period in range(1, len(codes)):
            if left % period == 0:
                ends |= codes[-1] == codes[-1 - period]
        go = (~ends).nonzero()[0]
        if not len(go):
            break
        rows, own, codes = rows[go], take(own, go), codes[-longest_circle:, go]
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
    return np.asarray(digits @ CODE_DIGITS)


def _tried(
    drive: Drive, state: PathState, around: Around, least: Array, length: float, slack: float
) -> Linearised:
    """Return what becomes of fingers in their contact states, and these after the next switch."""
    mode, stop, spines, off = state.mode, state.stop, state.spines, state.off
    code, gives = CONTACT_CODES, SETTINGS.held_gap * length
    forces = forces_on(drive, state, around)
    damped = forces.stiffness + state.damping[:, None, None] * UNIT_MATRIX
    active, held = mode != code.off, stop != 0
    apart = around.gap - np.where(mode == code.held, least, 0.0)
    turn, normals = _solve(drive, state, around, forces, damped, active, apart)
    size = np.abs(turn[..., 0]).max(axis=1)
    # gaps that close, by no more than the first of them has room
    change = times(around.d_gap, turn[..., 0])
    nears = ~active & (change < 0.0) & (around.gap > SETTINGS.near_gap * length)
    clear = np.where(nears, around.gap / -change, 1.0).min(axis=1).clip(0.0, 1.0)
    part = np.minimum(clear, state.stride / np.maximum(size, SETTINGS.still_turn))[:, None]
    # contacts that would pull more than they hold, or push across a gap
    share = held_share(state, around)
    caught = share > 0.0
    over = _over(drive, share, active, forces.shears, normals[..., 0])
    over = np.where(caught & ((part < 1.0) | (size > SETTINGS.balance_turn)[:, None]), 0.0, over)
    pushes = (mode == code.held) & (normals[..., 0] > SETTINGS.rounding)
    # gaps that would close, or grow beyond what spines let them
    gap = around.gap + part * change
    # damped joints may be slow in leaving where they should not be
    slow = (state.damping > SETTINGS.slow_damping * drive.torque)[:, None]
    closes = ~active & ~nears & (gap < -slack) & ((change < 0.0) | ~slow)
    grows = ~active & caught & (gap > least + gives) & ((change > 0.0) | ~slow)
    balance = forces.torque - times(damped, turn[..., 0])
    balance -= times(around.b, np.where(active, normals[..., 0], 0.0))
    frees = held & (stop * balance < -SETTINGS.rounding * drive.torque[:, None])
    there = state.q + part * turn[..., 0]
    high = ~held & (there > drive.upper + SETTINGS.still_turn)
    low = ~held & (there < drive.lower - SETTINGS.still_turn)
    # contacts that joints cannot bring to the rock, as others or stops are in the way
    gap_left = SETTINGS.contact_compliance * normals[..., 0] - gives
    cannot = np.where(active & (mode == code.on), gap_left, 0.0)
    switches = (over > 0.0) | pushes | closes | grows | frees | high | low | (cannot > 0.0)
    settled = ~switches.any(axis=1)
    if not settled.all():
        # of contacts one at a time, the worst
        one = largest(over)
        spines = np.where(one & caught, code.pulled, spines).astype(np.int8)
        off = np.where(one & caught, around.share, off)
        mode = np.where((one & ~caught) | (one & (mode == code.held)) | pushes, code.off, mode)
        mode = np.where(largest(cannot), code.off, mode)
        one = largest(np.where(closes, -gap, np.where(grows, gap - least, 0.0)))
        mode = np.where(one, np.where(closes, code.on, code.held), mode).astype(np.int8)
        again = one & closes & (spines == code.lost)
        spines = np.where(again, code.caught, spines).astype(np.int8)
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
    """Return the torques of springs, tendons and drag on fingers in their contact states.

    Parameters
    ----------
    drive : Drive
    state : PathState
        Joint angles, path parameter and contact states.
    around : Around
        Gaps, engagement and lever arms at these angles.

    Returns
    -------
    Forces
    """
    mode, f = state.mode, np.minimum(state.s, drive.closing)[:, None]
    share = held_share(state, around)
    caught = share > 0.0
    closing = (state.s < drive.closing)[:, None]
    catching = SETTINGS.catching_part * drive.closing[:, None]
    dragged = state.been | (mode == CONTACT_CODES.on)
    # where a joint's stop carries what a phalanx does, its spines are drawn in by nothing
    bears = (mode != CONTACT_CODES.off) | (state.stop == 0)
    across = (state.s - drive.closing)[:, None].clip(0.0) / catching
    part = np.where(dragged, 1.0, across) * bears
    drag = np.where(caught, drive.drag * part, 0.0)
    shears = drag * share * f
    d_shears = (drag * f)[..., None] * around.d_share
    # per newton of s
    late = caught & bears & ~dragged
    grows = np.where(closing, drag, np.where(late, drive.drag * f / catching, 0.0))
    grows = grows * share
    normals = np.where(mode != CONTACT_CODES.off, state.normals, 0.0)
    stiffness = (
        UNIT_MATRIX * drive.stiffness[:, None, :]
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
    joints, contacts = slice(JOINT_COUNT), slice(JOINT_COUNT, 2 * JOINT_COUNT)
    A, b = np.zeros((n, contacts.stop, contacts.stop)), np.zeros((n, contacts.stop, 3))
    A[:, joints, joints] = np.where(held, UNIT_MATRIX, damped)
    A[:, joints, contacts] = np.where(held, 0.0, around.b * active[:, None, :])
    A[:, contacts, joints] = np.where(active[..., None], around.d_gap, 0.0)
    # how much damping takes off the forces of contacts that come back to the rock
    part = drive.torque / (drive.torque + 4.0 * state.damping)
    gives = -SETTINGS.contact_compliance * part[:, None, None] * UNIT_MATRIX
    A[:, contacts, contacts] = np.where(active[..., None], gives, UNIT_MATRIX)
    limit = np.where(stop > 0, drive.upper, drive.lower)
    b[:, joints, 0] = np.where(held[..., 0], limit - state.q, forces.torque)
    b[:, joints, 1] = np.where(held[..., 0], 0.0, forces.slope)
    # contacts come back to the rock at once, what damping needs for that is no force on them
    b[:, contacts, 2] = np.where(active, -apart, 0.0)
    found = np.asarray(np.linalg.solve(A, b), dtype=float)
    found[:, joints, 0] += found[:, joints, 2]
    found[:, contacts, 0] += part[:, None] * found[:, contacts, 2]
    return found[:, joints, :2], found[:, contacts, :2]


def _over(drive: Drive, share: Array, active: Flags, shears: Array, normals: Array) -> Array:
    """Return by how much contacts pull more than they hold [N], not above 0 where they hold."""
    pull = np.maximum(-normals, 0.0)
    caught, share = share > 0.0, np.maximum(share, SETTINGS.rounding)
    most, least, steepest, exponent, friction = (drive.limits[:, i, None] for i in range(5))
    shear, pulls = shears / share, pull / share
    strength = pull_strength(most, least, steepest, exponent, np.arctan2(pulls, shear))
    # the drag that a pull needs at last: without a tension nothing would stay that springs pull
    drag = drive.drag * drive.closing[:, None]
    beyond = np.maximum(np.hypot(shear, pulls) - strength, friction * pulls - drag)
    over = np.where(caught, share * beyond, pull)
    return np.where(active & (pull > SETTINGS.rounding), over - SETTINGS.rounding, 0.0)
