"""Close fingers on rock along the path from the open finger to the closing tension (Section 5.1).

A finger's state is the turn q of its three joints at a tendon's tension f. Joint i is balanced when

    f M_i r_i − p_i − K_i q_i + Σ_{j ≥ i} (T_j a_ij − N_j b_ij) + λ_i = 0,

the sum of the torques of the tendon (friction loss M_i, pulley radius r_i), of the joint's spring
(preload p_i, stiffness K_i), of the shear T_j and the normal load N_j of each phalanx j (lever arms
a_ij, b_ij), and of the joint's stop (λ_i). With g_j(q) the gap between phalanx j and the rock:

- a phalanx that touches presses: g_j ≥ 0, and N_j > 0 only where g_j = 0;
- spines hold across a gap as well: they catch as the tile comes within their travel, by a share φ_j
  that grows to one at touch (`hand_models.tile`), and keep the gap from growing again: g_j ≤ m_j,
  the least gap so far, with N_j < 0 only where g_j = m_j;
- a tile whose phalanx has touched the rock is dragged by the tendon with T_j = φ_j M_j τ_j f; a
  tile whose spines reach across a gap is dragged last, at the closing tension (Section 3.2);
- spines hold as long as (T_j, N_j)/φ_j is within the surface's limit curve and M_j τ_j f is, at
  the closing tension, at least μ times their pull. Beyond that they are pulled off, all ψ_j = φ_j
  of them, and neither drag nor hold until the phalanx has left the rock and touches again.
  More spines catch as the tile comes nearer: their share is φ_j − ψ_j, in place of φ_j above.

So closing is a complementarity problem in f, and after that in the share of the drag across gaps.
It is followed in increments, each as far as its linearisation is valid, from zero tension with the
springs at rest (fingers with rock in their way start at their joints' lower limits).

Increments are those of *pseudo-transient continuation*: the joints are damped by D q̇, and D falls
as the increments agree with their linearisation. With D = 0 they are Newton's. Where a state loses
its stability, the damped joints leave it along the torques that then move them, so that the finger
ends where one that is tightened slowly would.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hand_models.base import Array, compiled, go_on
from hand_models.finger.around import AROUND_PARTS, ROCK_TYPES, around_rock, put_around
from hand_models.finger.contact_states import LINEARISED_FIELDS, contact_states, put_forces
from hand_models.finger.path_state import (
    AROUND_FIELDS,
    CODE_RECORD,
    DRIVE_FIELDS,
    JOINT_COUNT,
    SETTINGS_RECORD,
    SHAPE_FIELDS,
    STATE_FIELDS,
    WALK_FIELDS,
    Balanced,
    Record,
    Records,
    open_walks,
)
from hand_models.finger.phalanx_shape import PhalanxShape
from hand_models.finger.settings import SETTINGS
from hand_models.sections import Flags, Outlines

__all__ = ["Balanced", "follow"]

_WALK_PARTS = put_around, *AROUND_PARTS, contact_states, put_forces
_KEPT_FIELDS = STATE_FIELDS, AROUND_FIELDS, LINEARISED_FIELDS


def follow(
    rock: Outlines,
    shape: PhalanxShape,
    drive: Records,
    start: Records,
    courses: Sequence[list[Balanced]] | None = None,
) -> tuple[Records, Records, Flags]:
    """Follow the closing paths of n fingers up to their closing tensions, or their opening paths.

    Parameters
    ----------
    rock : Outlines
        Rock in the plane of each finger.
    shape : PhalanxShape
        Dimensions of the phalanges, the same for all fingers.
    drive : ndarray, shape (n,)
        Tendons and springs, records of `DRIVE_FIELDS` (see `drives`).
    start : ndarray, shape (n,)
        States at the start, records of `STATE_FIELDS`.
    courses : sequence of list of Balanced, length n, optional
        Written to: the balanced increments of each finger, in their order.

    Returns
    -------
    states, around : ndarray, shape (n,)
        State of each finger at the end of its path, and what is around it there: records of
        `STATE_FIELDS` and of `AROUND_FIELDS`.
    resting : ndarray of bool, shape (n,)
        Whether each finger came to rest.
    """
    states, around = start.copy(), around_rock(rock, shape, drive, start["q"])
    walks, finger, most = open_walks(start), 0, SETTINGS.increments_at_once
    kept = tuple([np.zeros(0 if courses is None else most, each) for each in _KEPT_FIELDS])
    fixed = (SETTINGS_RECORD, CODE_RECORD, shape.record), drive
    while finger < len(start):
        go_on()
        own: Any = states, around, walks, finger, most, kept, rock.arrays
        before, (finger, count) = finger, _walk(*_WALK_PARTS, *fixed, *own)
        if courses is not None:
            courses[before] += [Balanced(*(each[[i]] for each in kept)) for i in range(count)]
    return states, around, walks["rests"] != 0


@compiled()
def _caught(settings: Record, state: Record, around: Record, j: int) -> bool:
    """Return whether spines of a tile grip the rock: φ − ψ is above the least share."""
    return bool(1.0 - max(1.0 - around.share[j] + state.off[j], 0.0) > settings.least_share)


@compiled()
def _begun(settings: Record, code: Record, state: Record, around: Record, trial: Record) -> Array:
    """Write the state with which an increment begins; return the gaps that spines keep [m]."""
    settings, code, state, around, trial = settings[0], code[0], state[0], around[0], trial[0]
    trial.s, trial.damping, trial.stride = state.s, state.damping, state.stride
    least = np.empty(JOINT_COUNT)
    for j in range(JOINT_COUNT):
        caught = _caught(settings, state, around, j)
        least[j] = state.least[j] if caught else np.inf
        # spines hold no longer than rock is within their travel
        lets = state.mode[j] == code.held and not caught
        trial.mode[j] = code.off if lets else state.mode[j]
        trial.q[j], trial.stop[j], trial.spines[j] = state.q[j], state.stop[j], state.spines[j]
        trial.been[j], trial.off[j], trial.most[j] = state.been[j], state.off[j], state.most[j]
        trial.normals[j], trial.slides[j] = state.normals[j], state.slides[j]
    return least


@compiled()
def _grows(settings: Record, drive: Record, damping: float, least: float) -> float:
    """Return more damping; from a least on, in parts of the proximal joint's torque."""
    more = max(settings.damping_growth * damping, least * drive.torque)
    return float(min(more, settings.most_damping * drive.torque))


