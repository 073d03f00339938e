"""The check that every plan passes before it leaves: from its numbers back to the rock.

Nothing here is shared with the way the plan was found. Tile loads are recomputed from the tensions
by solving the full equilibrium of Eq. 6 (joint rows and tile rows, forces in the finger's frame),
not by the affine maps of Eq. 14, motors and winches from those; wrenches are summed force by force;
limits are Eq. 21 itself, the plan's half-planes and the structure's published figures; balance is
added up in the body frame. What is different where a wrist floats is in `verify_floating`, what
joints and callers ask in `verify_limbs`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from hand_models.finger import SettledFinger
from hand_models.frames import Array
from hand_models.hand import FINGERS, NAIL, SettledHand
from hand_models.structure import HELD
from planner.plan import FingerPlan, HandPlan, TileLoad
from planner.posture import Posture
from planner.question import Question
from planner.stance import HandOnHold
from planner.verify_floating import check_finger, check_palm
from planner.verify_limbs import check_asked, check_limbs, force_use

__all__ = ["BALANCE", "LOAD", "UTILISATION", "equilibrium", "problems"]

BALANCE: Final = 1e-6
"""Largest error of the balance, relative to the body wrench (moments over a metre)."""

LOAD: Final = 1e-6
"""Largest disagreement of a tile's load, relative to the largest load of its hand."""

STOP_SIDES: Final = {"upper": 1.0, "lower": -1.0, "balance": 0.0, None: 0.0}
"""Which way a joint presses on the limit at which it stands: closing, opening."""

STOP: Final = 1e-6
"""How much torque a joint's stop may seem to pull, by rounding [N·m]."""

UTILISATION: Final = 1e-6
"""How far a utilisation may be from what the plan says."""

EFFORT: Final = 1e-6
"""How far the effort may be from what the plan says, relative."""

DRIVE: Final = 1e-9
"""How far a motor's torque, current or winch angle may be from what the plan says, relative."""


def equilibrium(
    finger: SettledFinger, tension: float, closing_tension: float, base_tile: bool
) -> tuple[Array, Array, Array]:
    """Solve A f_c = b (Eqs. 6–8) for the contact forces of one finger at one tension.

    Parameters
    ----------
    finger : SettledFinger
    tension, closing_tension : float
        [N]
    base_tile : bool
        Whether a base tile comes before the phalanges on the tendon.

    Returns
    -------
    shear, normal : ndarray, shape (3,)
        Tile loads on the rock, in each phalanx's frame [N].
    stop : ndarray, shape (3,)
        Torque with which each joint presses on the limit at which it stands, zero where it is free
        [N·m].
    """
    model = finger.model
    count = len(finger.contacts)
    angles = np.cumsum(finger.joint_angles)
    joints = [np.zeros(2)]
    for angle in angles:
        step = model.joint_spacing * np.array([math.cos(angle), math.sin(angle)])
        joints.append(joints[-1] + step)
    A = np.zeros((2 * count, 2 * count))
    b = np.zeros(2 * count)
    bearing = [contact.kind != "none" for contact in finger.contacts]
    side = np.array([STOP_SIDES[contact.stop] for contact in finger.contacts])
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    into = np.column_stack([-along[:, 1], along[:, 0]])
    loss = 1.0 - model.friction
    local, closing = (v * loss if base_tile else v for v in (tension, closing_tension))
    for i in range(count):
        # joint row: a force (fx, fz) of the rock on tile j turns joint i from x toward z (J^T f_c)
        for j in range(i, count):
            if bearing[j]:
                contact = joints[j] + finger.contacts[j].along * along[j]
                arm = contact + model.tile_height * into[j] - joints[i]
                A[2 * i, 2 * j : 2 * j + 2] = (-arm[1], arm[0])
        b[2 * i] = (
            model.joint_stiffness[i] * finger.joint_angles[i]
            + model.joint_preload[i]
            - local * model.pulley_radii[i]
        )
        # tile row: the rock's force on the tile along +x of its phalanx is the shear; a bare frame
        # only presses
        A[2 * i + 1, 2 * i : 2 * i + 2] = along[i]
        if finger.contacts[i].kind in ("face", "edge"):
            b[2 * i + 1] = model.engagement[i] * closing + model.shear_gain * (local - closing)
        local, closing = local * loss, closing * loss
    forces = np.zeros(2 * count)
    if any(bearing):
        # rows: joints that are free, tiles that bear; columns: forces on phalanges that bear
        held = [contact.stop is None for contact in finger.contacts]
        rows = np.stack([held, bearing], axis=1).ravel()
        kept = np.repeat(bearing, 2)
        forces[kept] = np.linalg.solve(A[np.ix_(rows, kept)], b[rows])
    stop = side * (A @ forces - b)[::2]
    pairs = forces.reshape(count, 2)
    return (pairs * along).sum(axis=1), -(pairs * into).sum(axis=1), stop


