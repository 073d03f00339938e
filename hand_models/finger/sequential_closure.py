"""A finger laid on smooth rock, phalanx by phalanx from the base.

This is `hand_models.finger.closure.settle_finger` for fingers of which every phalanx finds its
rock, as those of a hand mostly do. What else may become of a finger is left to
`hand_models.finger.contact_states`.
"""

from __future__ import annotations

import cmath
import math
from typing import Final, NamedTuple

from hand_models.finger.model import FingerModel
from hand_models.sections import LEVEL, Face, SmoothCut

__all__ = ["EDGE", "FACE", "FRAME", "KINDS", "NONE", "ClosedPhalanx", "SequentialClosure"]

KINDS: Final = ("face", "edge", "frame", "none")
"""What of a phalanx touches the rock, by code."""

FACE, EDGE, FRAME, NONE = range(len(KINDS))


class ClosedPhalanx(NamedTuple):
    """A phalanx on the rock.

    Attributes
    ----------
    angle : float
        θ [rad].
    u : complex
        Along it, in F.
    joint : complex
        x + i z of its joint in F [m].
    along : float
        c, of its contact from the joint [m].
    kind : int
        Code of `KINDS`.
    """

    angle: float
    u: complex
    joint: complex
    along: float
    kind: int


Rested = tuple[float, complex, float, bool]
"""How far a phalanx turns till it rests [rad], its direction and its contact, and if it is flat."""


class SequentialClosure:
    """Lays fingers of one model.

    Parameters
    ----------
    model : FingerModel
    """

    def __init__(self, model: FingerModel) -> None:
        near, self._far = model.tile_range
        self._spacing, self._centre = model.joint_spacing, model.tile_centre
        self._travel = model.spine_travel
        self._face = Face(near, model.joint_spacing, model.tile_height)
        ends = (complex(along, model.tile_height) for along in self._face[:2])
        self._ends = tuple((abs(end), end.conjugate() / abs(end), end) for end in ends)
        self._joints = [
            (lower, cmath.rect(1.0, lower), upper - lower)
            for lower, upper in zip(model.joint_lower, model.joint_upper, strict=True)
        ]

    def lay(self, cut: SmoothCut) -> list[ClosedPhalanx]:
        """Close a finger on rock, its proximal joint at the origin of F.

        Returns
        -------
        list of ClosedPhalanx
            Phalanges from the base on, as many as rest on rock one after the other.
        """
        laid: list[ClosedPhalanx] = []
        joint, angle, u = 0j, 0.0, 1.0 + 0j
        for lower, opened, span in self._joints:
            rest = self._rest(cut, joint, u * opened, span)
            if rest is None:
                break
            turn, u, along, flat = rest
            angle += lower + turn
            kind = FACE
            if not flat and not self._face.start < along < self._far:
                along, kind = self._beyond(cut, joint, u, along)
            laid.append(ClosedPhalanx(angle, u, joint, along, kind))
            joint += self._spacing * u
        return laid

    def _rest(self, cut: SmoothCut, joint: complex, low: complex, span: float) -> Rested | None:
        """Return where a phalanx that turns from the direction ``low`` on rests, if it does."""
        face = self._face
        if not cut.clear(joint, low, face):
            return None
        tangent = cut.tangent(joint, face.height)
        if tangent is not None:
            u, along = tangent
            turn = cmath.phase(u / low) % math.tau
            if turn <= span:
                if face.start <= along <= face.end:
                    return turn, u, along, False
                if not cut.faced:
                    # the face's line touches the rock beyond this end, which is first on it
                    beyond = along > face.end
                    turn, u = self._first(cut, joint, self._ends[beyond], low, span)
                    return None if turn > span else (turn, u, face[beyond], False)
        start, end = (self._first(cut, joint, each, low, span) for each in self._ends)
        turn, u = start if start[0] <= end[0] else end
        if turn > span:
            return None
        level = abs(start[0] - end[0]) * (face.end - face.start) <= LEVEL
        if level and all(cut.straight(joint + each * u) for _, _, each in self._ends):
            return turn, u, self._centre, True
        return turn, u, face.start if start[0] <= end[0] else face.end, False

    def _first(
        self,
        cut: SmoothCut,
        joint: complex,
        end: tuple[float, complex, complex],
        low: complex,
        span: float,
    ) -> tuple[float, complex]:
        """Return how far a phalanx turns till an end of its face is on the rock, and to where.

        Infinitely far where it is not within the span.
        """
        arm, back, _ = end
        first = math.inf, low
        for way in cut.entries(joint, arm):
            u = way * back
            turn = cmath.phase(u / low) % math.tau
            if turn <= span and turn < first[0]:
                first = turn, u
        return first

    def _beyond(
        self, cut: SmoothCut, joint: complex, u: complex, along: float
    ) -> tuple[float, int]:
        """Return where a phalanx bears that rests on rock at an end of its tile or beyond."""
        if along <= self._far:
            return along, EDGE
        if cut.distance(joint + complex(self._far, self._face.height) * u) <= self._travel:
            return self._far, EDGE
        return along, FRAME
