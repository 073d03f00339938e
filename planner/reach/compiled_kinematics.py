"""Kinematics of one limb, and damped least squares for many poses of its hand (compiled)."""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["hand_frames", "limb_centres", "solve_poses"]


@compiled()
def _put_coupled(coupling: Array, offset: Array, x: Array, q: Array) -> None:
    """Write the places of all k joints, coupled ones too, at joint angles x (n,)."""
    for i in range(len(q)):
        q[i] = offset[i]
        for j in range(len(x)):
            q[i] += coupling[i, j] * x[j]


@compiled()
def _joint_frames(
    turns: Array, shifts: Array, axes: Array, slides: Array, q: Array, frames: Array, along: Array
) -> None:
    """Write axes and origins (k, 3, 4) of all joints in B, and where each moves to, (k, 3).

    ``along`` is the axis of a joint that turns, or the direction of one that slides.
    """
    R, M, T, p = np.eye(3), np.empty((3, 3)), np.empty((3, 3)), np.zeros(3)
    for i in range(len(q)):
        for a in range(3):
            for c in range(3):
                p[a] += R[a, c] * shifts[i, c]
                M[a, c] = R[a, 0] * turns[i, 0, c] + R[a, 1] * turns[i, 1, c]
                M[a, c] += R[a, 2] * turns[i, 2, c]
        x, y, z = axes[i]
        sine, rest = math.sin(q[i]), 1.0 - math.cos(q[i])
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
            p[a] += q[i] * slid
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


@compiled("f3", "f2", "f2", "f2", "f2", "f1", "f2", "f2")
def hand_frames(
    turns: Array,
    shifts: Array,
    axes: Array,
    slides: Array,
    coupling: Array,
    offset: Array,
    hand: Array,
    angles: Array,
) -> Array:
    """Return axes and origins (S, 3, 4) of the hand frame H in B at joint angles (S, n).

    The other parameters are the attributes of `LimbChain`.
    """
    k = len(coupling)
    frames, along, q = np.empty((k, 3, 4)), np.empty((k, 3)), np.empty(k)
    found = np.empty((len(angles), 3, 4))
    for s in range(len(angles)):
        _put_coupled(coupling, offset, angles[s], q)
        _joint_frames(turns, shifts, axes, slides, q, frames, along)
        _hand_frame(frames[k - 1], hand, found[s])
    return found


@compiled("f3", "f2", "f2", "f2", "f2", "f1", "f1", "f2", "f2")
def limb_centres(
    turns: Array,
    shifts: Array,
    axes: Array,
    slides: Array,
    coupling: Array,
    offset: Array,
    masses: Array,
    coms: Array,
    angles: Array,
) -> Array:
    """Return centres of mass (S, 3) of a limb with its hand, in B, at joint angles (S, n).

    The other parameters are the attributes of `LimbChain`.
    """
    k = len(coupling)
    frames, along, q = np.empty((k, 3, 4)), np.empty((k, 3)), np.empty(k)
    found = np.zeros((len(angles), 3))
    for s in range(len(angles)):
        _put_coupled(coupling, offset, angles[s], q)
        _joint_frames(turns, shifts, axes, slides, q, frames, along)
        for i in range(k):
            for a in range(3):
                at = frames[i, a, 3]
                for b in range(3):
                    at += frames[i, a, b] * coms[i, b]
                found[s, a] += masses[i] * at
        for a in range(3):
            found[s, a] /= masses.sum()
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
def _solve_six(A: Array, b: Array) -> None:
    """Solve A x = b in place of b, for a symmetric positive definite A (6, 6), by Cholesky."""
    for j in range(6):
        for i in range(j, 6):
            total = A[i, j]
            for m in range(j):
                total -= A[i, m] * A[j, m]
            A[i, j] = math.sqrt(max(total, 1e-300)) if i == j else total / A[j, j]
    for i in range(6):
        for m in range(i):
            b[i] -= A[i, m] * b[m]
        b[i] /= A[i, i]
    for i in range(5, -1, -1):
        for m in range(i + 1, 6):
            b[i] -= A[m, i] * b[m]
        b[i] /= A[i, i]


