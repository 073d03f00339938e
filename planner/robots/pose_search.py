"""Solve the inverse kinematics of limbs by damped least squares (Levenberg–Marquardt).

With a hand's error e and its Jacobian J, the step is ``Jᵀ (J Jᵀ + λ 1)⁻¹ e``, whose damping λ
vanishes with e² (Sugihara, *Solvability-unconcerned inverse kinematics by the Levenberg–Marquardt
method*, IEEE Transactions on Robotics, 2011). Where an iteration ends in a local minimum, the
search restarts from another random posture whose hand is near the pose.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from hand_models.base import Array, Pose, stored
from planner import deadline
from planner.robots.limb_batch import LimbBatch
from planner.robots.robot import Robot
from planner.robots.tolerances import TOLERANCES

__all__ = ["damped_step", "find_angles", "postures_near"]


def find_angles(batch: LimbBatch) -> Array:
    """Return joint angles that put each hand on its target pose, or as near as was found.

    Of several solutions, the one with the smallest Σ (τ / τ_max)² is returned.

    Parameters
    ----------
    batch : LimbBatch
        L limbs of up to m joints, with the target poses of their hands.

    Returns
    -------
    ndarray, shape (L, m)
        Joint angles within their limits [rad]; zero beyond a limb's last joint.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    best, least = np.zeros(batch.shape), np.full(len(batch.limbs), np.inf)
    for k in range(8):  # rounds of starts for a pose that may be within reach
        # what is beyond the stretched limb is tried once, for the angles that come nearest
        left = np.flatnonzero(
            (least > TOLERANCES.pose_error) & ((batch.beyond <= 0.0) | np.isinf(least))
        )
        if not len(left):
            break
        starts = np.stack([_starts_near(batch, int(i), k) for i in left], axis=1)
        part = batch.part(left)
        angles, size = _follow(part, starts[:, :, : part.shape[1]])
        better = size < least[left]
        best[left[better], : part.shape[1]], least[left[better]] = angles[better], size[better]
    return best


def _follow(batch: LimbBatch, angles: Array) -> tuple[Array, Array]:
    """Return where starts (S, L, m) lead, the best for each limb, and the size of its error."""
    size = np.full(angles.shape[:2], np.inf)
    slow = np.zeros(angles.shape[:2], dtype=bool)
    steps = 15  # from every start
    # 25 more while each at least halves the error, as they do where a limb is stretched
    for k in range(steps + 25):
        deadline.check("the joint angles were found")
        errors, jacobians = batch.errors(angles)
        last, size = size, np.abs(errors).max(axis=2)
        done = size <= TOLERANCES.pose_error
        if k >= steps:
            slow |= size > 0.5 * last
        # of two solutions that of the least torques is taken
        over = done | slow | (done.sum(axis=0) >= 2)
        if over.all():
            break
        angles = np.where(over[:, :, None], angles, damped_step(batch, angles, errors, jacobians))
    size = np.abs(batch.errors(angles)[0]).max(axis=2)
    # solutions by torque, then all others by error
    rank = np.where(size <= TOLERANCES.pose_error, -1.0 / (1.0 + batch.cost(angles)), size)
    pick = rank.argmin(axis=0), np.arange(len(batch.limbs))
    return angles[pick], size[pick]


def damped_step(batch: LimbBatch, angles: Array, errors: Array, jacobians: Array) -> Array:
    """Return the joint angles after one damped least-squares step.

    A joint at a limit that the step would exceed stays there. No joint turns by more than 1 rad.

    Parameters
    ----------
    batch : LimbBatch
        Limbs, with target poses and loads of their hands.
    angles : ndarray, shape (S, L, m)
        Joint angles of S postures [rad].
    errors : ndarray, shape (S, L, 6)
        Pose errors at these angles, from `LimbBatch.errors`.
    jacobians : ndarray, shape (S, L, 6, m)
        Jacobians at these angles, from `LimbBatch.errors`.

    Returns
    -------
    ndarray, shape (S, L, m)
        Joint angles within their limits [rad].
    """
    slope = (errors[..., None, :] @ jacobians)[..., 0, :]
    stuck = (angles <= batch.lower) & (slope < 0.0) | (angles >= batch.upper) & (slope > 0.0)
    J = jacobians * ~stuck[..., None, :]
    transposed = J.swapaxes(-1, -2)
    # a little is left where there is no error: a stretched limb's matrix is singular
    damping = 0.1 * (errors * errors).sum(axis=-1) + 1e-12
    inner = np.linalg.solve(
        J @ transposed + damping[..., None, None] * np.eye(6), errors[..., None]
    )
    step = (transposed @ inner)[..., 0]
    most = 1.0  # [rad] that a joint turns
    longest = np.maximum(np.abs(step).max(axis=-1), most)
    moved = angles + step * (most / longest)[..., None]
    return np.asarray(np.minimum(np.maximum(moved, batch.lower), batch.upper))


def _starts_near(batch: LimbBatch, i: int, k: int) -> Array:
    """Return a limb's angles to start from in round k, shape (S, m), the most promising first."""
    abreast = 4  # starts that are followed together
    starts = np.zeros((abreast, batch.shape[1]))
    starts[:, : batch.joints[i]] = postures_near(batch, i, abreast * (k + 1))[-abreast:]
    return starts


def postures_near(batch: LimbBatch, i: int, count: int) -> Array:
    """Return random postures of limb i whose hand is nearest to its target pose.

    The postures are looked up among 4096 random ones with a k-d tree.

    Parameters
    ----------
    batch : LimbBatch
        Limbs, with target poses and loads of their hands.
    i : int
        Index of the limb in the batch.
    count : int
        Number of postures.

    Returns
    -------
    ndarray, shape (count, n)
        Joint angles of the limb, the nearest first [rad].
    """
    limb = batch.limbs[i]
    samples, tree = _postures(batch.robot)[limb]
    _, nearest = tree.query(_place(batch.poses[limb], batch.reach[i]), count)
    return np.asarray(samples[nearest])


@stored("postures of robots", 32)
def _postures(robot: Robot) -> dict[str, tuple[Array, Any]]:
    """Return random angles of every limb, and a tree of where they put its hand."""
    rng = np.random.default_rng(0)
    count = 4096  # random postures of each limb to look starts up in
    samples = {
        limb: rng.uniform(
            np.maximum(chain.lower, -np.pi),
            np.minimum(chain.upper, np.pi),
            (count, len(chain.joints)),
        )
        for limb, chain in robot.chains.items()
    }
    places = {limb: np.empty((count, 9)) for limb in robot.limbs}
    for k in range(count):
        found = robot.kinematics({limb: angles[k] for limb, angles in samples.items()})
        for limb, (pose, _) in found.items():
            places[limb][k] = _place(pose, robot.chains[limb].reach)
    return {limb: (samples[limb], scipy.spatial.cKDTree(places[limb])) for limb in robot.limbs}


def _place(pose: Pose, reach: float) -> Array:
    """Return nine numbers, near each other for poses that are."""
    # axes count 0.35 reaches beside the place
    return np.concatenate([pose.position / reach, 0.35 * pose.rotation[:, :2].ravel()])
