"""Kinematics of one limb, least squares for many poses of its hand, and paths (compiled)."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["follow_pose", "joint_frames", "solve_poses"]

LimbConstants = tuple[Any, ...]
"""`LimbChain.constants`: of a limb of k joints, of which n are driven."""

LIMB_TYPES: Final = "f3 f2 f2 f2 f2 f1 f2 f1 f1 f0"
"""Their types, as of `compiled`."""


@compiled()
def _joint_frames(chain: LimbConstants, angles: Array, frames: Array, along: Array) -> None:
    """Write axes and origins (k, 3, 4) of all joints in B, and where each moves to, (k, 3).

    ``along`` is the axis of a joint that turns, or the direction of one that slides; angles (n,).
    """
    turns, shifts, axes, slides, coupling, offset = chain[:6]
    R, M, T, p = np.eye(3), np.empty((3, 3)), np.empty((3, 3)), np.zeros(3)
    for i in range(len(coupling)):
        q = offset[i]
        for j in range(len(angles)):
            q += coupling[i, j] * angles[j]
        for a in range(3):
            for c in range(3):
                p[a] += R[a, c] * shifts[i, c]
                M[a, c] = R[a, 0] * turns[i, 0, c] + R[a, 1] * turns[i, 1, c]
                M[a, c] += R[a, 2] * turns[i, 2, c]
        x, y, z = axes[i]
        sine, rest = math.sin(q), 1.0 - math.cos(q)
        # Rodrigues: 1 + sin K + (1 - cos) K² of a unit axis; 1 of none
        T[0, 0] = 1.0 - rest * (y * y + z * z)
        T[1, 1] = 1.0 - rest * (x * x + z * z)
        T[2, 2] = 1.0 - rest * (x * x + y * y)
        T[0, 1], T[1, 0] = rest * x * y - sine * z, rest * x * y + sine * z
        T[0, 2], T[2, 0] = rest * x * z + sine * y, rest * x * z - sine * y
        T[1, 2], T[2, 1] = rest * y * z - sine * x, rest * y * z + sine * x
        for a in range(3):
            slid = 0.0
            along[i, a] = 0.0
            for c in range(3):
                R[a, c] = M[a, 0] * T[0, c] + M[a, 1] * T[1, c] + M[a, 2] * T[2, c]
                frames[i, a, c] = R[a, c]
                slid += M[a, c] * slides[i, c]
                along[i, a] += M[a, c] * (axes[i, c] + slides[i, c])
            p[a] += q * slid
            frames[i, a, 3] = p[a]


@compiled()
def _hand_frame(last: Array, hand: Array, found: Array) -> None:
    """Write axes and origin (3, 4) of the hand frame, fixed to the last joint's frame (3, 4)."""
    for a in range(3):
        for c in range(4):
            total = last[a, 3] if c == 3 else 0.0
            for b in range(3):
                total += last[a, b] * hand[b, c]
            found[a, c] = total


@compiled(LIMB_TYPES, "f2")
def joint_frames(chain: LimbConstants, angles: Array) -> Array:
    """Return axes and origins (S, k, 3, 4) of all joints in B at joint angles (S, n)."""
    k = len(chain[0])
    along, found = np.empty((k, 3)), np.empty((len(angles), k, 3, 4))
    for s in range(len(angles)):
        _joint_frames(chain, angles[s], found[s], along)
    return found


@compiled()
def _turn_between(first: Array, second: Array, out: Array) -> None:
    """Write the rotation vector, in the first axes, from axes (3, 3+) to others, at out[3:]."""
    D = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            D[a, b] = first[0, a] * second[0, b] + first[1, a] * second[1, b]
            D[a, b] += first[2, a] * second[2, b]
    x, y, z = D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    cosine = 0.5 * (D[0, 0] + D[1, 1] + D[2, 2] - 1.0)
    angle = math.atan2(sine, cosine)
    if sine > 1e-6:
        scale = 0.5 * angle / sine
        out[3], out[4], out[5] = scale * x, scale * y, scale * z
    elif cosine > 0.0:
        out[3], out[4], out[5] = 0.5 * x, 0.5 * y, 0.5 * z
    else:
        # half a turn: its axis is the largest column of D + 1
        j = 0
        for i in range(1, 3):
            if D[i, i] > D[j, j]:
                j = i
        size = 0.0
        for i in range(3):
            out[3 + i] = D[i, j] + (1.0 if i == j else 0.0)
            size += out[3 + i] * out[3 + i]
        for i in range(3):
            out[3 + i] *= angle / math.sqrt(size)


@compiled()
def _factored(A: Array) -> None:
    """Write the Cholesky factor of a symmetric positive definite A (m, m) into its lower part."""
    for j in range(len(A)):
        for i in range(j, len(A)):
            total = A[i, j]
            for m in range(j):
                total -= A[i, m] * A[j, m]
            A[i, j] = math.sqrt(max(total, 1e-300)) if i == j else total / A[j, j]


