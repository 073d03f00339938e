"""Find numbers of a question whose size is odd, so that they are likely in another unit.

Each number is compared with known sizes of the robot (its weight, the strength of its hands, the
reach of its limbs) and with the strengths of the preset surfaces. A size that another unit of the
field would explain gives a finding of the kind ``unit``; a factor of a few gives none. Gravity may
be that of the Earth, the Moon or a small body, but hardly 1 m/s².
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.tile import preset_strengths
from planner.question import Question, Stance
from planner.result import Finding
from planner.robots import Robot, scene_number
from planner.scene.scene import SCENE_SETTINGS

__all__ = ["STANDARD_GRAVITY", "force_unit", "robot_findings", "unit_finding", "unit_findings"]

STANDARD_GRAVITY: Final = scene_number("usual", "standard_gravity")
"""Acceleration by which a weight is a mass [m/s²]."""

STRONGEST_GRAVITY: Final = scene_number("usual", "strongest_gravity")
"""Acceleration above that of any planet [m/s²]."""


def unit_findings(question: Question) -> tuple[Finding, ...]:
    """Return a finding for each number of a question that is likely in another unit.

    Parameters
    ----------
    question : Question
        Question to check, except for its body wrench: see `WrenchCheck`.
    """
    stance = question.stance
    robot = tuple(robot_findings(stance.robot))
    found = (
        *_gravity(stance),
        *robot,
        *_surfaces(stance),
        *_tensions(question),
        *_caps(question),
        *_hand_wrenches(stance),
    )
    # a robot that is odd itself is no measure of others
    return found if robot else (*found, *_load(question), *_holds(stance), *_joints(question))


def unit_finding(field: str, message: str, value: float, unit: str, whose: str = "") -> Finding:
    """Return a finding whose message begins with whose number it is: a limb's, else the field's."""
    return Finding("unit", field, f"{whose or field}: {message}", value, unit)


# What the body weighs -----------------------------------------------------------------------------


def force_unit(part: float) -> str | None:
    """Return the unit in which a force that is such a part of the weight would be the weight."""
    # each with the factor that it may be off, as a body may carry and accelerate; a number in kgf
    # is only a tenth of that in N, and has to be nearer
    for unit, newtons, off in (
        ("kN", 1e3, 2.5),
        ("kgf", STANDARD_GRAVITY, 1.25),
    ):
        if 1.0 / off <= part * newtons <= off:
            return unit
    return None


def _mass_unit(part: float) -> str | None:
    """Return the unit in which a mass, such a part of the robot's, would be the robot's."""
    for unit, kilograms in (
        ("N, as a weight", 1.0 / STANDARD_GRAVITY),
        ("lb", scene_number("usual", "pound")),
    ):
        if abs(part * kilograms - 1.0) <= SCENE_SETTINGS.unit_factor:
            return unit
    return None


def _load(question: Question) -> Iterator[Finding]:
    load, robot = question.load, question.stance.robot
    farthest = 2.0 * robot.reach  # of a centre of mass [m]
    if load.mass is not None:
        part = load.mass / robot.mass
        if unit := _mass_unit(part):
            message = f"{load.mass:.4g} kg are {part:.3g} times the robot's {robot.mass:.4g} kg"
            message += f": is it in kg, or in {unit}?"
            yield unit_finding("load.mass", message, load.mass, "kg")
        if not SCENE_SETTINGS.in_thousands < part < SCENE_SETTINGS.in_thousandths:
            yield _odd_mass("load.mass", load.mass, robot)
    if load.com is not None:
        away = math.hypot(*load.com)
        if away > farthest:
            message = (
                f"it is {away:.3g} m from the body's origin, and limbs reach {robot.reach:.2g} m: "
                "is it in m, in B?"
            )
            yield unit_finding("load.com", message, away, "m")
    for i, payload in enumerate(load.payloads):
        field, part = f"load.payloads[{i}]", payload.mass / robot.mass
        # 10 kg in g are far more than five robots
        if part > 5.0 or part < SCENE_SETTINGS.least_payload:
            yield _odd_mass(f"{field}.mass", payload.mass, robot)
        away = math.hypot(*payload.com)
        if away > farthest:
            message = (
                f"it is {away:.3g} m from the origin of what carries it, and limbs reach "
                f"{robot.reach:.2g} m: is it in m, in that frame?"
            )
            yield unit_finding(f"{field}.com", message, away, "m")
    most = STRONGEST_GRAVITY
    for name, arm, unit in (
        ("acceleration", 1.0, "m/s²"),
        ("angular_acceleration", robot.reach, "rad/s²"),
    ):
        size = math.hypot(*getattr(load, name))
        if size * arm > most:
            message = f"{size:.3g} {unit} is more than a robot is moved with: is it in {unit}?"
            yield unit_finding(f"load.{name}", message, size, unit)


def _odd_mass(field: str, mass: float, robot: Robot) -> Finding:
    """Return the finding of a mass that is far from the robot's."""
    part = mass / robot.mass
    message = (
        f"{mass:.4g} kg are {part:.2g} times what the robot weighs, {robot.mass:.4g} kg: is it in "
        f"kg, or in {'t' if part < 1.0 else 'g'}?"
    )
    return unit_finding(field, message, mass, "kg")


