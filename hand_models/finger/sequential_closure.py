"""A finger laid on rock, phalanx by phalanx from the base.

A finger has three joints, so three conditions determine its posture. Each phalanx turns until its
face meets the rock; with all three on the rock this is the paper's closing (Section 5.1).
`hand_models.finger.closing` finds the other ways in which a finger can end its closing.

`SequentialClosure` is `settle_finger` for fingers whose phalanges all rest on the faces of their
tiles, as most fingers on smooth rock do: each phalanx has met the rock and holds there, so the
finger is at the end of its path. Fingers that end their closing otherwise are left to the others.
"""

from __future__ import annotations

import cmath
import math
from typing import Final, NamedTuple

from hand_models.finger.model import FingerModel
from hand_models.finger.phalanx_shape import PhalanxShape, middle_of_bed
from hand_models.finger.settled_finger import Contact, SettledFinger
from hand_models.sections import Face, Rest, Section, Vector2

__all__ = ["CONTACT_KINDS", "ClosedPhalanx", "SequentialClosure", "settle_finger"]

CONTACT_KINDS: Final = ("face", "edge", "frame", "none")
"""Contact states of a phalanx by integer code: the part that touches the rock."""


class ClosedPhalanx(NamedTuple):
    """Pose and contact of a phalanx on the rock, in its finger's frame F.

    Attributes
    ----------
    angle : float
        θ, angle of the phalanx from x toward z [rad].
    u : complex
        Unit vector x + i z along the phalanx.
    joint : complex
        x + i z of the joint [m].
    along : float
        c, distance of the contact from the joint along the phalanx [m].
    bends : tuple of float
        Curvature of the rock under the face, toward its beginning and its end [1/m].
    """

    angle: float
    u: complex
    joint: complex
    along: float
    bends: tuple[float, float] = (0.0, 0.0)

    def pressed(self, face: Face, depth: float) -> ClosedPhalanx:
        """Return the phalanx with its contact at the centre of pressure of the tile's bed.

        The contact moves where an end of the tile cuts the bed's pressure short (`middle_of_bed`).

        Parameters
        ----------
        face : Face
            Face of the tile.
        depth : float
            Depth to which the bed of springs is pressed in [m].
        """
        near, far = (
            min(end, math.sqrt(2.0 * depth / bend) if bend > 0.0 else math.inf)
            for end, bend in zip(
                (self.along - face.start, face.end - self.along), self.bends, strict=True
            )
        )
        return self._replace(along=self.along + middle_of_bed((near, far), self.bends, depth))


class SequentialClosure:
    """Solver that lays fingers of one model on smooth rock, phalanx by phalanx.

    Parameters
    ----------
    model : FingerModel
        Numbers of the fingers.
    """

    def __init__(self, model: FingerModel) -> None:
        near, far = model.tile_range
        self._spacing, self._centre = model.joint_spacing, model.tile_centre
        self.tile = Face(near, far, model.tile_height)
        level = PhalanxShape.of(model).fine
        self._face = Face(near, model.joint_spacing, model.tile_height, level)
        self._joints = [
            (lower, cmath.rect(1.0, lower), upper - lower)
            for lower, upper in zip(model.joint_lower, model.joint_upper, strict=True)
        ]

    def lay(self, cut: Section) -> list[ClosedPhalanx]:
        """Close a finger on smooth rock, with its proximal joint at the origin of F.

        Parameters
        ----------
        cut : Section
            Rock in the finger's plane.

        Returns
        -------
        list of ClosedPhalanx
            Phalanges from the base outward, up to the first that does not rest on its tile's face:
            three for a finger that is laid, none where the section is `Section.skew`.
        """
        laid: list[ClosedPhalanx] = []
        joint, angle, u = 0j, 0.0, 1.0 + 0j
        if cut.skew:
            return laid
        for lower, opened, span in self._joints:
            low = u * opened
            if not cut.clear(joint, low, self._face):
                break
            rest = cut.turned(joint, self._face, low, span)
            if rest is None:
                break
            turn, u, along, flat = rest
            angle += lower + turn
            bends = (0.0, 0.0)
            if flat:
                along = self._centre
            else:
                if not self.tile.start < along < self.tile.end:
                    # on an edge of the tile or beyond it
                    break
                bends = self._bends(cut, joint, u, along)
            laid.append(ClosedPhalanx(angle, u, joint, along, bends))
            joint += self._spacing * u
        return laid

    def _bends(self, cut: Section, joint: complex, u: complex, along: float) -> tuple[float, float]:
        """Return the rock's curvature from a contact toward both ends of the tile."""
        ends = self.tile.start, self.tile.end
        places = (joint + complex(end, self.tile.height) * u for end in ends)
        # on a circle of radius R the distance is √(R² + e²) − R
        near, far = (
            2.0 * gap / (away * away - gap * gap) if away > gap > 0.0 else 0.0
            for gap, away in zip(
                map(cut.distance, places), (along - ends[0], ends[1] - along), strict=True
            )
        )
        return near, far


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
