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

import numpy as np

from hand_models.base import Array, go_on
from hand_models.finger.contact_states import contact_states, forces_on
from hand_models.finger.path_state import (
    JOINT_COUNT,
    Around,
    Drive,
    PathState,
    choose,
    held_share,
    put,
    take,
    times,
)
from hand_models.finger.phalanx_gaps import PhalanxShape
from hand_models.finger.settings import CONTACT_CODES, SETTINGS
from hand_models.sections import Flags, Outlines

__all__ = ["follow"]


def follow(
    rock: Outlines, shape: PhalanxShape, drive: Drive, q: Array
) -> tuple[PathState, Around, Flags]:
    """Follow the closing paths of n fingers up to their closing tensions.

    Parameters
    ----------
    rock : Outlines
        Rock in the plane of each finger.
    shape : PhalanxShape
    drive : Drive
    q : ndarray, shape (n, 3)
        Joint angles at the start [rad].

    Returns
    -------
    state : PathState
        State of each finger at the end of its path.
    around : Around
        Gaps, engagement and lever arms there.
    resting : ndarray of bool, shape (n,)
        Whether each finger came to rest.
    """
    end, beside = state, around = PathState.at(q), Around.of(rock, shape, drive, q)
    resting, going = np.zeros(len(q), dtype=bool), np.arange(len(q))
    slow = np.zeros(len(q), dtype=np.intp)
    for step in range(SETTINGS.most_increments):
        go_on()
        balance = SETTINGS.balance if step <= SETTINGS.long_path else SETTINGS.late_balance
        after, rests = _increment(shape, drive, state, around, balance)
        slow = np.where(after.damping > 0.1 * SETTINGS.most_damping * drive.torque, slow + 1, 0)
        ends = rests | (slow > SETTINGS.patience)
        if ends.any():
            resting[going[rests]] = True
            put(end, going[ends], take(after, ends))
            put(beside, going[ends], take(around, ends))
            going, slow = going[~ends], slow[~ends]
            rock, drive, around = take(rock, ~ends), take(drive, ~ends), take(around, ~ends)
            state, after = take(state, ~ends), take(after, ~ends)
            if not len(going):
                break
        there = Around.of(rock, shape, drive, after.q)
        state, around = _judged(shape, drive, state, around, after, there)
    return end, beside, resting


def _increment(
    shape: PhalanxShape, drive: Drive, state: PathState, around: Around, balanced: float
) -> tuple[PathState, Flags]:
    """Return where fingers come to next, and which of them are at their ends."""
    code = CONTACT_CODES
    stride, slack = state.stride, shape.closes
    caught = held_share(state, around) > 0.0
    # how far a phalanx may be off the rock
    least = np.where(caught, state.least, np.inf)
    # spines hold no longer than rock is within their travel
    mode = np.where((state.mode == code.held) & ~caught, code.off, state.mode).astype(np.int8)
    begun = state._replace(mode=mode)
    now = contact_states(drive, begun, around, least, shape.length, slack)
    mode, stop, spines, active = now.mode, now.stop, now.spines, now.active
    damped, size, turn, normals = now.damped, now.size, now.turn, now.normals
    move, grow = turn[..., 0], turn[..., 1]
    # spines that were pulled off, and where
    pulled = now.off > state.off
    # the least gap is that of the path, to which an increment first brings back the joints
    near = np.where(mode == code.held, np.inf, np.maximum(around.gap, now.gap).clip(0.0))
    least = np.where(caught, np.minimum(state.least, near), state.least)
    least = np.where(~caught & (spines == code.caught), np.inf, least)
    least = np.where(pulled, np.maximum(around.gap, 0.0), least)
    lost = (spines == code.pulled) & (around.gap > least + SETTINGS.lost_gap * shape.length)
    spines = np.where(lost, code.lost, spines).astype(np.int8)
    curved = (np.einsum("ni,nij,nj->n", move, damped, move) < 0.0) & (size > SETTINGS.damped_turn)
    waits = curved | ~now.settled
    waits &= state.damping < SETTINGS.most_damping * drive.torque
    turns_back = (move * state.step).sum(axis=1) < -0.3 * (state.step**2).sum(axis=1)
    turns_back &= (size > 100.0 * SETTINGS.still_turn) & ~waits
    # as far as the joints may turn, whose arms are of one, two and three phalanges
    air = ~active.any(axis=1)
    clear = around.gap.min(axis=1) / (0.5 * JOINT_COUNT * (JOINT_COUNT + 1) * shape.end)
    most = np.where(air, np.maximum(clear, SETTINGS.first_stride), SETTINGS.most_stride)
    most = np.minimum(stride, most)
    rate = times(around.d_gap, grow)
    opens = caught & (mode == code.off) & (rate > 0.0) & (now.gap < state.least)
    until = np.where(~active & (rate < 0.0), (now.gap + 2.0 * slack) / -rate, np.inf).min(axis=1)
    end = drive.end
    target = np.where(state.s < drive.closing, drive.closing, end)
    more = np.minimum(target - state.s, SETTINGS.most_tension * drive.closing)
    fastest = np.abs(grow).max(axis=1).clip(SETTINGS.rounding)
    more = np.minimum(more, (most - size).clip(0.0) / fastest)
    more = np.minimum(more, until.clip(0.0))
    # and no contact pushes across a gap, or pulls where nothing holds it
    force, rate = normals[..., 0], normals[..., 1]
    ends = np.where(mode == code.held, rate > 0.0, (mode == code.on) & ~now.caught & (rate < 0.0))
    until = np.where(ends, -force / rate, np.inf).min(axis=1)
    more = np.minimum(more, until.clip(SETTINGS.least_tension * drive.closing))
    # where a gap begins to grow, its least is to be that of the path, not of an increment beside it
    beside = (size > SETTINGS.path_turn) & opens.any(axis=1) & ~air
    more = np.where(waits | turns_back | beside | (size > most) | (now.clear < 1.0), 0.0, more)
    part = np.minimum(now.clear, most / np.maximum(size, SETTINGS.still_turn))
    part *= np.where(turns_back, 0.5, 1.0)
    step = np.where(waits[:, None], 0.0, part[:, None] * move + more[:, None] * grow)
    normals = np.where(active, normals[..., 0] + more[:, None] * normals[..., 1], 0.0)
    left = now.torque + more[:, None] * now.slope
    left -= times(now.stiffness, step) + times(around.b, normals)
    floor = SETTINGS.least_damping * drive.torque
    shrinks = (size < 0.5 * np.abs(state.step).max(axis=1)) | (state.s < end)
    damping = np.where(shrinks & ~turns_back, _falls(state.damping, floor), state.damping)
    tougher = _grows(state.damping, SETTINGS.damping, drive)
    rests = (state.s >= end) & ~waits & now.settled
    rests &= size < np.where(state.damping > 0.0, SETTINGS.damped_turn, SETTINGS.still_turn)
    rests &= state.damping * size < balanced * drive.torque
    s = state.s + more
    first = (mode == code.on) & np.isnan(state.touches)
    touches = np.where(first, state.s[:, None], state.touches)
    after = PathState(
        q=state.q + np.where(rests[:, None], 0.0, step),
        s=np.where(np.abs(target - s) < SETTINGS.rounding, target, s),
        mode=mode,
        stop=stop,
        spines=spines,
        been=(state.been | (mode == code.on)) & (around.share > now.off),
        off=now.off,
        least=least,
        normals=normals,
        touches=touches,
        damping=np.where(waits | turns_back, tougher, damping),
        stride=stride,
        step=step,
        left=np.where(stop != 0, 0.0, left),
    )
    stays = state._replace(damping=tougher, step=step, spines=spines, off=now.off, least=least)
    return choose(waits, stays, after), rests