def _gravity(stance: Stance) -> Iterator[Finding]:
    size, most = float(np.linalg.norm(stance.gravity)), STRONGEST_GRAVITY
    if abs(size - 1.0) <= 0.02:  # [m/s²]: in g, all but 1
        message = f"it is {size:.3g} m/s², as on no body that is climbed: is it in m/s², or in g?"
        yield unit_finding("stance.gravity", message, size, "m/s²")
    elif size > most:
        message = f"{size:.4g} m/s² is more than on any planet: is it in m/s²?"
        yield unit_finding("stance.gravity", message, size, "m/s²")


def robot_findings(robot: Robot) -> Iterator[Finding]:
    """Yield what is odd about a robot's own numbers, which are then no measure of others."""
    field, hand = "stance.robot", robot.hand
    stone = scene_number("usual", "rock_density") * 4.0 / 3.0 * math.pi * robot.reach**3
    links = robot.mass - len(robot.limbs) * hand.mass
    # shorter or longer limbs, in palms, are no climber's
    if not 0.2 * hand.palm_length <= robot.reach <= 100.0 * hand.palm_length:
        message = (
            f"the robot's limbs reach {robot.reach:.3g} m, and a palm is {hand.palm_length:.2g} m "
            "long: are the lengths of its URDF in m?"
        )
        yield unit_finding(field, message, robot.reach, "m")
    elif robot.mass > stone:
        message = (
            f"the robot weighs {robot.mass:.6g} kg, more than a ball of rock as far as its limbs "
            f"reach, {robot.reach:.2g} m: are the masses of its URDF in kg?"
        )
        yield unit_finding(field, message, robot.mass, "kg")
    elif links < 0.2 * hand.mass:
        message = (
            f"the robot's links weigh {links:.3g} kg together, one hand {hand.mass:.3g} kg: are "
            "the masses of its URDF in kg?"
        )
        yield unit_finding(field, message, links, "kg")


# What holds ---------------------------------------------------------------------------------------


def _surfaces(stance: Stance) -> Iterator[Finding]:
    weakest, strongest = preset_strengths()
    for i, hand in enumerate(stance.hands):
        strength = hand.surface.shear_limit
        # a hand's pull-off is five times the strongest preset's
        if 0.01 * weakest < strength < 4.0 * strongest:
            continue
        slip = "of a tile, or of a whole hand" if strength > strongest else "in N"
        message = (
            f"a tile is taken to hold {strength:.4g} N in shear, the presets have "
            f"{weakest:.3g} to {strongest:.3g} N: is it {slip}?"
        )
        field = f"stance.hands[{i}].surface.shear_limit"
        yield unit_finding(field, message, strength, "N", hand.limb)


def _holds(stance: Stance) -> Iterator[Finding]:
    most = SCENE_SETTINGS.widest * stance.robot.reach
    for i, hand in enumerate(stance.hands):
        for name, size in hand.hold.largest_sizes.items():
            if size > most:
                message = (
                    f"the hold's {name} is {size:.3g} m, and limbs reach "
                    f"{stance.robot.reach:.2g} m: is it in m?"
                )
                field = f"stance.hands[{i}].hold.{name}"
                yield unit_finding(field, message, size, "m", hand.limb)


# What is carried ----------------------------------------------------------------------------------


