"""Find the contact state of a finger in one increment: a complementarity problem (compiled).

A contact state says which phalanges touch the rock or are held by their spines, which joints are at
their limits, and which spines are caught. For a given contact state the linearised torques give the
turns of the joints and the forces of the contacts (`hand_models.finger.closing`). Then every
contact that pulls beyond its strength, every phalanx that would enter the rock and every joint that
would pass a limit is switched, and the state is solved again, until nothing switches.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from hand_models.base import Array, compiled
from hand_models.finger.path_state import (
    AROUND_FIELDS,
    CODE_RECORD,
    DRIVE_FIELDS,
    JOINT_COUNT,
    SETTINGS_RECORD,
    SHAPE_FIELDS,
    STATE_FIELDS,
    Record,
)

__all__ = ["LINEARISED_FIELDS", "contact_states", "put_forces"]

LINEARISED_FIELDS: Final = np.dtype(
    [
        *((name, int, (JOINT_COUNT,)) for name in ("mode", "stop", "spines", "slides")),
        ("off", float, (JOINT_COUNT,)),
        ("settled", int),
        *((name, int, (JOINT_COUNT,)) for name in ("active", "caught")),
        *((name, float, (JOINT_COUNT,)) for name in ("torque", "slope", "shears", "grows")),
        *((name, float, (JOINT_COUNT, JOINT_COUNT)) for name in ("arms", "stiffness", "damped")),
        *((name, float, (JOINT_COUNT, 2)) for name in ("turn", "normals")),
        *((name, float) for name in ("size", "clear")),
        ("gap", float, (JOINT_COUNT,)),
    ]
)
"""Linearised solution of a finger in its contact state.

``mode``, ``stop``, ``spines``, ``slides``, ``off``: contact of each phalanx, stop of each joint,
spines of each tile, whether it slides, and ψ, as in `STATE_FIELDS`. ``settled``: whether the
contact state needs no further switch. ``active``, ``caught``: whether each phalanx has a contact,
and whether spines of its tile hold on the rock. ``torque``, ``slope``: torque of springs, tendon
and drag on each joint [N·m], and its derivative by the path parameter s [m]. ``shears``, ``grows``:
shear of each tile by its tendon [N], and per newton of s. ``arms``: b_ij, or where tile j slides
b_ij + μ a_ij [m]. ``stiffness``: −∂(torque)/∂q, contact forces included [N·m/rad]; ``damped``: with
damping. ``turn``, ``normals``: turns of the joints [rad] and normal loads of the contacts [N], in
this increment and per newton of s. ``size``: the largest turn [rad]. ``clear``: part of the turn,
at most 1, before another phalanx reaches the rock. ``gap``: gaps after the part of the turn that
``clear`` and the stride allow [m].
"""


@compiled()
def _held(
    settings: Record, code: Record, drive: Record, state: Record, around: Record, j: int
) -> float:
    """Return the share of a tile's spines that grip the rock, φ − ψ."""
    share, off = around.share[j], state.off[j]
    if drive.lowers:
        off = max(share - state.most[j], 0.0) if state.spines[j] == code.caught else share
    held = 1.0 - max(1.0 - share + off, 0.0)
    return held if held > settings.least_share else 0.0