def _judged(
    shape: PhalanxShape,
    drive: Drive,
    state: PathState,
    around: Around,
    after: PathState,
    there: Around,
) -> tuple[PathState, Around]:
    """Return fingers after an increment, or before it where its linearisation does not hold."""
    forces = forces_on(drive, after, there)
    left = forces.torque - times(there.b, after.normals)
    left = np.where(after.stop != 0, 0.0, left)
    wrong = np.abs(left - after.left).max(axis=1)
    damped, moved = np.abs(after.left).max(axis=1), np.abs(after.step).max(axis=1)
    deeper = np.minimum(around.gap, 0.0) - np.minimum(there.gap, 0.0)
    too_far = wrong > SETTINGS.path_torque * drive.torque
    too_far &= wrong > SETTINGS.damped_torque * damped
    air = (state.mode == CONTACT_CODES.off).all(axis=1)
    most = np.where(air, SETTINGS.air_depth, SETTINGS.rock_depth)
    too_far |= deeper.max(axis=1) > most * shape.length
    too_far &= moved > 2.0 * SETTINGS.least_stride
    stride = np.where(wrong < SETTINGS.exact_torque * drive.torque, 2.0, 1.3) * after.stride
    # a damped increment that was as foreseen may be damped less
    falls = (wrong <= 0.05 * damped + SETTINGS.rounding * drive.torque) & (moved > 0.0)
    falls &= (after.s >= drive.end) & (after.damping <= state.damping)
    less = _falls(after.damping, SETTINGS.least_damping * drive.torque)
    damping = np.where(falls, less, after.damping)
    good = after._replace(stride=np.minimum(stride, SETTINGS.most_stride), damping=damping)
    tougher = _grows(after.damping, 0.5 * SETTINGS.damping, drive)
    damping = np.where(after.s > state.s, after.damping, tougher)
    back = state._replace(stride=np.maximum(0.3 * moved, SETTINGS.least_stride), damping=damping)
    return choose(too_far, back, good), choose(too_far, around, there)


def _grows(damping: Array, least: float, drive: Drive) -> Array:
    """Return more damping; from a least on, in parts of the proximal joint's torque."""
    most = SETTINGS.most_damping * drive.torque
    return np.clip(SETTINGS.damping_growth * damping, least * drive.torque, most)


def _falls(damping: Array, floor: Array) -> Array:
    """Return less damping; none below a floor."""
    return np.where(damping < floor, 0.0, 0.4 * damping)