def _tensions(question: Question) -> Iterator[Finding]:
    stance = question.stance
    most, closing = stance.robot.hand.maximum_tension, stance.robot.hand.closing_tension
    nothing = 0.01  # of what tendons hold or close with
    cap = question.limits.tendon_tension
    if cap is not None and cap < nothing * most:
        message = f"{cap:.3g} N is next to nothing of the {most:.4g} N that a tendon holds"
        yield unit_finding("limits.tendon_tension", f"{message}: is it in N?", cap, "N")
    for name in ("hold_margin", "palm_margin", "least_tension"):
        least = getattr(question.limits, name) or 0.0
        if 0.0 < least < SCENE_SETTINGS.in_thousands * closing:
            message = f"{least:.3g} N is next to nothing of the {closing:.3g} N that tendons close"
            yield unit_finding(
                f"limits.{name}", f"{message} with: is it in N, or in kN?", least, "N"
            )
    given = [(f"present.{limb}", each) for limb, each in question.present.items()]
    for i, hand in enumerate(stance.hands):
        tension = hand.grasp.closing_tension
        if hand.tendon_preload is not None:
            given.append((f"stance.hands[{i}].tendon_preload", hand.tendon_preload))
        if tension is not None and force_unit(tension / closing) == "kgf":
            message = (
                f"it closes with {tension:.4g} N, hands do with {closing:.3g} N: is "
                "it in N, or in kgf?"
            )
            field = f"stance.hands[{i}].grasp.closing_tension"
            yield unit_finding(field, message, tension, "N", hand.limb)
    for field, tensions in given:
        largest = float(np.max(tensions))
        if largest > 2.0 * most or 0.0 < largest < nothing * closing:
            message = (
                f"the largest is {largest:.4g} N, tendons hold {most:.4g} N and close with "
                f"{closing:.3g} N: are they in N?"
            )
            yield unit_finding(field, message, largest, "N")


def _caps(question: Question) -> Iterator[Finding]:
    held = question.stance.robot.hand.structure.hand_load
    for limb, cap in question.limits.per_hand.items():
        given = cap.most
        ends = (
            [given] if isinstance(given, float | int) else [end for pair in given for end in pair]
        )
        least = min(abs(end) for end in ends if end)
        if least < SCENE_SETTINGS.in_thousands * held:
            message = (
                f"{least:.3g} N is next to nothing of the {held:.3g} N that a hand holds: "
                "is it in N?"
            )
            yield unit_finding(f"limits.per_hand.{limb}.largest_force", message, least, "N", limb)


def _hand_wrenches(stance: Stance) -> Iterator[Finding]:
    held = stance.robot.hand.structure.hand_load
    for i, hand in enumerate(stance.hands):
        force = max((abs(each) for each in (hand.wrench or ())[:3] if each), default=0.0)
        if 0.0 < force < SCENE_SETTINGS.in_thousands * held:
            message = (
                f"the largest force that it is to exert is {force:.3g} N, and a hand holds "
                f"{held:.3g} N: is it in N, or in kN?"
            )
            yield unit_finding(f"stance.hands[{i}].wrench", message, force, "N", hand.limb)


def _joints(question: Question) -> Iterator[Finding]:
    stance, own = question.stance, question.limits.joint_torque
    if stance.joints is None:
        return
    robot, reported = stance.robot, set()
    usual = robot.mass * STANDARD_GRAVITY * robot.reach
    for limb, chain in robot.chains.items():
        given = own.get(limb) if isinstance(own, Mapping) else own
        most = _largest(chain.torque_limits if given is None else given, chain.sliding)
        # a strongest joint outside these is no robot's of that weight
        if most is None or 1e-3 * usual <= most <= 50.0 * usual:
            continue
        field = "stance.robot"
        if given is not None:
            field = "limits.joint_torque" + (f".{limb}" if isinstance(own, Mapping) else "")
        if field not in reported:
            reported.add(field)
            message = (
                f"its strongest joint is to bear {most:.4g} N·m, and the robot's weight on "
                f"the Earth at its reach turns with {usual:.3g} N·m: is it in N·m?"
            )
            yield unit_finding(field, message, most, "N·m", limb)


def _largest(limits: float | Sequence[float] | Array, sliding: Iterable[bool]) -> float | None:
    """Return the most that a joint which turns bears; None where none does."""
    which = ~np.asarray(sliding)
    values = np.broadcast_to(np.asarray(limits, dtype=float), which.shape)[which]
    return float(values.max()) if len(values) else None