@compiled()
def _write_forces(
    settings: Record, code: Record, drive: Record, state: Record, around: Record, found: Record
) -> None:
    """Write the torques of springs, tendons and drag on a finger in its contact state."""
    f, closing = min(state.s, drive.closing), state.s < drive.closing
    way, friction = 1.0 if closing else 0.0, drive.limits[4]
    # share of the drag across gaps
    part = 0.0
    if drive.lowers:
        f, way, part = drive.closing - state.s, -1.0, 1.0
    elif state.s > drive.closing:
        part = (state.s - drive.closing) / (settings.catching_part * drive.closing)
    normals, d_shears = np.empty(JOINT_COUNT), np.empty(JOINT_COUNT)
    for j in range(JOINT_COUNT):
        off = state.mode[j] == code.off
        share = _held(settings, code, drive, state, around, j)
        dragged = state.been[j] or state.mode[j] == code.on
        # where a joint's stop carries what a phalanx does, its spines are drawn in by nothing
        bears = share > 0.0 and (not off or state.stop[j] == 0)
        drag = drive.drag[j] * (1.0 if dragged else part) if bears else 0.0
        found.shears[j], d_shears[j] = drag * share * f, drag * f
        found.grows[j] = 0.0
        if drive.lowers and bears:
            whole = drive.drag[j] * drive.closing - drive.gain[j] * state.s
            found.shears[j], found.grows[j] = share * whole, -share * drive.gain[j]
            d_shears[j] = whole if around.share[j] < state.most[j] else 0.0
        elif closing:
            found.grows[j] = drag * share
        elif bears and not dragged:
            found.grows[j] = drive.drag[j] / settings.catching_part * share
        normals[j] = 0.0 if off else state.normals[j]
    for i in range(JOINT_COUNT):
        torque = f * drive.pull[i] - (drive.preload[i] + drive.stiffness[i] * state.q[i])
        slope = way * drive.pull[i]
        for j in range(JOINT_COUNT):
            found.arms[i, j] = around.b[i, j]
            if state.slides[j]:
                found.arms[i, j] += friction * around.a[i, j]
                continue
            torque += around.a[i, j] * found.shears[j]
            slope += around.a[i, j] * found.grows[j]
        found.torque[i], found.slope[i] = torque, slope
        for k in range(JOINT_COUNT):
            stiffness = drive.stiffness[i] if i == k else 0.0
            for j in range(JOINT_COUNT):
                stiffness += normals[j] * around.d_b[i, j, k]
                shear = -friction * normals[j] if state.slides[j] else found.shears[j]
                stiffness -= shear * around.d_a[i, j, k]
                if not state.slides[j]:
                    stiffness -= around.a[i, j] * d_shears[j] * around.d_share[j, k]
            found.stiffness[i, k] = stiffness


@compiled(
    *(SETTINGS_RECORD.dtype, CODE_RECORD.dtype),
    *(DRIVE_FIELDS, STATE_FIELDS, AROUND_FIELDS, LINEARISED_FIELDS),
)
def put_forces(
    settings: Record, code: Record, drive: Record, state: Record, around: Record, found: Record
) -> None:
    """Write the linearised torques and shears of a finger in a given contact state to ``found``.

    Arguments are those of `contact_states`, each an array of one record.
    """
    _write_forces(settings[0], code[0], drive[0], state[0], around[0], found[0])


@compiled()
def _eliminate(A: Array, b: Array) -> None:
    """Solve A x = b by elimination with pivots; x takes the place of b."""
    n = len(A)
    for column in range(n):
        pivot = column
        for i in range(column + 1, n):
            if abs(A[i, column]) > abs(A[pivot, column]):
                pivot = i
        for k in range(n):
            A[column, k], A[pivot, k] = A[pivot, k], A[column, k]
        for k in range(b.shape[1]):
            b[column, k], b[pivot, k] = b[pivot, k], b[column, k]
        for i in range(column + 1, n):
            factor = A[i, column] / A[column, column]
            for k in range(column + 1, n):
                A[i, k] -= factor * A[column, k]
            for k in range(b.shape[1]):
                b[i, k] -= factor * b[column, k]
    for i in range(n - 1, -1, -1):
        for k in range(b.shape[1]):
            for j in range(i + 1, n):
                b[i, k] -= A[i, j] * b[j, k]
            b[i, k] /= A[i, i]


@compiled()
def _solve(
    settings: Record, drive: Record, state: Record, around: Record, apart: Array, found: Record
) -> None:
    """Write turns of joints and normals of contacts: now, and per newton.

    ``apart``: how far contacts are from where they should be [m].
    """
    n = JOINT_COUNT
    A, b = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 3))
    # how much damping takes off the forces of contacts that come back to the rock
    part = drive.torque / (drive.torque + 4.0 * state.damping)
    for i in range(n):
        if state.stop[i] != 0:
            A[i, i] = 1.0
            b[i, 0] = (drive.upper[i] if state.stop[i] > 0 else drive.lower[i]) - state.q[i]
        else:
            b[i, 0], b[i, 1] = found.torque[i], found.slope[i]
            for k in range(n):
                A[i, k] = found.damped[i, k]
                A[i, n + k] = found.arms[i, k] if found.active[k] else 0.0
        if found.active[i]:
            for k in range(n):
                A[n + i, k] = around.d_gap[i, k]
            A[n + i, n + i] = -settings.contact_compliance * part
            # contacts come back to the rock at once, what damping needs for that is no force
            b[n + i, 2] = -apart[i]
        else:
            A[n + i, n + i] = 1.0
    _eliminate(A, b)
    for i in range(n):
        found.turn[i, 0], found.turn[i, 1] = b[i, 0] + b[i, 2], b[i, 1]
        found.normals[i, 0] = b[n + i, 0] + part * b[n + i, 2]
        found.normals[i, 1] = b[n + i, 1]