@compiled()
def _falls(settings: Record, drive: Record, damping: float) -> float:
    """Return less damping; none below a floor."""
    return 0.0 if damping < settings.least_damping * drive.torque else 0.4 * damping


@compiled()
def _curved(move: Array, damped: Array) -> bool:
    """Return whether the damped joints leave where they are along the torques that move them."""
    work = 0.0
    for i in range(JOINT_COUNT):
        for k in range(JOINT_COUNT):
            work += move[i] * damped[i, k] * move[k]
    return work < 0.0


@compiled()
def _product(A: Array, x: Array, i: int) -> float:
    """Return component i of A x."""
    total = 0.0
    for k in range(JOINT_COUNT):
        total += A[i, k] * x[k]
    return total


@compiled()
def _increment(
    settings: Record,
    code: Record,
    shape: Record,
    drive: Record,
    state: Record,
    around: Record,
    now: Record,
    balanced: float,
    after: Record,
) -> bool:
    """Write where a finger comes to next; return whether it is at its end."""
    settings, code, shape, drive = settings[0], code[0], shape[0], drive[0]
    state, around, now, after = state[0], around[0], now[0], after[0]
    size, move, grow = now.size, now.turn[:, 0], now.turn[:, 1]
    waits = _curved(move, now.damped) and size > settings.damped_turn
    waits = (waits or not now.settled) and state.damping < settings.most_damping * drive.torque
    along, square, before = 0.0, 0.0, 0.0
    for i in range(JOINT_COUNT):
        along += move[i] * state.step[i]
        square += state.step[i] ** 2
        before = max(before, abs(state.step[i]))
    turns_back = along < -0.3 * square and size > 100.0 * settings.still_turn and not waits
    # as far as the joints may turn, whose arms are of one, two and three phalanges
    air, most = not now.active.any(), settings.most_stride
    if air:
        clear = around.gap.min() / (0.5 * JOINT_COUNT * (JOINT_COUNT + 1) * shape.end)
        most = max(clear, settings.first_stride)
    most = min(state.stride, most)
    target = drive.closing if state.s < drive.closing else drive.end
    step = settings.most_lowering if drive.lowers else settings.most_tension
    more = min(target - state.s, step * drive.closing)
    fastest = max(np.abs(grow).max(), settings.rounding)
    more = min(more, max(most - size, 0.0) / fastest)
    opens, forced = False, np.inf
    for j in range(JOINT_COUNT):
        caught, mode = _caught(settings, state, around, j), now.mode[j]
        # the least gap is that of the path, not of joints that are on their way back to it
        after.least[j] = state.least[j] if caught else np.inf
        if caught and mode != code.held and size <= settings.path_turn:
            after.least[j] = min(state.least[j], max(now.gap[j], 0.0))
        if not caught and now.spines[j] != code.caught:
            after.least[j] = state.least[j]
        # spines that were pulled off, and where
        if now.off[j] > state.off[j]:
            after.least[j] = max(around.gap[j], 0.0)
        after.spines[j] = now.spines[j]
        after.most[j] = state.most[j] if now.spines[j] == code.caught else 0.0
        lost = around.gap[j] > after.least[j] + settings.lost_gap * shape.length
        if now.spines[j] == code.pulled and lost and not drive.lowers:
            after.spines[j] = code.lost
        rate = _product(around.d_gap, grow, j)
        # a gap that begins to grow, or joints that have left a state and come to rest in another
        begins = rate > 0.0 and now.gap[j] < state.least[j]
        opens |= caught and mode == code.off and (begins or state.damping > 0.0)
        if not now.active[j] and rate < 0.0:
            more = min(more, max((now.gap[j] + 2.0 * shape.closes) / -rate, 0.0))
        # and no contact pushes across a gap, or pulls where nothing holds it
        force, rate = now.normals[j, 0], now.normals[j, 1]
        pulls = mode == code.on and (not now.caught[j] or now.slides[j] != 0) and rate < 0.0
        if rate > 0.0 if mode == code.held else pulls:
            forced = min(forced, -force / rate)
        # or is dragged backwards against more than friction
        force = now.shears[j] + drive.limits[4] * force * now.active[j]
        rate = now.grows[j] + drive.limits[4] * rate * now.active[j]
        if drive.lowers and caught and now.slides[j] == 0 and rate < 0.0:
            forced = min(forced, max(-force / rate, 0.0))
    more = min(more, max(forced, settings.least_tension * drive.closing))
    # where a gap may grow, its least is to be that of the path, not of an increment beside it
    beside = size > settings.path_turn and opens and not air
    if state.damping > 0.0:
        # what has lost its stability is to leave at this tension, and is only pushed off; damped
        # joints lag behind their balance, and may end on the other side of one they leave
        more = min(more, settings.least_tension * drive.closing)
    if drive.lowers == 1:
        # from balance to balance
        beside |= max(state.unbalanced, state.damping * size) > settings.balanced * drive.torque
    if waits or turns_back or beside or size > most or now.clear < 1.0:
        more = 0.0
    part = min(now.clear, most / max(size, settings.still_turn)) * (0.5 if turns_back else 1.0)
    shrinks = (size < 0.5 * before or state.s < drive.end) and not turns_back
    tougher = _grows(settings, drive, state.damping, settings.damping)
    rests = state.s >= drive.end and not waits and now.settled != 0
    still = settings.damped_turn if state.damping > 0.0 else settings.still_turn
    rests = rests and size < still and state.damping * size < balanced * drive.torque
    after.s, after.stride, after.damping = state.s, state.stride, tougher
    for j in range(JOINT_COUNT):
        after.q[j], after.step[j], after.off[j] = state.q[j], 0.0, now.off[j]
    if waits:
        for j in range(JOINT_COUNT):
            after.mode[j], after.stop[j] = state.mode[j], state.stop[j]
            after.been[j], after.slides[j] = state.been[j], state.slides[j]
            after.normals[j], after.touches[j] = state.normals[j], state.touches[j]
            after.left[j] = state.left[j]
        return rests
    s = state.s + more
    after.s = target if abs(target - s) < settings.rounding else s
    if not turns_back:
        after.damping = _falls(settings, drive, state.damping) if shrinks else state.damping
    for j in range(JOINT_COUNT):
        after.mode[j], after.stop[j], after.slides[j] = now.mode[j], now.stop[j], now.slides[j]
        on = now.mode[j] == code.on
        after.been[j] = (state.been[j] or on) and around.share[j] > now.off[j]
        after.touches[j] = state.s if on and np.isnan(state.touches[j]) else state.touches[j]
        after.step[j] = part * move[j] + more * grow[j]
        if not rests:
            after.q[j] += after.step[j]
        after.normals[j] = now.normals[j, 0] + more * now.normals[j, 1] if now.active[j] else 0.0
    for j in range(JOINT_COUNT):
        left = now.torque[j] + more * now.slope[j] - _product(now.stiffness, after.step, j)
        left -= _product(now.arms, after.normals, j)
        after.left[j] = 0.0 if now.stop[j] != 0 else left
    return rests