@compiled("f3", "f2", "f2", "f2", "f2", "f1", "f2", "f1", "f1", "f0", "f3", "f3", "f1", "i0", "i0")
def solve_poses(
    turns: Array,
    shifts: Array,
    axes: Array,
    slides: Array,
    coupling: Array,
    offset: Array,
    hand: Array,
    lower: Array,
    upper: Array,
    reach: float,
    targets: Array,
    starts: Array,
    numbers: Array,
    steps: int,
    branches: int,
) -> tuple[Array, Indices]:
    """Return joint angles that put a limb's hand on each of N poses, from several starts each.

    Parameters
    ----------
    turns, shifts, axes, slides, coupling, offset, hand, lower, upper, reach
        Attributes of `LimbChain`.
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
    k, n = coupling.shape
    near, damping, least_damping, longest, alike, early = numbers
    found = np.zeros(len(targets), dtype=np.intp)
    angles = np.zeros((len(targets), branches, n))
    frames, along, q = np.empty((k, 3, 4)), np.empty((k, 3)), np.empty(k)
    at, error, inner = np.empty((3, 4)), np.empty(6), np.empty(6)
    whole, J, A = np.empty((6, k)), np.empty((6, n)), np.empty((6, 6))
    x, step = np.empty(n), np.empty(n)
    for t in range(len(targets)):
        for s in range(starts.shape[1]):
            if found[t] >= branches:
                break
            for j in range(n):
                x[j] = min(max(starts[t, s, j], lower[j]), upper[j])
            before, solved = np.inf, False
            for turn in range(steps + 1):
                _put_coupled(coupling, offset, x, q)
                _joint_frames(turns, shifts, axes, slides, q, frames, along)
                _hand_frame(frames[k - 1], hand, at)
                for a in range(3):
                    error[a] = 0.0
                    for b in range(3):
                        error[a] += at[b, a] * (targets[t, b, 3] - at[b, 3])
                    error[a] /= reach
                _turn_between(at, targets[t], error)
                size, square = 0.0, 0.0
                for a in range(6):
                    size = max(size, abs(error[a]))
                    square += error[a] * error[a]
                solved = size <= near
                if solved or turn == steps or (turn >= early and size > 0.5 * before):
                    break
                before = size
                # columns of the Jacobian in H, lengths over the reach
                for i in range(k):
                    u, v, w = along[i]
                    if slides[i, 0] != 0.0 or slides[i, 1] != 0.0 or slides[i, 2] != 0.0:
                        lin = (u, v, w)
                        ang = (0.0, 0.0, 0.0)
                    else:
                        rx = at[0, 3] - frames[i, 0, 3]
                        ry = at[1, 3] - frames[i, 1, 3]
                        rz = at[2, 3] - frames[i, 2, 3]
                        lin = (v * rz - w * ry, w * rx - u * rz, u * ry - v * rx)
                        ang = (u, v, w)
                    for a in range(3):
                        total = at[0, a] * lin[0] + at[1, a] * lin[1] + at[2, a] * lin[2]
                        whole[a, i] = total / reach
                        whole[3 + a, i] = at[0, a] * ang[0] + at[1, a] * ang[1] + at[2, a] * ang[2]
                for a in range(6):
                    for j in range(n):
                        total = 0.0
                        for i in range(k):
                            total += whole[a, i] * coupling[i, j]
                        J[a, j] = total
                for j in range(n):
                    slope = 0.0
                    for a in range(6):
                        slope += J[a, j] * error[a]
                    # a joint at a limit that the step would exceed stays there
                    if (x[j] <= lower[j] and slope < 0.0) or (x[j] >= upper[j] and slope > 0.0):
                        for a in range(6):
                            J[a, j] = 0.0
                for a in range(6):
                    inner[a] = error[a]
                    for b in range(a + 1):
                        total = 0.0
                        for j in range(n):
                            total += J[a, j] * J[b, j]
                        A[a, b] = total
                    A[a, a] += damping * square + least_damping
                _solve_six(A, inner)
                farthest = longest
                for j in range(n):
                    step[j] = 0.0
                    for a in range(6):
                        step[j] += J[a, j] * inner[a]
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