@compiled()
def _solve(A: Array, b: Array) -> None:
    """Solve A x = b in place of b, for a symmetric positive definite A (m, m), by Cholesky."""
    _factored(A)
    for i in range(len(A)):
        for m in range(i):
            b[i] -= A[i, m] * b[m]
        b[i] /= A[i, i]
    for i in range(len(A) - 1, -1, -1):
        for m in range(i + 1, len(A)):
            b[i] -= A[m, i] * b[m]
        b[i] /= A[i, i]


@compiled()
def _hand_error(at: Array, target: Array, reach: float, error: Array) -> None:
    """Write the twist (6,) in H from axes and origin (3, 4) to others, lengths over the reach."""
    for a in range(3):
        error[a] = 0.0
        for b in range(3):
            error[a] += at[b, a] * (target[b, 3] - at[b, 3])
        error[a] /= reach
    _turn_between(at, target, error)


@compiled()
def _hand_jacobian(chain: LimbConstants, frames: Array, along: Array, at: Array, J: Array) -> None:
    """Write the Jacobian (6, n) of a hand in H, lengths over the reach; see `_joint_frames`."""
    slides, coupling, reach = chain[3], chain[4], chain[9]
    J[:] = 0.0
    for i in range(len(frames)):
        u, v, w = along[i]
        if slides[i, 0] != 0.0 or slides[i, 1] != 0.0 or slides[i, 2] != 0.0:
            lin = (u / reach, v / reach, w / reach)
            ang = (0.0, 0.0, 0.0)
        else:
            rx = (at[0, 3] - frames[i, 0, 3]) / reach
            ry = (at[1, 3] - frames[i, 1, 3]) / reach
            rz = (at[2, 3] - frames[i, 2, 3]) / reach
            lin = (v * rz - w * ry, w * rx - u * rz, u * ry - v * rx)
            ang = (u, v, w)
        for a in range(3):
            moves = at[0, a] * lin[0] + at[1, a] * lin[1] + at[2, a] * lin[2]
            turns = at[0, a] * ang[0] + at[1, a] * ang[1] + at[2, a] * ang[2]
            for j in range(coupling.shape[1]):
                J[a, j] += moves * coupling[i, j]
                J[3 + a, j] += turns * coupling[i, j]


@compiled()
def _squared(J: Array, free: Array, damping: float, A: Array) -> None:
    """Write the lower part of J diag(free) Jᵀ + damping, (6, 6); ``free`` is 1, or 0 if stuck."""
    for a in range(6):
        for b in range(a + 1):
            total = 0.0
            for j in range(J.shape[1]):
                total += J[a, j] * free[j] * J[b, j]
            A[a, b] = total
        A[a, a] += damping


@compiled()
def _least_step(J: Array, free: Array, error: Array, damping: float, A: Array, step: Array) -> None:
    """Write the damped least step (n,) of free joints to a hand's twist (6,); A is overwritten.

    With w the joints that are free, that is diag(w) Jᵀ (J diag(w) Jᵀ + damping)⁻¹ error. Where
    joints are too few to reach the twist, the error that they leave is the least.
    """
    inner = error.copy()
    _squared(J, free, damping, A)
    _solve(A, inner)
    for j in range(J.shape[1]):
        step[j] = 0.0
        for a in range(6):
            step[j] += free[j] * J[a, j] * inner[a]


