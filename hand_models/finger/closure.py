"""Posture of a finger that is laid on rock phalanx by phalanx, from the base outward.

A finger has three joints, so three conditions determine its posture. Each phalanx turns until its
face meets the rock; with all three on the rock this is the paper's closing (Section 5.1).
`hand_models.finger.closing` finds the other ways in which a finger can end its closing.
"""

from __future__ import annotations

import cmath

from hand_models.finger.model import FingerModel
from hand_models.finger.settled_finger import Contact, SettledFinger
from hand_models.sections import Face, Rest, Section, Vector2

__all__ = ["settle_finger"]


def settle_finger(model: FingerModel, section: Section | None, joint: Vector2) -> SettledFinger:
    """Return a finger closed on a section of rock, phalanx by phalanx from the base.

    Each phalanx turns until its face meets the rock. Where the face meets rock beyond the tile, the
    spines at the tile's far edge reach across the gap, if it is within their travel; otherwise the
    bare frame rests there and only presses. A face that lies flat has its contact at the tile's
    centre. A phalanx that finds no rock within its joint's range stops at the upper limit, and one
    with rock already in its way at the lower limit.

    Parameters
    ----------
    model : FingerModel
    section : Section or None
        Rock in the finger's plane, in the coordinates (x, z) of F; None if there is none.
    joint : tuple of float
        (x, z) of the proximal joint in F [m].

    Returns
    -------
    SettledFinger
        Contacts of the three phalanges; the tendon's balance is not checked.
    """
    contacts: list[Contact] = []
    before = 0.0
    for lower, upper in zip(model.joint_lower, model.joint_upper, strict=True):
        contact = _lay(model, section, joint, before + lower, before + upper)
        contacts.append(contact)
        before = contact.angle
        joint = contact.end(model.joint_spacing)
    return SettledFinger(model, tuple(contacts))


def _lay(
    model: FingerModel, section: Section | None, joint: Vector2, low: float, high: float
) -> Contact:
    near, _ = model.tile_range
    if section is None:
        return Contact(high, joint, model.tile_centre, "none", "upper")
    face, place = Face(near, model.joint_spacing, model.tile_height), complex(*joint)
    if section.face_clearance(place, cmath.rect(1.0, low), face) <= 0.0:
        return Contact(low, joint, model.tile_centre, "none", "lower")
    rest = section.rest(place, face, low, high)
    if rest is None:
        return Contact(high, joint, model.tile_centre, "none", "upper")
    return _bearing(model, section, rest, joint)


def _bearing(model: FingerModel, section: Section, rest: Rest, joint: Vector2) -> Contact:
    """Return how a phalanx bears that rests on rock at a distance from its joint."""
    near, far = model.tile_range
    if rest.flat:
        return Contact(rest.angle, joint, model.tile_centre, "face")
    if rest.distance <= far:
        kind = "face" if near < rest.distance < far else "edge"
        return Contact(rest.angle, joint, rest.distance, kind)
    edge = Contact(rest.angle, joint, far, "edge")
    if section.clearance(edge.point(model.tile_height)) <= model.spine_travel:
        return edge
    return Contact(rest.angle, joint, rest.distance, "frame")