@compiled()
def _over(
    settings: Record, drive: Record, j: int, share: float, shear: float, normal: float
) -> float:
    """Return by how much a contact pulls more than it holds [N], not above 0 where it holds."""
    pull = -normal
    if pull <= settings.rounding:
        return 0.0
    if share == 0.0:
        return float(pull - settings.rounding)
    least = max(share, settings.rounding)
    shears, pulls = shear / least, pull / least
    most, weakest, steepest, exponent, friction = drive.limits
    ratio = min(max(math.atan2(pulls, shears) / steepest, 0.0), 1.0)
    strength = most - (most - weakest) * ratio**exponent
    # the drag that a pull needs at last: without a tension nothing would stay that springs pull
    drag = shears if drive.lowers else drive.drag[j] * drive.closing
    beyond = max(math.hypot(shears, pulls) - strength, friction * pulls - drag)
    return float(least * beyond - settings.rounding)


@compiled()
def _largest(values: Array) -> int:
    """Return the index of the largest value, −1 if none is above zero."""
    at = int(np.argmax(values))
    return at if values[at] > 0.0 else -1


@compiled()
def _code(state: Record, around: Record) -> int:
    """Return a number for a contact state."""
    code = 0
    for j in range(JOINT_COUNT):
        code = 27 * code + 9 * state.mode[j] + 3 * (state.stop[j] + 1) + state.spines[j]
        code = 3 * code + (1 if around.share[j] > state.off[j] else 0) + state.slides[j]
    return code


@compiled()
def _try(
    settings: Record,
    code: Record,
    shape: Record,
    drive: Record,
    state: Record,
    around: Record,
    least: Array,
    found: Record,
) -> None:
    """Write what becomes of a finger in its contact state, and this after the next switch."""
    play, deep, nothing = settings.held_gap * shape.length, shape.closes, np.zeros(JOINT_COUNT)
    _write_forces(settings, code, drive, state, around, found)
    apart, share = nothing.copy(), nothing.copy()
    for j in range(JOINT_COUNT):
        for k in range(JOINT_COUNT):
            found.damped[j, k] = found.stiffness[j, k] + (state.damping if j == k else 0.0)
        found.active[j] = state.mode[j] != code.off
        apart[j] = around.gap[j] - (least[j] if state.mode[j] == code.held else 0.0)
        share[j] = _held(settings, code, drive, state, around, j)
        found.caught[j] = share[j] > 0.0
    _solve(settings, drive, state, around, apart, found)
    # gaps that close, by no more than the first of them has room
    size, clear, change = 0.0, 1.0, nothing.copy()
    for j in range(JOINT_COUNT):
        size = max(size, abs(found.turn[j, 0]))
        for k in range(JOINT_COUNT):
            change[j] += around.d_gap[j, k] * found.turn[k, 0]
        far = around.gap[j] > settings.near_gap * shape.length
        if far and not found.active[j] and change[j] < 0.0:
            clear = min(clear, around.gap[j] / -change[j])
    found.size, found.clear = size, clear
    # spines hold where a gap has grown by more than its linearisation may err
    gives = min(play, 2.0 * deep + settings.gap_error * size**2)
    part = min(clear, state.stride / max(size, settings.still_turn))
    # damped joints may be slow in leaving where they should not be
    slow = state.damping > settings.slow_damping * drive.torque
    over, cannot, moves, settled = nothing.copy(), nothing.copy(), nothing.copy(), True
    pushes, closes = np.zeros(JOINT_COUNT, np.bool_), np.zeros(JOINT_COUNT, np.bool_)
    for j in range(JOINT_COUNT):
        normal, caught, mode = found.normals[j, 0], found.caught[j], state.mode[j]
        active = found.active[j]
        gap = around.gap[j] + part * change[j]
        found.gap[j] = gap
        if active:
            # contacts that would pull more than they hold, or push across a gap
            if not (caught and (part < 1.0 or size > settings.balance_turn)):
                grip = 0.0 if state.slides[j] else share[j]
                over[j] = _over(settings, drive, j, grip, found.shears[j], normal)
            pushes[j] = mode == code.held and normal > settings.rounding
            # contacts that joints cannot bring to the rock, as others or stops are in the way
            cannot[j] = settings.contact_compliance * normal - play if mode == code.on else 0.0
        else:
            # gaps that would close, or grow beyond what spines let them
            nears = change[j] < 0.0 and around.gap[j] > settings.near_gap * shape.length
            closes[j] = not nears and gap < -deep and (change[j] < 0.0 or not slow)
            if closes[j]:
                moves[j] = -gap
            elif caught and gap > least[j] + gives and (change[j] > 0.0 or not slow):
                moves[j] = gap - least[j]
        settled &= not (over[j] > 0.0 or pushes[j] or moves[j] > 0.0 or cannot[j] > 0.0)
        found.mode[j], found.stop[j], found.spines[j] = mode, state.stop[j], state.spines[j]
        found.off[j] = state.off[j]
        # a tile that is pressed slides backwards against friction; one that is not lets go
        force = found.shears[j] + drive.limits[4] * normal - settings.rounding * state.slides[j]
        slides = drive.lowers and active and caught and normal > settings.rounding and force < 0.0
        found.slides[j] = 1 if slides else 0
        settled &= found.slides[j] == state.slides[j]
        if drive.lowers and caught and not active:
            over[j] = -found.shears[j] - settings.rounding
            settled &= over[j] <= 0.0
        there = state.q[j] + part * found.turn[j, 0]
        if state.stop[j] != 0:
            balance = found.torque[j]
            for k in range(JOINT_COUNT):
                balance -= found.damped[j, k] * found.turn[k, 0]
                balance -= found.arms[j, k] * found.normals[k, 0] * found.active[k]
            if state.stop[j] * balance < -settings.rounding * drive.torque:
                found.stop[j], settled = 0, False
        elif there > drive.upper[j] + settings.still_turn:
            found.stop[j], settled = 1, False
        elif there < drive.lower[j] - settings.still_turn:
            found.stop[j], settled = -1, False
    found.settled = settled
    for j in range(JOINT_COUNT):
        if pushes[j]:
            found.mode[j] = code.off
    # of contacts one at a time, the worst
    one = _largest(over)
    if one >= 0:
        if found.caught[one]:
            found.spines[one], found.off[one] = code.pulled, around.share[one]
        if not found.caught[one] or state.mode[one] == code.held:
            found.mode[one] = code.off
    one = _largest(cannot)
    if one >= 0:
        found.mode[one] = code.off
    one = _largest(moves)
    if one >= 0:
        found.mode[one] = code.on if closes[one] else code.held
        if closes[one] and found.spines[one] == code.lost:
            found.spines[one], found.off[one] = code.caught, 0.0