def problems(
    question: Question,
    settled: Sequence[SettledHand],
    hands: Sequence[HandPlan],
    utilisation: float,
    body_wrench: Array,
    where: Posture | None = None,
    effort: float | None = None,
) -> list[str]:
    """Return what is wrong with a plan, each in a sentence; nothing if it may leave.

    Parameters
    ----------
    question : Question
    settled : sequence of SettledHand
        The hands on their holds.
    hands : sequence of HandPlan
        The plan's numbers.
    utilisation : float
        The plan's.
    body_wrench : ndarray, shape (6,)
        The one planned for, in B.
    where : Posture, optional
        The joints; None if the question says nothing of them.
    effort : float, optional
        The plan's.
    """
    found: list[str] = []
    total = np.zeros(6)
    limbs = check_limbs(found, question, hands, body_wrench, where)
    worst = max(limbs.utilisation.values(), default=0.0)
    relative = 0.0
    into_body = question.stance.body.rotation.T
    for place, hand, plan in zip(question.stance.hands, settled, hands, strict=True):
        bears = limbs.utilisation.get(place.limb, 0.0)
        worst = max(worst, _check_hand(found, question, place, hand, plan, bears))
        relative += limbs.effort.get(place.limb, 0.0)
        relative += sum((f.tendon_tension / _strength(question, hand)) ** 2 for f in plan.fingers)
        # carried to B by hand: the rock's reaction at the hand's place
        force = into_body @ place.pose.rotation @ -plan.wrench[:3]
        moment = into_body @ place.pose.rotation @ -plan.wrench[3:]
        lever = into_body @ (place.pose.position - question.stance.body.position)
        total += np.concatenate([force, moment + np.cross(lever, force)])
    error = float(np.linalg.norm(total - body_wrench))
    allowed = BALANCE * max(float(np.linalg.norm(body_wrench)), 1.0)
    if not error <= allowed:
        found.append(f"balance is off by {error:.3g} of {np.linalg.norm(body_wrench):.3g}")
    _compare(found, "plan", worst, utilisation)
    if effort is not None and not abs(relative - effort) <= EFFORT * max(1.0, relative):
        found.append(f"plan: effort is {relative:.8g}, not {effort:.8g}")
    return found


