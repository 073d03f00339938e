"""Compute whether joints bear what hands hold a state with: programs with rows of torques."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Pose, wrench_transport
from planner.limbs import LimbChain
from planner.prepare import torque_limits
from planner.programs import WRENCH_UNIT, SilentHighs
from planner.question import EARTH_GRAVITY, Limits, Question, Stance
from planner.search import State, Wall

__all__ = ["JointLoadPrograms", "LimbLoads"]


class LimbLoads(NamedTuple):
    """Joint torques of a limb over their limits: ``still + hand @ wrench``.

    Attributes
    ----------
    still : ndarray, shape (k,)
        Without a wrench, from the limb's weight, of the k joints with a motor [1].
    hand : ndarray, shape (k, 6)
        By the wrench of the rock on the robot, in the axes of W, in `WRENCH_UNIT`.
    moment : ndarray, shape (3,)
        That the limb's weight needs besides what it needs at rest angles, in `WRENCH_UNIT`.
    """

    still: Array
    hand: Array
    moment: Array


class JointLoadPrograms:
    """Linear programs for the least share of joint torque limits with which states are held.

    The hands' sets are those of the search, by their vertices, at the robot's weight.

    Parameters
    ----------
    wall : Wall
    limits : Limits
        Of every stage.
    """

    def __init__(self, wall: Wall, limits: Limits) -> None:
        self._wall = wall
        first = wall.places[0]
        stance = Stance((first,), wall.bodies[0], robot=wall.robot, joints="solve")
        # other limits may be about hands that this stance has not
        own = Limits(joint_torque=limits.joint_torque)
        self._limits = torque_limits(Question(stance, limits=own))
        self._chains = [LimbChain.of(wall.robot, name) for name in wall.robot.limbs]

    def loads(self, limb: int, place: int, body: int, angles: Array) -> LimbLoads:
        """Return the joint loads of a limb that holds a placement at joint angles (n,) [rad]."""
        wall, name = self._wall, self._wall.robot.limbs[limb]
        pull = wall.bodies[body].rotation.T @ np.array(EARTH_GRAVITY)
        still = wall.robot.statics({name: angles}, pull, np.zeros(6)).joint_torque[name]
        _, jacobian = wall.robot.kinematics({name: angles})[name]
        hand = wall.places[place].pose
        off = Pose(hand.position - wall.screening.hands.about, hand.rotation)
        # a wrench on the rock in H, from one on the robot about the hands' point in W
        into = np.linalg.inv(-wrench_transport(off) / WRENCH_UNIT[:, None])
        most = self._limits[name]
        driven = most > 0.0
        return LimbLoads(
            (still / np.where(driven, most, 1.0))[driven],
            ((jacobian.T @ into) / np.where(driven, most, 1.0)[:, None])[driven],
            self.moment(limb, body, angles),
        )

    def moment(self, limb: int, body: int, angles: Array) -> Array:
        """Return the moment that a limb's weight needs besides that at rest angles, (3,).

        It is in the axes of W, in `WRENCH_UNIT`, as of `limb_moments`, for joint angles (n,) [rad].
        """
        robot, chain = self._wall.robot, self._chains[limb]
        rest = robot.chains[robot.limbs[limb]].rest
        away = (chain.centres(angles[None]) - chain.centres(rest[None]))[0]
        arm = self._wall.bodies[body].rotation @ (chain.masses.sum() * away)
        return np.asarray(np.cross(arm, -np.array(EARTH_GRAVITY)) / WRENCH_UNIT[3:])

    def share(
        self,
        state: State,
        loads: Mapping[int, LimbLoads],
        more: Array | None = None,
        multiple: float = 1.0,
    ) -> float:
        """Return the least share of torque limits at which hands hold a state; ∞ if none do.

        Parameters
        ----------
        state : State
        loads : mapping of int to LimbLoads
            Of each limb on the rock, by limb.
        more : ndarray, shape (6,), optional
            Wrench that the hands supply besides that for the robot's weight with the limb in the
            air at rest angles, in `WRENCH_UNIT`.
        multiple : float, optional
            Of the robot's weight, without that of the links in their joints.
        """
        hands, members = self._wall.screening.hands, np.array(state.members)
        limbs = np.flatnonzero(members >= 0).tolist()
        needed = self._wall.screening.wrenches[state.body] + (0.0 if more is None else more)
        needed[3:] += sum(loads[limb].moment for limb in limbs)
        needed = multiple * needed
        parts = {limb: hands.part_of(int(members[limb])) for limb in limbs}
        ends = np.cumsum([1, *(each[0].stop - each[0].start for each in parts.values())])
        columns, size = dict(zip(limbs, ends, strict=False)), int(ends[-1])
        # columns: the share, then weights of the vertices
        rows, least, most = list[Array](), list[Array](), list[Array]()

        def add(block: Array, at: int, low: Array, high: Array, share: float = 0.0) -> None:
            whole = np.zeros((len(block), size))
            whole[:, at : at + block.shape[1]] = block
            whole[:, 0] = -share
            rows.append(whole)
            least.append(low)
            most.append(high)

        balance = np.zeros((6, size))
        for limb, (own, whose) in parts.items():
            p, at, points = int(members[limb]), int(columns[limb]), hands.points[own]
            balance[:, at : at + len(points)] = points.T
            needed = needed - hands.base[p]
            sums = (whose == np.arange(whose[-1] + 1)[:, None]).astype(float)
            one = np.ones(len(sums))
            add(sums, at, one, one)
            bounded = np.isfinite(hands.room[p])
            room = hands.room[p, bounded]
            add(hands.rows[own][:, bounded].T, at, np.full(len(room), -np.inf), room)
            still, hand, _ = loads[limb]
            base, free = still + hand @ hands.base[p], np.full(len(still), np.inf)
            add(hand @ points.T, at, -free, -base, 1.0)
            add(hand @ points.T, at, -base, free, -1.0)
        rows.append(balance)
        every = np.vstack(rows)
        low, high = (np.concatenate([*ends_of, needed]) for ends_of in (least, most))
        solver = SilentHighs({"presolve": "off", "solver": "simplex"})
        solver.load(every, (np.zeros(size), np.full(size, np.inf)), (low, high))
        solver.changeColCost(0, 1.0)
        return float(solver.getObjectiveValue()) if solver.optimal() else float(np.inf)
