"""Check whether a body wrench is likely in another unit, in another frame or of the wrong sign."""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array
from planner.question import Question
from planner.result import Finding
from planner.scene.scene import SCENE_SETTINGS
from planner.scene.units import STANDARD_GRAVITY, force_unit, robot_findings, unit_finding

__all__ = ["WrenchCheck", "wrench_findings"]


class WrenchCheck:
    """Check of one body wrench after another, in some microseconds each.

    Wrenches are compared with what the robot, or the load of the question, weighs under the
    stance's gravity, and with the reach of the limbs. Nothing is found if the robot's own numbers
    are odd.

    Parameters
    ----------
    question : Question
        Stance, with the robot, and load.
    """

    def __init__(self, question: Question) -> None:
        stance, load, robot = question.stance, question.load, question.stance.robot
        gravity = float(np.linalg.norm(stance.gravity))
        mass = robot.mass if load.mass is None else load.mass
        mass += sum(each.mass for each in load.payloads)
        self._mass, self._weight, self._reach = mass, mass * gravity, robot.reach
        self._on_earth = robot.mass * STANDARD_GRAVITY
        up = stance.body.rotation.T @ -stance.gravity / (gravity or 1.0)
        self._up: tuple[float, ...] = tuple(up.tolist())
        self._known = not any(robot_findings(robot))

    def findings(self, wrench: Array) -> tuple[Finding, ...]:
        """Return a finding for each oddity of a body wrench.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        if not self._known:
            return ()
        fx, fy, fz, mx, my, mz = wrench.tolist()
        force, moment = math.hypot(fx, fy, fz), math.hypot(mx, my, mz)
        on_earth, lever = self._on_earth, max(force, self._on_earth)
        found = []
        if force > SCENE_SETTINGS.in_thousandths * on_earth:
            message = f"a force of {force:.3g} N is {force / on_earth:.3g} times the robot's weight"
            found.append(
                unit_finding("body_wrench", f"{message} on the Earth: is it in N?", force, "N")
            )
        elif self._weight and force and force != 1.0:
            up = self._up
            found += self._of_weight(force, (up[0] * fx + up[1] * fy + up[2] * fz) / force)
        if moment > SCENE_SETTINGS.widest * self._reach * lever:
            message = f"a moment of {moment:.3g} N·m is that of {lever:.4g} N at"
            message += f" {moment / lever:.3g} m: is it in N·m?"
            found.append(unit_finding("body_wrench", message, moment, "N·m"))
        return tuple(found)

    def _of_weight(self, force: float, up: float) -> list[Finding]:
        """Return what is odd about a force beside the weight; ``up``: cosine of its angle to up."""
        part, about = force / self._weight, SCENE_SETTINGS.about_weight
        # within 20° of up it holds the robot's weight
        if up > 0.94 and (unit := force_unit(part)) is not None:
            message = f"it holds up {force:.3g} N, the robot weighs {self._weight:.4g} N"
            return [
                unit_finding("body_wrench", f"{message}: is it in N, or in {unit}?", force, "N")
            ]
        up = max(-1.0, min(up, 1.0))
        angle = math.acos(up)
        # acceleration of the body that would need it, if nothing else pulled there
        needed = self._weight / self._mass * math.hypot(part - up, math.sqrt(1.0 - up * up))
        sharp = angle >= SCENE_SETTINGS.off_up and needed >= SCENE_SETTINGS.sharpest
        if not (sharp and 1.0 / about <= part <= about):
            return []
        message = (
            f"body_wrench: a force of {force:.4g} N, about the robot's weight of "
            f"{self._weight:.4g} N, points {math.degrees(angle):.0f}° off up: is it in B, not in "
            "W, and what the rock exerts on the robot, not gravity itself?"
        )
        return [Finding("wrench_not_up", "body_wrench", message, angle, "rad")]


def wrench_findings(question: Question) -> tuple[Finding, ...]:
    """Return what is odd about a given body wrench; nothing if the question has none."""
    wrench = question.body_wrench
    return () if wrench is None else WrenchCheck(question).findings(wrench)