def _check_hand(
    found: list[str],
    question: Question,
    place: HandOnHold,
    hand: SettledHand,
    plan: HandPlan,
    bears: float,
) -> float:
    """Check one hand, whose joints use so much; return its utilisation as recomputed."""
    limb = plan.limb
    loads = [abs(v) for f in plan.fingers for t in f.tiles for v in (t.shear, t.normal, t.lateral)]
    allowed = LOAD * max(1.0, *loads, *np.abs(plan.palm.force).tolist())
    maximum = _strength(question, hand)
    worst = max(bears, force_use(found, question, place, plan, allowed))
    check_asked(found, question, place, plan, allowed)
    wrench = np.zeros(6)
    if (place.wrist == "floating") != (plan.wrist is not None):
        found.append(f"{limb}: the wrist is not {place.wrist}")
    for i, (finger, planned) in enumerate(zip(hand.fingers, plan.fingers, strict=True)):
        tension = planned.tendon_tension
        if not (math.isfinite(tension) and tension >= -allowed):
            found.append(f"{limb}: tension of {planned.name} is {tension:g} N")
            continue
        worst = max(worst, tension / maximum)
        wound = tension
        if plan.wrist is not None:
            wound = (
                hand.closing_tension if place.tendon_preload is None else place.tendon_preload[i]
            )
        shear, normal, stop = _at_tension(hand, finger, planned, float(wound))
        at_rest = shear
        if plan.wrist is not None:
            check = check_finger(hand, planned, plan.wrist, wound, at_rest)
            shear, normal, stop = check.shear, check.normal, check.stop
            found.extend(f"{limb}: {planned.name}: {sentence}" for sentence in check.wrong)
            off = np.abs(check.lateral - [tile.lateral for tile in planned.tiles]).max()
            if not max(float(off), abs(check.tension - tension)) <= allowed:
                found.append(f"{limb}: {planned.name} does not hold what the plan says")
        if finger.bearing and stop.min() < -STOP:
            found.append(f"{limb}: a joint of {planned.name} would leave its stop")
        hooked = planned.tiles[-1].contact == NAIL
        if (
            plan.wrist is None
            and hand.hand.finger.friction > 0.0
            and (any(finger.touching) or hooked)
        ):
            slack = hand.closing_tension - tension
            if slack > allowed:
                found.append(
                    f"{limb}: tendon of {planned.name} would stick, slackened {slack:.3g} N"
                )
        drawn = (wound, at_rest)
        worst = max(worst, _check_drive(found, hand, planned, finger, drawn, limb))
        worst = max(worst, float(shear.sum()) / hand.hand.structure.finger_shear)
        worst = max(worst, float(normal[-1]) / hand.hand.structure.fingertip_force)
        tiles = [tile for tile in planned.tiles if tile.phalanx != NAIL]
        for nail in planned.tiles[len(tiles) :]:
            worst = max(worst, _check_nail(found, hand, planned, nail, limb, allowed))
            wrench += np.concatenate([nail.force, np.cross(nail.position, nail.force)])
        for tile, t, n in zip(tiles, shear, normal, strict=True):
            name = f"{limb}: {tile.phalanx} tile of {planned.name}"
            off = max(abs(tile.shear - t), abs(tile.normal - n))
            if not off <= allowed:
                found.append(f"{name} carries {t:.6g}, {n:.6g} N, not what the plan says")
            if t < -allowed:
                found.append(f"{name} would be dragged backwards with {-t:.3g} N")
            _check_force(found, name, tile, allowed)
            wrench += np.concatenate([tile.force, np.cross(tile.position, tile.force)])
            touches = tile.contact in ("face", "edge")
            if not touches and n < -allowed:
                found.append(f"{name}: its bare frame would be pulled off with {-n:.3g} N")
            used = _tile_utilisation(tile, t, n) if touches else 0.0
            worst = max(worst, used)
            _compare(found, name, used, tile.utilisation)
            if touches and used <= 1.0 and not _inside_curve(hand, tile, t, n, allowed):
                found.append(f"{name} is beyond its limit curve")
    if plan.wrist is not None:
        found.extend(check_palm(hand, plan, plan.wrist, allowed))
    pressed = _check_palm(found, hand, plan, allowed)
    _compare(found, f"{limb}: palm", pressed, plan.palm.utilisation)
    worst = max(worst, pressed)
    force = plan.palm.force
    wrench += np.concatenate([force, plan.palm.moment + np.cross(plan.palm.position, force)])
    if not np.abs(wrench - plan.wrench).max() <= allowed:
        found.append(f"{limb}: the wrench is not the sum of its tiles' and palm's forces")
    worst = max(worst, _check_held(found, hand, plan, allowed))
    _compare(found, limb, worst, plan.utilisation)
    return worst


def _strength(question: Question, hand: SettledHand) -> float:
    """Return the largest tension that a hand's tendons may hold [N]."""
    cap, most = question.limits.tendon_tension, hand.hand.maximum_tension
    return most if cap is None else min(most, cap)


