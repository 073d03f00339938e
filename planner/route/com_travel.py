"""Bound how far a robot's mass leaves the straight line while joints move linearly in time.

In a segment of unit time the joints of a chain turn at constant rates ω_j, and the body moves
straight and turns at a constant rate Ω. A point p of the chain is at most 4 t (1 − t) · |p''| / 8
from the straight line between its ends. The second derivative of the centre of mass is computed at
both ends and in the middle, and

    |p''(t)| ≤ largest of the three + sup |p'''| / 4.

The n-th derivative of a point is a sum over n joints (the body is joint 0), each a product of their
rates and of the vector from the outermost of them to the point, so

    |p⁽ⁿ⁾| ≤ Σ_j (B_jⁿ − B_{j−1}ⁿ) l_j + Σ_s n v_s B_sⁿ⁻¹,   B_j = Σ_{i ≤ j} |ω_i|,

with the largest distance l_j of the point from joint j, and prismatic joints s of rate v_s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from hand_models.base import Array, Pose
from planner.question import Load
from planner.robots import Payload, Robot

__all__ = ["mass_travel", "turn_between"]


class _Levers(NamedTuple):
    """Masses and lengths of a limb of k joints.

    Attributes
    ----------
    masses : ndarray, shape (k,)
        Mass of the link behind each joint [kg].
    centres : ndarray, shape (k,)
        Distance of each link's centre of mass from its joint [m].
    spans : ndarray, shape (k + 1,)
        Largest distance from the body's origin to the first joint, from each joint to the next, and
        from the last to the hand frame H [m].
    slides : ndarray, shape (k,)
        One for a prismatic joint, else zero.
    """

    masses: Array
    centres: Array
    spans: Array
    slides: Array


def _levers(robot: Robot) -> dict[str, _Levers]:
    """Return the levers of each limb of a robot."""
    model, found = robot.model, {}
    to_body = robot.root.inverse()
    for limb, chain in robot.chains.items():
        joints, inertias = ([each[i] for i in chain.ids] for each in (model.joints, model.inertias))
        slides = np.array([float(j.shortname().startswith("JointModelP")) for j in joints])
        farthest = [
            max(abs(model.lowerPositionLimit[j.idx_q]), abs(model.upperPositionLimit[j.idx_q]))
            for j in joints
        ]
        first = to_body.apply(np.array(model.jointPlacements[chain.ids[0]].translation))
        last = np.array(model.frames[chain.frame].placement.translation)
        spans = np.array([*map(np.linalg.norm, (first, *chain.spacing[1:], last))])
        spans[1:] += np.where(slides > 0.0, farthest, 0.0)
        found[limb] = _Levers(
            np.array([each.mass for each in inertias]),
            np.array([np.linalg.norm(each.lever) for each in inertias]),
            spans,
            slides,
        )
    return found


def turn_between(start: Pose, end: Pose) -> Array:
    """Return the rotation vector (3,), in W, of the shortest turn between two poses [rad]."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(end.rotation @ start.rotation.T).as_rotvec())


def mass_travel(
    robot: Robot, load: Load, turn: Array, start: Mapping[str, Array], end: Mapping[str, Array]
) -> float:
    """Return a bound of how far Σ m p leaves the straight line in a segment [kg·m].

    The sum is over the masses m at p in the world frame W that the load moves: the robot's links
    (or the load's own mass at its centre), and payloads.

    Parameters
    ----------
    robot : Robot
    load : Load
    turn : ndarray, shape (3,)
        Rotation vector of the body's turn, in the body frame B [rad].
    start, end : mapping of str to ndarray, shape (n,)
        Joint angles of each limb at both ends [rad, or m].
    """
    angle = float(np.linalg.norm(turn))
    rates = {
        limb: np.array([angle, *np.abs(robot.chains[limb].coupling) @ np.abs(end[limb] - at)])
        for limb, at in start.items()
    }
    levers = _levers(robot)
    own = robot.mass if load.mass is None else load.mass
    if load.com is not None:
        whole = own * float(np.linalg.norm(load.com)) * angle**2
    else:
        whole = own * _com_acceleration(robot, levers, turn, start, end, rates)
    for payload in load.payloads:
        whole += payload.mass * _of_payload(robot, levers, payload, angle, rates)
    return whole / 8.0


def _com_acceleration(
    robot: Robot,
    levers: Mapping[str, _Levers],
    turn: Array,
    start: Mapping[str, Array],
    end: Mapping[str, Array],
    rates: Mapping[str, Array],
) -> float:
    """Return the bound of the second derivative of the centre of mass [m]."""
    model, data, axes = robot.model, robot.data, robot.root.rotation
    v, still = np.zeros(model.nv), np.zeros(model.nv)
    for limb, at in start.items():
        chain = robot.chains[limb]
        v[chain.columns] = chain.coupling @ (end[limb] - at)
    most = 0.0
    for t in (0.0, 0.5, 1.0):
        angles = {limb: at + t * (end[limb] - at) for limb, at in start.items()}
        pin.centerOfMass(model, data, robot.configuration(angles), v, still)
        place = robot.root.inverse().apply(np.array(data.com[0]))
        rate, bend = axes.T @ np.array(data.vcom[0]), axes.T @ np.array(data.acom[0])
        bend = bend + 2.0 * np.cross(turn, rate) + np.cross(turn, np.cross(turn, place))
        most = max(most, float(np.linalg.norm(bend)))
    body = model.inertias[1]
    centre = float(np.linalg.norm(robot.root.inverse().apply(np.array(body.lever))))
    third = float(body.mass) * centre * float(np.linalg.norm(turn)) ** 3
    for limb, each in levers.items():
        for k, (mass, out) in enumerate(zip(each.masses, each.centres, strict=True)):
            third += mass * _derivative(each, rates[limb], k + 1, out, 3)
    return most + 0.25 * third / robot.mass


def _of_payload(
    robot: Robot,
    levers: Mapping[str, _Levers],
    payload: Payload,
    turn: float,
    rates: Mapping[str, Array],
) -> float:
    """Return the bound of a payload's second derivative, wherever on its limb it is [m]."""
    out = float(np.linalg.norm(payload.com))
    if payload.link == robot.description.body:
        return out * turn**2
    own = [payload.limb] if payload.limb is not None else list(levers)
    return max(
        _derivative(each, rates[limb], len(each.masses), out + float(each.spans[-1]), 2)
        for limb, each in levers.items()
        if limb in own
    )


def _derivative(levers: _Levers, rates: Array, count: int, out: float, order: int) -> float:
    """Return the bound of a derivative of a point at a distance from joint ``count`` [m].

    ``rates`` are those of the body's turn and of the limb's joints.
    """
    slides = np.concatenate([np.zeros(1), levers.slides[:count]])
    turning = rates[: count + 1] * (1.0 - slides)
    sums = np.cumsum(turning)
    reach = out + np.concatenate([np.cumsum(levers.spans[:count][::-1])[::-1], np.zeros(1)])
    turned = (sums**order - (sums - turning) ** order) @ reach
    return float(turned + order * (rates[: count + 1] * slides) @ sums ** (order - 1))
