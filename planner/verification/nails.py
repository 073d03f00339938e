"""What the check of a plan says of nails: balance about pin and joints, friction, strength."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS, NAIL
from planner.prepare import CONTACTS, HandBatch
from planner.result import PlanArrays

__all__ = ["check_nails", "nail_angles"]

COUNT: Final = len(FINGERS)


def nail_angles(known: HandBatch, arrays: PlanArrays) -> Array:
    """Return how far each finger's nail has turned, by where it hooks, shape (F,) [rad]."""
    retraction = known.hands[0].hand.nail.retraction
    angles = np.full(len(arrays.tensions), retraction)
    for t in known.places.nails.tolist():
        if known.touch.contacts[t] == CONTACTS[NAIL]:
            x, z = _arm(known, arrays, t)
            angles[known.places.finger[t]] = math.atan2(z, x)
    return angles


def check_nails(
    found: list[str],
    known: HandBatch,
    limbs: tuple[str, ...],
    arrays: PlanArrays,
    allowed: Array,
) -> Array:
    """Check all nails that hook; return the utilisation of each tile that is one, shape (T,).

    Parameters
    ----------
    found : list of str
        What is wrong so far; more is appended.
    known : HandBatch
    limbs : tuple of str
    arrays : PlanArrays
    allowed : ndarray, shape (H,)
        Error of a load of each hand [N].
    """
    used = np.zeros(len(known.touch.contacts))
    for t in known.places.nails.tolist():
        if known.touch.contacts[t] == CONTACTS[NAIL]:
            h = int(known.places.hand[t])
            used[t] = _check_nail(found, known, limbs[h], arrays, t, float(allowed[h]))
    return used


def _arm(known: HandBatch, arrays: PlanArrays, t: int) -> tuple[float, float]:
    """Return where a nail hooks from its pin on the straight finger, in (x, z) of that."""
    hand = known.hands[int(known.places.hand[t])]
    frame = hand.hand.frames(hand.grasp.outer_rotation)[int(known.places.finger[t]) % COUNT]
    model = hand.hand.finger
    arm = arrays.points[t] - frame.joint
    arm = arm - len(model.pulley_radii) * model.joint_spacing * frame.along
    return float(arm @ frame.along), float(arm[2])


def _check_nail(
    found: list[str], known: HandBatch, limb: str, arrays: PlanArrays, t: int, allowed: float
) -> float:
    """Check one nail; return its utilisation."""
    finger = int(known.places.finger[t])
    index, hand = finger % COUNT, known.hands[finger // COUNT]
    name = f"{limb}: nail of {FINGERS[index]}"
    frame, nail = hand.hand.frames(hand.grasp.outer_rotation)[index], hand.hand.nail
    model, structure = hand.hand.finger, hand.hand.structure
    x, z = _arm(known, arrays, t)
    force = arrays.forces[t]
    along, into = float(force @ frame.along), float(force[2])
    local = float(arrays.tensions[finger])
    if FINGERS[index].startswith("outer"):
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
    out = hand.nail_normals[index]
    pressed = -float(force @ out)
    dragged = float(np.linalg.norm(force + pressed * out))
    if pressed < -allowed or dragged > nail.friction * pressed + allowed:
        found.append(f"{name} would slip: {dragged:.3g} N along rock pressed with {pressed:.3g} N")
    return max(-along / structure.finger_shear, into / structure.fingertip_force)