@compiled()
def _judged(
    settings: Record,
    code: Record,
    shape: Record,
    drive: Record,
    state: Record,
    around: Record,
    after: Record,
    there: Record,
    forces: Record,
) -> float:
    """Return the largest torque left after an increment; infinite if that went too far [N·m].

    The next stride and damping are written to the state after the increment, or, if it is not as
    its linearisation says, to the state before it.
    """
    settings, code, shape, drive = settings[0], code[0], shape[0], drive[0]
    state, around, after, there, forces = state[0], around[0], after[0], there[0], forces[0]
    wrong, damped, moved, deeper, air, most = 0.0, 0.0, 0.0, -np.inf, True, 0.0
    for j in range(JOINT_COUNT):
        left = forces.torque[j] - _product(forces.arms, after.normals, j)
        left = 0.0 if after.stop[j] != 0 else left
        most = max(most, abs(left))
        wrong, damped = max(wrong, abs(left - after.left[j])), max(damped, abs(after.left[j]))
        moved = max(moved, abs(after.step[j]))
        deeper = max(deeper, min(around.gap[j], 0.0) - min(there.gap[j], 0.0))
        air = air and state.mode[j] == code.off
    too_far = wrong > settings.path_torque * drive.torque
    too_far = too_far and wrong > settings.damped_torque * damped
    too_far |= deeper > (settings.air_depth if air else settings.rock_depth) * shape.length
    if too_far and moved > 2.0 * settings.least_stride:
        if after.s > state.s:
            state.damping = after.damping
        else:
            state.damping = _grows(settings, drive, after.damping, 0.5 * settings.damping)
        state.stride = max(0.3 * moved, settings.least_stride)
        return float(np.inf)
    # spines of a finger that opens catch nothing anew
    for j in range(JOINT_COUNT if drive.lowers else 0):
        if most <= settings.balanced * drive.torque:
            after.most[j] = min(after.most[j], there.share[j])
        after.off[j] = max(there.share[j] - after.most[j], 0.0)
    after.unbalanced = most
    growth = 2.0 if wrong < settings.exact_torque * drive.torque else 1.3
    after.stride = min(growth * after.stride, settings.most_stride)
    # a damped increment that was as foreseen may be damped less
    falls = wrong <= 0.05 * damped + settings.rounding * drive.torque and moved > 0.0
    if falls and after.s >= drive.end and after.damping <= state.damping:
        after.damping = _falls(settings, drive, after.damping)
    return float(most)


