"""Joints that follow others (mimic): where a limb's motors put all of its joints.

A limb's joints are ``q = matrix · a + offset`` where a are those that motors move. By virtual work
the force of a motor is then ``matrixᵀ · τ``: its own joint's, and that of every joint that follows
it, times how far that one moves for each radian or metre of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError
from planner.robots.urdf import JointElement

__all__ = ["JointCoupling", "coupling_of", "uncoupled"]


class JointCoupling(NamedTuple):
    """Where k joints of a limb are, by the n of them that move by themselves.

    Attributes
    ----------
    driving : tuple of JointElement, length n
        From the body outward.
    matrix : ndarray, shape (k, n)
        [1, or m/rad or rad/m where one of them slides]
    offset : ndarray, shape (k,)
        [rad, or m]
    lower, upper : ndarray, shape (n,)
        Limits of those that drive, such that those that follow keep to theirs, too [rad, or m].
    """

    driving: tuple[JointElement, ...]
    matrix: Array
    offset: Array
    lower: Array
    upper: Array


def uncoupled(chain: Sequence[JointElement]) -> tuple[JointElement, ...]:
    """Return the joints of a limb that follow none which is moved by the limb's own motors."""
    known = _found(chain)
    return tuple(joint for joint in chain if joint.name not in known)


def coupling_of(chain: Sequence[JointElement]) -> JointCoupling:
    """Return how the joints of a limb hang together, all of which follow its own motors.

    Raises
    ------
    InvalidInputError
        If the limits of coupled joints leave no room to a joint that drives them.
    """
    known = _found(chain)
    driving = tuple(joint for joint in chain if joint.mimic is None)
    names = [joint.name for joint in driving]
    matrix, offset = np.zeros((len(chain), len(driving))), np.zeros(len(chain))
    lower = np.array([joint.lower for joint in driving])
    upper = np.array([joint.upper for joint in driving])
    for i, joint in enumerate(chain):
        driver, ratio, shift = known[joint.name]
        j = names.index(driver)
        matrix[i, j], offset[i] = ratio, shift
        if ratio:
            ends = sorted(((joint.lower - shift) / ratio, (joint.upper - shift) / ratio))
            lower[j], upper[j] = max(lower[j], ends[0]), min(upper[j], ends[1])
            if lower[j] > upper[j]:
                raise InvalidInputError(
                    f"joint {joint.name!r} follows {driver!r}, and their limits leave no room"
                )
    return JointCoupling(driving, matrix, offset, lower, upper)


def _found(chain: Sequence[JointElement]) -> dict[str, tuple[str, float, float]]:
    """Return of each joint that a motor of the limb moves that one's name, ratio and offset."""
    found = {joint.name: (joint.name, 1.0, 0.0) for joint in chain if joint.mimic is None}
    for _ in chain:
        for joint in chain:
            if joint.mimic is not None and joint.mimic.joint in found:
                driver, ratio, shift = found[joint.mimic.joint]
                by = joint.mimic.multiplier
                found[joint.name] = driver, by * ratio, by * shift + joint.mimic.offset
    return found
