"""Joint angles for poses of the hands: first any that put them there, then such that bear less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose, finite_vector
from planner import deadline
from planner.robots.limb_batch import Efforts, LimbBatch
from planner.robots.out_of_reach import PLACED, TURNED, pose_shortfall
from planner.robots.pose_search import TOLERANCE, find_angles, starts_near
from planner.robots.robot import Robot
from planner.robots.torque_lowering import lower_torques

__all__ = ["IkSolution", "UnreachableError", "solve_limbs", "unreachable"]

STARTS: Final = 2
"""Postures from which a pose out of reach is approached, beside the best found."""


@dataclass(frozen=True, eq=False)
class IkSolution:
    """Joint angles of a limb for a pose of its hand.

    Attributes
    ----------
    angles : ndarray, shape (n,)
        Within the joints' limits [rad]; the best found if the pose is not solved.
    position_error : float
        Distance of H from the pose [m].
    orientation_error : float
        Angle of H from the pose [rad].
    solved : bool
        Whether both errors are nil but for rounding.
    missing : float
        How far the pose is out of reach [m]: how far away the hand stays, turned as asked if it can
        be, and not less than the pose is beyond the stretched limb; zero if the pose is solved.
    turned : float or None
        Where the place is within reach, but not with these axes: the angle that is missing there
        [rad].
    """

    angles: Array
    position_error: float
    orientation_error: float
    solved: bool
    missing: float
    turned: float | None = None


class UnreachableError(InvalidInputError):
    """Poses of hands that no joint angles were found for.

    Parameters
    ----------
    missing : mapping of str to float
        By limb: the distance that is missing [m].
    turned : mapping of str to float
        By limb, of those whose place is within reach, but not with these axes: the angle that is
        missing there [rad].
    field : str, optional
    """

    kind = "unreachable"

    def __init__(
        self,
        missing: Mapping[str, float],
        turned: Mapping[str, float],
        *,
        field: str | None = None,
    ) -> None:
        said = []
        for limb, distance in missing.items():
            if limb in turned and distance <= PLACED:
                said.append(f"{limb} cannot be turned as asked, by {turned[limb]:.2g} rad")
                continue
            near = f" (turned by {turned[limb]:.2g} rad it is there)" if limb in turned else ""
            said.append(f"{limb} is out of reach by {distance:.2g} m{near}")
        super().__init__("; ".join(said), field=field)
        self.missing = dict(missing)
        self.turned = dict(turned)


def unreachable(solutions: Mapping[str, IkSolution]) -> UnreachableError | None:
    """Return the error that names every limb whose pose is not solved; None if all are."""
    wrong = {limb: solution for limb, solution in solutions.items() if not solution.solved}
    if not wrong:
        return None
    return UnreachableError(
        {limb: solution.missing for limb, solution in wrong.items()},
        {limb: each.turned for limb, each in wrong.items() if each.turned is not None},
    )


def solve_limbs(
    robot: Robot,
    poses: Mapping[str, Pose],
    *,
    seeds: Mapping[str, Array] | None = None,
    loads: Mapping[str, Array] | None = None,
    gravity: Array | None = None,
) -> dict[str, IkSolution]:
    """Return joint angles for poses of the hands, within the joints' limits.

    The same question always has the same answer. A limb of more than six joints uses what its pose
    leaves open to lower Σ (τ / τ_max)²; one of fewer than six reaches few poses.

    Parameters
    ----------
    robot : Robot
    poses : mapping of str to Pose
        H in B, by limb.
    seeds : mapping of str to ndarray, shape (n,), optional
        Angles to start from [rad], for an answer near them; by default, and where none is found
        from them, those of random postures whose hands are near the pose.
    loads : mapping of str to ndarray, shape (6,), optional
        Wrench that a hand is to exert on the rock, in H [N, N·m]; none by default.
    gravity : ndarray, shape (3,), optional
        In B [m/s²]; none by default. Without gravity and loads there is no torque to lower.

    Raises
    ------
    InvalidInputError
        If a limb is unknown, a pose is not finite, or a seed or a load has not its shape or is not
        finite.
    DeadlineError
        If the time is over before.
    """
    seeds, loads = seeds or {}, loads or {}
    for field, given in (("poses", poses), ("seeds", seeds), ("loads", loads)):
        for limb in given:
            if limb not in robot.limbs:
                raise InvalidInputError(
                    f"unknown limb {limb!r}; known are {', '.join(robot.limbs)}", field=field
                )
    if not poses:
        return {}
    for limb, pose in poses.items():
        finite_vector(pose.position, 3, f"poses.{limb}.position")
        finite_vector(np.ravel(pose.rotation), 9, f"poses.{limb}.orientation")
    batch = LimbBatch(robot, poses)
    efforts = None
    if loads or gravity is not None:
        efforts = Efforts(batch, loads, np.zeros(3) if gravity is None else gravity)
    angles = find_angles(batch, seeds, efforts)
    if efforts is not None:
        angles = lower_torques(batch, angles, efforts)
    errors = batch.errors(angles[None])[0][0]
    solved = np.abs(errors).max(axis=1) <= TOLERANCE
    positions = np.linalg.norm(errors[:, :3], axis=1) * batch.reach
    turns = np.linalg.norm(errors[:, 3:], axis=1)
    found = {}
    for i, limb in enumerate(batch.limbs):
        values = angles[i, : batch.joints[i]].copy()
        missing, turned = 0.0, None
        if not solved[i]:
            deadline.check("it was known how far a hand is out of reach")
            missing, turned = _lacking(batch, i, values)
        found[limb] = IkSolution(
            angles=values,
            position_error=float(positions[i]),
            orientation_error=float(turns[i]),
            solved=bool(solved[i]),
            missing=missing,
            turned=turned,
        )
    return found


def _lacking(batch: LimbBatch, i: int, best: Array) -> tuple[float, float | None]:
    """Return the distance that a limb lacks [m], and the angle at its place if that is in reach."""
    beyond = float(batch.beyond[i])
    limb = batch.limbs[i]
    starts = [best, *starts_near(batch, i, 0)[:STARTS, : batch.joints[i]]]
    lacks = pose_shortfall(batch.robot.model, limb, batch.poses[limb], starts)
    # without a posture that is turned as asked, what is told is how far away the place is
    missing = lacks.way if lacks.askew <= TURNED else lacks.place
    if beyond > 0.0 and missing <= beyond + PLACED:
        missing = beyond
    return missing, lacks.turn if lacks.place <= PLACED else None