@compiled(
    *(*_WALK_PARTS, (SETTINGS_RECORD.dtype, CODE_RECORD.dtype, SHAPE_FIELDS)),
    *(DRIVE_FIELDS, STATE_FIELDS, AROUND_FIELDS, WALK_FIELDS, "i0", "i0"),
    *(_KEPT_FIELDS, ROCK_TYPES),
)
def _walk(
    put: Any,
    nearby: Any,
    beside: Any,
    find_states: Any,
    find_forces: Any,
    fixed: tuple[Record, Record, Record],
    drives: Record,
    states: Record,
    arounds: Record,
    walks: Record,
    finger: int,
    most: int,
    kept: tuple[Record, Record, Record],
    rocks: Any,
) -> tuple[int, int]:
    """Go on with the paths of fingers, from one on; of that one alone if its balances are kept.

    Return the finger to go on with next, and the number of balances that were kept. The first
    are `_WALK_PARTS`; ``most``: number of increments at most; ``rocks``: `Outlines.arrays`.
    """
    (settings, code, shape), (balances, arounds_there, forces) = fixed, kept
    now, trial, count = np.zeros(1, LINEARISED_FIELDS), states[:1].copy(), 0
    last = min(len(states), finger + 1) if len(balances) else len(states)
    while finger < last and most > 0:
        state, around = states[finger : finger + 1].copy(), arounds[finger : finger + 1].copy()
        after, there, ends = state.copy(), around.copy(), False
        drive, walk, torque = drives[finger : finger + 1], walks[finger], drives[finger].torque
        tough = 0.1 * settings[0].most_damping * torque
        while most > 0 and not ends:
            most, walk.step = most - 1, walk.step + 1
            least = _begun(settings, code, state, around, trial)
            find_states(settings, code, shape, drive, trial, around, least, now)
            if drive[0].lowers:
                # one that moves to and fro at a tension goes on without a balance there
                walk.still = walk.still + 1 if walk.s == state[0].s else 0
                drive[0].lowers = 2 if walk.still > settings[0].patience else 1
            late = walk.step > settings[0].long_path + 1
            balance = settings[0].late_balance if late else settings[0].balance
            rests = _increment(settings, code, shape, drive, state, around, now, balance, after)
            walk.slow = walk.slow + 1 if after[0].damping > tough else 0
            walk.s = after[0].s
            if rests or walk.slow > settings[0].patience:
                state, walk.rests, ends = after, rests, True
                continue
            put(nearby, beside, settings, shape, drive[0].depth, after[0].q, there, rocks, finger)
            find_forces(settings, code, drive, after, there, now)
            left = _judged(settings, code, shape, drive, state, around, after, there, now)
            if left < np.inf:
                if len(balances) and left <= settings[0].balanced * torque:
                    balances[count], arounds_there[count], forces[count] = (
                        after[0],
                        there[0],
                        now[0],
                    )
                    count += 1
                walk.s = state[0].s
                state, after, around, there = after, state, there, around
            ends = walk.step >= settings[0].most_increments
        states[finger], arounds[finger] = state[0], around[0]
        finger += 1 if ends else 0
    return finger, count