@compiled(
    *(SETTINGS_RECORD.dtype, CODE_RECORD.dtype, SHAPE_FIELDS, DRIVE_FIELDS),
    *(STATE_FIELDS, AROUND_FIELDS, "f1", LINEARISED_FIELDS),
)
def contact_states(
    settings: Record,
    code: Record,
    shape: Record,
    drive: Record,
    state: Record,
    around: Record,
    least: Array,
    found: Record,
) -> None:
    """Write the contact state of a finger for its next increment, with its linearised solution.

    Active-set iteration: contacts are switched until they agree with their forces and gaps, 20
    times at most.

    Parameters
    ----------
    settings, code, shape, drive : record
        `FingerSettings`, `ContactCodes`, `PhalanxShape`, and a record of `DRIVE_FIELDS`.
    state : record of `STATE_FIELDS`
        Joint angles, and the contact state to begin with, which is written over.
    around : record of `AROUND_FIELDS`
        Gaps, engagement and lever arms at these angles.
    least : ndarray, shape (3,)
        Gaps that spines keep from growing, infinite for tiles without caught spines [m].
    found : record of `LINEARISED_FIELDS`
        Result, written over: the linearised solution.
    """
    settings, code, shape, drive = settings[0], code[0], shape[0], drive[0]
    state, around, found = state[0], around[0], found[0]
    most_switches, longest_circle = 20, 4
    codes, count = np.empty(most_switches + 1, np.intp), 2
    codes[0] = _code(state, around)
    _try(settings, code, shape, drive, state, around, least, found)
    codes[1] = _code(found, around)
    for left in range(most_switches - 1, 0, -1):
        if found.settled:
            break
        # those that go round in a circle, and are now as they will be when the tries are used up
        circles = False
        for period in range(1, min(count - 1, longest_circle) + 1):
            if left % period == 0:
                circles |= codes[count - 1] == codes[count - 1 - period]
        if circles:
            break
        for j in range(JOINT_COUNT):
            state.mode[j], state.stop[j] = found.mode[j], found.stop[j]
            state.spines[j], state.off[j] = found.spines[j], found.off[j]
            state.slides[j] = found.slides[j]
        _try(settings, code, shape, drive, state, around, least, found)
        codes[count] = _code(found, around)
        count += 1
