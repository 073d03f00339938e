"""Pose of a finger that is laid on rock from its base.

A finger has three joints, so three conditions fix it. Bottom-up, each phalanx turns until its face
meets the rock; with all three on the rock this is the paper's closing (Section 5.1).
`hand_models.finger.closing` finds how a finger comes to other states.
"""

from __future__ import annotations

import cmath

from hand_models.finger.model import Contact, FingerModel, SettledFinger
from hand_models.sections import Face, Rest, Section, Vector2

__all__ = ["settle_finger"]


def settle_finger(model: FingerModel, section: Section | None, joint: Vector2) -> SettledFinger:
    """Close a finger on a section of rock, phalanx by phalanx from the base.

    Each phalanx turns until its face meets the rock. Where it meets it beyond its tile, the spines
    at the tile's far edge reach across the gap, if it is within their travel; otherwise the bare
    frame rests there and only presses. A face that lies flat is held by its tile's centre. A
    phalanx that finds no rock within its joint's range stops at the upper limit, one that has rock
    in its way at the lower one.

    Parameters
    ----------
    model : FingerModel
    section : Section or None
        Rock in the finger's plane, in the coordinates (x, z) of F; None if there is none.
    joint : tuple of float
        The proximal joint in the same coordinates [m].
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