def _at_tension(
    hand: SettledHand, finger: SettledFinger, planned: FingerPlan, tension: float
) -> tuple[Array, Array, Array]:
    """Return shears and normals of all tiles of a finger, and stops, with its wrist at rest."""
    outer = planned.name.startswith("outer")
    shear, normal, stop = equilibrium(finger, tension, hand.closing_tension, outer)
    if outer:
        model = hand.hand.finger
        drag = model.base_engagement * hand.closing_tension
        drag += model.shear_gain * (tension - hand.closing_tension)
        shear = np.append(drag if planned.tiles[0].contact != "none" else 0.0, shear)
        normal = np.append(0.0, normal)
    return shear, normal, stop


def _check_force(found: list[str], name: str, tile: TileLoad, allowed: float) -> None:
    """Check that a force is the sum of its loads, and that something is there to bear it."""
    force = (
        tile.shear * tile.shear_axis
        + tile.normal * tile.normal_axis
        + tile.lateral * tile.lateral_axis
    )
    if not np.abs(force - tile.force).max() <= allowed:
        found.append(f"{name}: force and loads disagree")
    if tile.contact == "none" and np.abs(tile.force).max() > 0.0:
        found.append(f"{name} carries a load but touches nothing")


def _check_drive(
    found: list[str],
    hand: SettledHand,
    planned: FingerPlan,
    finger: SettledFinger,
    wound: tuple[float, Array],
    limb: str,
) -> float:
    """Check one finger's motor and winch; return the utilisation of the motor.

    ``wound``: the tension to which its winch has drawn the tendon, and the tiles' shears then.

    A tile has slid so far that its spring and the rock's shear balance the tendon's two strands
    (Eq. 5), and the tendon drawn in is that of all joints and tiles, on the winch.
    """
    drive = hand.hand.drive
    tension = planned.tendon_tension
    torque = tension * drive.winch_radius / drive.gear_ratio / drive.efficiency
    current = drive.no_load_current + torque / drive.torque_constant
    drawn = hand.hand.nail.pulley_radius * _nail_angle(hand, planned)
    for radius, angle in zip(finger.model.pulley_radii, finger.joint_angles, strict=True):
        drawn += radius * angle
    local, shear = wound
    for drag in shear:
        drawn += drive.pulley_ratio * (drive.pulley_ratio * local - drag) / drive.tile_stiffness
        local *= 1.0 - finger.model.friction
    for name, value, said in (
        ("motor torque", torque, planned.motor_torque),
        ("motor current", current, planned.motor_current),
        ("winch angle", drawn / drive.winch_radius, planned.winch_angle),
    ):
        if not abs(value - said) <= DRIVE * max(1.0, abs(value)):
            found.append(f"{limb}: {name} of {planned.name} is {value:.8g}, not {said:.8g}")
    return max(torque / drive.maximum_torque, current / drive.maximum_current)


def _nail_arm(hand: SettledHand, planned: FingerPlan, place: Array) -> tuple[float, float]:
    """Return where a place is from a straight finger's nail pin, in (x, z) of the finger."""
    frame = hand.hand.frames(hand.grasp.outer_rotation)[FINGERS.index(planned.name)]
    model = hand.hand.finger
    arm = place - frame.joint - len(model.pulley_radii) * model.joint_spacing * frame.along
    return float(arm @ frame.along), float(arm[2])


def _nail_angle(hand: SettledHand, planned: FingerPlan) -> float:
    nail = planned.tiles[-1]
    if nail.contact != NAIL:
        return hand.hand.nail.retraction
    x, z = _nail_arm(hand, planned, nail.position)
    return math.atan2(z, x)


