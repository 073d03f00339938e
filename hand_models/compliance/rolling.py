"""Posture of a finger whose base moves a little: the finger rolls on the rock where it touches.

A settled finger's contacts are kept, and the rock near each of them is approximated by the circle
that fits it (a straight line where rock is flat or hollow). A phalanx whose face touches rolls on
that circle; one that touches with an edge of its tile, or lies flat, slides with that point. Both
have a closed form, so that thousands of poses of the base are solved at once.

A face touches the circle where it is tangent to it, at c⁰. Its force acts at the centre of pressure
of the tile's bed of springs (`hand_models.finger.phalanx_gaps`), which an end of the tile may cut
short: as c⁰ rolls, the centre of pressure goes with it, but never beyond the tile.

With the base displaced by (x, z) in the coordinates F of the settled finger and turned by ψ from x
toward z, phalanx i slips along the rock by

    δx_i = δc⁰_i − δs_i,

positive toward the finger's base, with c⁰ its contact from the joint and s the arc length of the
contact on the rock; its tile, anchored in the rock, makes up for the slip (Section 5.3).

All functions here also take complex numbers, so that derivatives are found by complex steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array
from hand_models.compliance.link import FingerLink, Numbers, bearing_angle, links_of, turned, unit
from hand_models.finger import PHALANGES, SettledFinger
from hand_models.sections import Section

__all__ = ["MovedPosture", "RollingContact"]


class MovedPosture(NamedTuple):
    """Postures of F fingers after m displacements of their bases, shapes (F, 3, m) or (F, 3, 2, m).

    Attributes
    ----------
    angles : ndarray
        θ, angle of each phalanx from x toward z of F [rad].
    turns : ndarray
        δq, change of each joint's angle, closing [rad].
    slips : ndarray
        δx of each phalanx along the rock, toward the base; 0 without contact [m].
    joints, points : ndarray
        (x, z) in F of each joint and of each contact [m].
    directions : ndarray
        Unit vector (x, z) along each phalanx, turned by its contact's ``tilt``.
    reached : ndarray of bool, shape (F, m)
        Whether every phalanx with a contact still meets rock.
    """

    angles: Numbers
    turns: Numbers
    slips: Numbers
    joints: Numbers
    points: Numbers
    directions: Numbers
    reached: NDArray[np.bool_]


class RollingContact:
    """F settled fingers as functions from displacements of their bases to postures.

    Parameters
    ----------
    fingers : sequence of SettledFinger, length F
        Fingers at rest, each with its proximal joint at the origin of its finger frame F.
    sections : sequence of Section or None, length F
        Rock in each finger's plane, in its frame F; None if there is none.
    depths : array_like, shape (F, 3), optional
        Depth to which tiles are pressed into their beds of springs [m]; zero by default.
    """

    def __init__(
        self,
        fingers: Sequence[SettledFinger],
        sections: Sequence[Section | None],
        depths: ArrayLike = 0.0,
    ) -> None:
        pressed = np.broadcast_to(np.asarray(depths), (len(fingers), len(PHALANGES)))
        each = [links_of(*own) for own in zip(fingers, sections, pressed.tolist(), strict=True)]

        def of_contacts(name: str) -> Array:
            return np.array([[getattr(c, name) for c in f.contacts] for f in fingers])[..., None]

        links = (
            FingerLink(*(np.array(column)[..., None] for column in zip(*own, strict=True)))
            for own in zip(*each, strict=True)
        )
        joints = of_contacts("joint")
        self._links = [link.settled(joints[:, i]) for i, link in enumerate(links)]
        self._angles = of_contacts("angle")
        self._rest, self._tilt = unit(self._angles), unit(of_contacts("tilt"))
        heights = np.array([finger.model.tile_height for finger in fingers])[:, None, None]
        self._contact = np.stack([of_contacts("along"), heights + of_contacts("rise")], axis=2)
        self._spacing = np.array([finger.model.joint_spacing for finger in fingers])[:, None, None]

    def move(self, x: Numbers, z: Numbers, turn: Numbers) -> MovedPosture:
        """Return the postures of the fingers after m displacements of their bases.

        Parameters
        ----------
        x, z : ndarray, shape (F, m)
            Displacement of the proximal joint in the finger frame F [m].
        turn : ndarray, shape (F, m)
            ψ, rotation of the base from x toward z [rad].
        """
        base = turn + 0.0 * (x + z)
        way = unit(base)
        joint = np.stack([x, z], axis=1) + 0.0 * way
        shape = (len(base), len(PHALANGES), *way.shape[1:])
        joints, ways, along = (np.empty(shape, dtype=base.dtype) for _ in range(3))
        rolled, slips = (np.zeros_like(ways[:, :, 0]) for _ in range(2))
        with np.errstate(invalid="ignore", divide="ignore"):
            for i, link in enumerate(self._links):
                begins = link.bearing >= 0
                own = begins[:, 0].nonzero()[0]
                if len(own):
                    swung, roll, slip = link.turn(joint)
                    way = np.where(begins[:, None], swung, way)
                    bears = own, link.bearing[own, 0]
                    rolled[bears], slips[bears] = roll[own], slip[own]
                joints[:, i], ways[:, i] = joint, way
                along[:, i] = turned(way, self._rest[:, i])
                joint = joint + self._spacing * along[:, i]
            changes = bearing_angle(ways[:, :, 0], ways[:, :, 1])
        contacts = self._contact + rolled[:, :, None] * self._tilt
        return MovedPosture(
            angles=self._angles + changes,
            turns=np.diff(changes, axis=1, prepend=base[:, None]),
            slips=slips,
            joints=joints,
            points=joints + turned(along, contacts),
            directions=turned(along, self._tilt),
            reached=np.isfinite(changes.real).all(axis=1),
        )
