"""Where fingers can be on rock, many at once: laid on it from the base, or held off it.

Bottom-up, each phalanx turns until its face meets the rock, as with `hand_models.finger.closure`
for a single finger; with all three on the rock this is the paper's closing (Section 5.1). One that
gives way is held at an angle (`swing`). Joints at their limits are in
`hand_models.finger.limit_postures`. In which of these states a finger stays is decided by its loads
(`hand_models.finger.contact_states`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger.closure import CLEAR
from hand_models.finger.model import PHALANGES, Contact, FingerModel, SettledFinger, Stop
from hand_models.finger.sequential_closure import EDGE, FACE, FRAME, KINDS, NONE
from hand_models.sections import Complexes, Flags, SectionRows, Span

__all__ = [
    "BALANCE",
    "FREE",
    "JOINTS",
    "LOWER",
    "STOPS",
    "UPPER",
    "Codes",
    "Postures",
    "are_clear",
    "bear",
    "settle_fingers",
    "swing",
]

JOINTS: Final = len(PHALANGES)

STOPS: Final[tuple[Stop | None, ...]] = (None, "upper", "lower", "balance")
"""What holds a joint that no contact holds, by code; as `Contact.stop`."""

FREE, UPPER, LOWER, BALANCE = range(len(STOPS))

Codes = NDArray[np.int8]

Phalanx = tuple[Array, Array, Codes, Codes]
"""Angle, along, kind and stop of one phalanx of many fingers."""


class Postures(NamedTuple):
    """Fingers in their planes, shapes (3, n): a row for each phalanx, a column for each finger.

    Attributes
    ----------
    angles : ndarray
        θ of each phalanx [rad].
    joints : ndarray of complex
        x + i z of its joint in F; the proximal one is at the origin [m].
    alongs : ndarray
        c, of its contact from the joint [m].
    kinds, stops : ndarray of int8
        Codes of `Contact.kind` and `Contact.stop`.
    """

    angles: Array
    joints: Complexes
    alongs: Array
    kinds: Codes
    stops: Codes

    @classmethod
    def empty(cls, count: int) -> Postures:
        """Return room for some fingers."""
        shape = JOINTS, count
        return cls(
            np.empty(shape),
            np.zeros(shape, dtype=complex),
            np.empty(shape),
            np.empty(shape, dtype=np.int8),
            np.empty(shape, dtype=np.int8),
        )

    def put(
        self, model: FingerModel, i: int, phalanx: Phalanx, columns: slice = slice(None)
    ) -> None:
        """Set a phalanx of some fingers, and the joint after it."""
        angle, self.alongs[i, columns], self.kinds[i, columns], self.stops[i, columns] = phalanx
        self.angles[i, columns] = angle
        if i + 1 < JOINTS:
            end = self.joints[i, columns] + model.joint_spacing * np.exp(1j * angle)
            self.joints[i + 1, columns] = end

    def take(self, columns: Indices) -> Postures:
        """Return some of the fingers."""
        angles, joints, alongs, kinds, stops = self
        return Postures(
            angles[:, columns],
            joints[:, columns],
            alongs[:, columns],
            kinds[:, columns],
            stops[:, columns],
        )

    def finger(self, model: FingerModel, column: int) -> SettledFinger:
        """Return one finger."""
        angles, joints, alongs, kinds, stops = (value[:, column].tolist() for value in self)
        return SettledFinger(
            model,
            tuple(
                Contact(angle, (joint.real, joint.imag), along, KINDS[kind], STOPS[stop])
                for angle, joint, along, kind, stop in zip(
                    angles, joints, alongs, kinds, stops, strict=True
                )
            ),
        )


def settle_fingers(model: FingerModel, rock: SectionRows, count: int) -> Postures:
    """Close fingers on the rock; as `closure.settle_finger`, their joints at the origin."""
    fingers = Postures.empty(count)
    before = np.zeros(count)
    for i in range(JOINTS):
        fingers.put(model, i, _lay(model, rock, fingers.joints[i], i, before))
        before = fingers.angles[i]
    return fingers


def swing(
    model: FingerModel, rock: SectionRows, laid: Postures, proximal: int, angle: Array
) -> Postures:
    """Return fingers of which a phalanx is at an angle, one before it as laid, those beyond laid.

    It is held there by the spines of its tile, if they reach the rock.

    Parameters
    ----------
    model : FingerModel
    rock : SectionRows
        Under each finger.
    laid : Postures
    proximal : int
        Of how many fingers, the first ones, the proximal phalanx is held; of the others the middle.
    angle : ndarray, shape (n,)
        Where [rad].
    """
    fingers = Postures.empty(len(angle))
    first, others = slice(proximal), slice(proximal, None)
    joint = laid.joints[1].copy()
    joint[first] = 0.0
    held = _reach(model, rock, joint, angle)
    if proximal:
        fingers.put(model, 0, _some(held, first), first)
        under = rock if proximal == len(angle) else rock.take(np.arange(proximal))
        joint, before = fingers.joints[1, first], fingers.angles[0, first]
        fingers.put(model, 1, _lay(model, under, joint, 1, before), first)
    if proximal < len(angle):
        given = laid.angles[0], laid.alongs[0], laid.kinds[0], laid.stops[0]
        fingers.put(model, 0, _some(given, others), others)
        fingers.put(model, 1, _some(held, others), others)
    fingers.put(model, 2, _lay(model, rock, fingers.joints[2], 2, fingers.angles[1]))
    return fingers


def _some(phalanx: Phalanx, columns: slice) -> Phalanx:
    """Return a phalanx of some fingers."""
    a, b, c, d = phalanx
    return a[columns], b[columns], c[columns], d[columns]


def _lay(model: FingerModel, rock: SectionRows, joint: Complexes, i: int, before: Array) -> Phalanx:
    """Turn phalanges until their faces meet the rock."""
    low, high = before + model.joint_lower[i], before + model.joint_upper[i]
    angle, distance, flat, blocked = rock.rests(joint, phalanx_faces(model)[0], low, high)
    bears = ~(blocked | np.isnan(angle))
    along, kind = bear(model, rock, joint, angle, distance, flat)
    if bears.all():
        return angle, along, kind, np.full(bears.shape, FREE, dtype=np.int8)
    return (
        np.where(bears, angle, np.where(blocked, low, high)),
        np.where(bears, along, model.tile_centre),
        np.where(bears, kind, NONE),
        np.where(bears, FREE, np.where(blocked, LOWER, UPPER)),
    )


@lru_cache(maxsize=32)
def phalanx_faces(model: FingerModel) -> tuple[Span, Span]:
    """Return the faces of phalanges that meet rock, tile and bare frame, and of tiles alone."""
    near, far = model.tile_range
    height = model.tile_height
    return Span.of(near, model.joint_spacing, height), Span.of(near, far, height)


def bear(
    model: FingerModel,
    rock: SectionRows,
    joint: Complexes,
    angle: Array,
    distance: Array,
    flat: Flags,
) -> tuple[Array, Codes]:
    """Return where, and how, phalanges bear that rest on rock at a distance from their joints."""
    near, far = model.tile_range
    kind: Codes = np.where((near < distance) & (distance < far), FACE, EDGE)
    beyond = ((distance > far) & ~flat).nonzero()[0]
    if len(beyond):
        # the spines at the tile's far edge may reach across the gap
        edge = joint[beyond] + (far + 1j * model.tile_height) * np.exp(1j * angle[beyond])
        reached = rock.take(beyond).clearances(edge) <= model.spine_travel
        kind[beyond] = np.where(reached, EDGE, FRAME)
        distance[beyond] = np.where(reached, far, distance[beyond])
    if flat.any():
        kind[flat], distance[flat] = FACE, model.tile_centre
    return distance, kind


def _reach(model: FingerModel, rock: SectionRows, joint: Complexes, angle: Array) -> Phalanx:
    """Return how phalanges held at angles reach the rock: with the nearer edges of their tiles."""
    near, far = model.tile_range
    along = np.array([[near], [far]])
    edges = joint + (along + 1j * model.tile_height) * np.exp(1j * angle)
    first, last = rock.clearances(edges)
    gap = np.minimum(first, last)
    reached = (gap >= 0.0) & (gap <= model.spine_travel)
    nearer = np.where(first <= last, near, far)
    return (
        angle,
        np.where(reached, nearer, model.tile_centre),
        np.where(reached, EDGE, NONE),
        np.where(reached, FREE, BALANCE),
    )


def are_clear(model: FingerModel, rock: SectionRows, fingers: Postures) -> Flags:
    """Whether the tiles of phalanges without contact stand clear of the rock.

    Those with contact do, as they have been laid.
    """
    clear = np.ones(fingers.angles.shape[1], dtype=bool)
    for angle, joint, _, kind, _ in zip(*fingers, strict=True):
        off = kind == NONE
        if off.any():
            clear &= ~off | (rock.face_clearances(joint, phalanx_faces(model)[1], angle) >= -CLEAR)
    return clear