def _check_nail(
    found: list[str],
    hand: SettledHand,
    planned: FingerPlan,
    tile: TileLoad,
    limb: str,
    allowed: float,
) -> float:
    """Check a nail: balance about its pin and the joints, friction; return its utilisation."""
    name = f"{limb}: nail of {planned.name}"
    _check_force(found, name, tile, allowed)
    if tile.contact != NAIL:
        return 0.0
    index = FINGERS.index(planned.name)
    frame, nail = hand.hand.frames(hand.grasp.outer_rotation)[index], hand.hand.nail
    model, structure = hand.hand.finger, hand.hand.structure
    x, z = _nail_arm(hand, planned, tile.position)
    along, into = float(tile.force @ frame.along), float(tile.force[2])
    local = planned.tendon_tension
    if planned.name.startswith("outer"):
        local *= 1.0 - model.friction
    # about the joints from the base outward, then about the nail's pin
    for i, (radius, preload) in enumerate(
        zip(model.pulley_radii, model.joint_preload, strict=True)
    ):
        far = (len(model.pulley_radii) - i) * model.joint_spacing
        closing = local * radius - preload - ((far + x) * into - z * along)
        if closing > allowed * far:
            found.append(f"{name} lets joint {i + 1} of its finger close, by {closing:.3g} N·m")
        local *= 1.0 - model.friction
    held = nail.preload + nail.stiffness * math.atan2(z, x)
    turning = local * nail.pulley_radius - held - (x * into - z * along)
    if not abs(turning) <= allowed * math.hypot(x, z):
        found.append(f"{name} is out of balance by {turning:.3g} N·m")
    pressed = -float(tile.force @ hand.nail_normals[index])
    dragged = float(np.linalg.norm(tile.force + pressed * hand.nail_normals[index]))
    if pressed < -allowed or dragged > nail.friction * pressed + allowed:
        found.append(f"{name} would slip: {dragged:.3g} N along rock pressed with {pressed:.3g} N")
    used = max(-along / structure.finger_shear, into / structure.fingertip_force)
    _compare(found, name, used, tile.utilisation)
    return used


def _check_held(found: list[str], hand: SettledHand, plan: HandPlan, allowed: float) -> float:
    """Check what one hand holds; return its utilisation.

    That of its rows must be no less than that of the force itself: across the rock and away from
    it, without what presses.
    """
    most = hand.hand.structure.hand_load
    force = plan.wrench[:3]
    used = float((HELD @ force).max()) / most
    held = math.hypot(force[0], force[1], min(force[2], 0.0))
    if not held <= used * most + allowed:
        found.append(f"{plan.limb}: the hand holds {held:.6g} N, more than its rows say")
    return used


def _compare(found: list[str], name: str, utilisation: float, planned: float) -> None:
    utilisation = max(utilisation, 0.0)
    if not abs(utilisation - planned) <= UTILISATION * max(1.0, utilisation):
        found.append(f"{name}: utilisation is {utilisation:.8g}, not {planned:.8g}")


def _tile_utilisation(tile: TileLoad, shear: float, normal: float) -> float:
    return max(
        (piece.a_shear * shear + piece.a_normal * normal + piece.a_lateral * abs(tile.lateral))
        / piece.capacity
        for piece in tile.half_planes
    )


def _inside_curve(
    hand: SettledHand, tile: TileLoad, shear: float, normal: float, allowed: float
) -> bool:
    """Whether a tile's load is inside the limit surface itself, not only its half-planes."""
    if shear < -allowed:
        return False
    along = math.hypot(shear, tile.lateral)
    angle, azimuth = math.atan2(-normal, along), math.atan2(abs(tile.lateral), shear)
    strength = float(hand.surface.strength(angle, azimuth))
    return math.hypot(along, normal) <= strength * (1.0 + UTILISATION) + allowed


def _check_palm(found: list[str], hand: SettledHand, plan: HandPlan, allowed: float) -> float:
    x, y, z = (float(v) for v in plan.palm.force)
    if x > allowed or abs(y) > 0.0 or z < -allowed:
        found.append(f"{plan.limb}: the palm cannot exert {plan.palm.force.tolist()} N")
    if not plan.palm.engaged:
        if np.abs(plan.palm.force).max() > 0.0:
            found.append(f"{plan.limb}: the palm carries a load but touches nothing")
        return 0.0
    return max(-x / hand.palm.shear_limit, z / hand.palm.pressing_limit)