@compiled(LIMB_TYPES, "f2", "f1", "f1", "i0")
def follow_pose(
    chain: LimbConstants, target: Array, start: Array, numbers: Array, steps: int
) -> tuple[Array, bool]:
    """Return angles near others that put a limb's hand on a pose (n,), and whether there are any.

    The step is Newton's of least norm. The first one also goes down the slope of −½ log det J Jᵀ −
    Σ log (room of a joint in its range), in directions that leave the hand where it is, by at most
    as much as the joints turn anyway: so a redundant limb keeps off its limits, and off postures in
    which its hand cannot move every way.

    Parameters
    ----------
    chain
        `LimbChain.constants`.
    target : ndarray, shape (3, 4)
        Axes and origin of the pose of H in B.
    start : ndarray, shape (n,)
        Joint angles to start from.
    numbers : ndarray, shape (4,)
        Of `MotionSettings`: pose_error, largest_step, slope_step, least_damping.
    steps : int
        Steps at most.
    """
    (k, n), (hand, lower, upper, reach) = chain[4].shape, chain[6:]
    near, largest, h, least_damping = numbers
    frames, along = np.empty((k, 3, 4)), np.empty((k, 3))
    at, error = np.empty((3, 4)), np.empty(6)
    J, A, free, step = np.empty((6, n)), np.empty((6, 6)), np.empty(n), np.empty(n)
    angles, ends = start.copy(), np.empty(2)
    for turn in range(steps):
        _joint_frames(chain, angles, frames, along)
        _hand_frame(frames[k - 1], hand, at)
        _hand_error(at, target, reach, error)
        if np.abs(error).max() <= near:
            return angles, True
        _hand_jacobian(chain, frames, along, at, J)
        free[:] = 1.0
        for _ in range(n):
            _least_step(J, free, error, least_damping, A, step)
            stuck = False
            for j in range(n):
                # a joint at a limit that it would leave stays there
                leaves = (angles[j] <= lower[j] and step[j] < 0.0) or (
                    angles[j] >= upper[j] and step[j] > 0.0
                )
                if leaves:
                    free[j], stuck = 0.0, True
            if not stuck:
                break
        if turn == 0 and n > 6:
            most, kernel = np.abs(step).max(), np.linalg.svd(J)[2][6:]
            free[:] = 1.0
            for m in range(len(kernel)):
                rise = 0.0
                for j in range(n):
                    if math.isfinite(upper[j] - lower[j]):
                        room, other = max(upper[j] - start[j], h), max(start[j] - lower[j], h)
                        rise += (1.0 / room - 1.0 / other) * kernel[m, j]
                for side in range(2):
                    ends_at = start + (2 * side - 1) * h * kernel[m]
                    _joint_frames(chain, ends_at, frames, along)
                    _hand_frame(frames[k - 1], hand, at)
                    _hand_jacobian(chain, frames, along, at, J)
                    _squared(J, free, least_damping, A)
                    _factored(A)
                    ends[side] = 0.0
                    for a in range(6):
                        ends[side] += math.log(A[a, a])
                rise -= (ends[1] - ends[0]) / (2.0 * h)
                step -= kernel[m] * (min(max(rise, -1.0), 1.0) * most)
        for j in range(n):
            angles[j] = min(max(angles[j] + step[j], lower[j]), upper[j])
        if np.abs(angles - start).max() > largest:
            return angles, False
    return angles, False


@compiled(LIMB_TYPES, "f3", "f3", "f1", "i0", "i0")
def solve_poses(
    chain: LimbConstants, targets: Array, starts: Array, numbers: Array, steps: int, branches: int
) -> tuple[Array, Indices]:
    """Return joint angles that put a limb's hand on each of N poses, from several starts each.

    Parameters
    ----------
    chain
        `LimbChain.constants`.
    targets : ndarray, shape (N, 3, 4)
        Axes and origins of the poses of H in B.
    starts : ndarray, shape (N, S, n)
        Joint angles to start from.
    numbers : ndarray, shape (6,)
        Of `ReachSettings`: pose_error, damping, least_damping, longest_step, alike, early_steps.
    steps : int
        Steps from each start at most.
    branches : int
        Most solutions that are kept of a pose.

    Returns
    -------
    angles : ndarray, shape (N, branches, n)
    found : ndarray of int, shape (N,)
        Number of solutions of each pose.
    """
    (k, n), (hand, lower, upper, reach) = chain[4].shape, chain[6:]
    near, damping, least_damping, longest, alike, early = numbers
    found = np.zeros(len(targets), dtype=np.intp)
    angles = np.zeros((len(targets), branches, n))
    frames, along = np.empty((k, 3, 4)), np.empty((k, 3))
    at, error = np.empty((3, 4)), np.empty(6)
    J, A = np.empty((6, n)), np.empty((6, 6))
    x, free, step = np.empty(n), np.empty(n), np.empty(n)
    for t in range(len(targets)):
        for s in range(starts.shape[1]):
            if found[t] >= branches:
                break
            for j in range(n):
                x[j] = min(max(starts[t, s, j], lower[j]), upper[j])
            before, solved = np.inf, False
            for turn in range(steps + 1):
                _joint_frames(chain, x, frames, along)
                _hand_frame(frames[k - 1], hand, at)
                _hand_error(at, targets[t], reach, error)
                size, square = 0.0, 0.0
                for a in range(6):
                    size = max(size, abs(error[a]))
                    square += error[a] * error[a]
                solved = size <= near
                if solved or turn == steps or (turn >= early and size > 0.5 * before):
                    break
                before = size
                _hand_jacobian(chain, frames, along, at, J)
                for j in range(n):
                    slope = 0.0
                    for a in range(6):
                        slope += J[a, j] * error[a]
                    # a joint at a limit that the step would exceed stays there
                    low, high = x[j] <= lower[j] and slope < 0.0, x[j] >= upper[j] and slope > 0.0
                    free[j] = 0.0 if low or high else 1.0
                _least_step(J, free, error, damping * square + least_damping, A, step)
                farthest = longest
                for j in range(n):
                    farthest = max(farthest, abs(step[j]))
                for j in range(n):
                    x[j] = min(max(x[j] + step[j] * longest / farthest, lower[j]), upper[j])
            if solved:
                new = True
                for m in range(found[t]):
                    apart = 0.0
                    for j in range(n):
                        apart = max(apart, abs(angles[t, m, j] - x[j]))
                    new = new and apart > alike
                if new:
                    angles[t, found[t]] = x
                    found[t] += 1
    return angles, found
