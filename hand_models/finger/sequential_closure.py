"""A finger laid on smooth rock, phalanx by phalanx from the base.

This is `hand_models.finger.closure.settle_finger` for fingers whose phalanges all rest with the
faces of their tiles, as those of a hand on smooth rock mostly do: there each has come to the rock
and is held, and so they are at the ends of their paths (`hand_models.finger.closing`). What else
may become of a finger is left to those.
"""

from __future__ import annotations

import cmath
import math
from typing import Final, NamedTuple

from hand_models.finger.model import FingerModel
from hand_models.finger.phalanx_gaps import PhalanxShape, middle_of_bed
from hand_models.sections import Face, SmoothCut

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
    bends : tuple of float
        Curvature of the rock under the face, toward its beginning and its end [1/m].
    """

    angle: float
    u: complex
    joint: complex
    along: float
    bends: tuple[float, float] = (0.0, 0.0)

    def pressed(self, face: Face, depth: float) -> ClosedPhalanx:
        """Return it with the place where a bed of springs bears that is pressed in by a depth.

        As of `hand_models.finger.phalanx_gaps`: the middle of the pressures where these are cut
        short by an end of the tile. ``face``: of the tile.
        """
        near, far = (
            min(end, math.sqrt(2.0 * depth / bend) if bend > 0.0 else math.inf)
            for end, bend in zip(
                (self.along - face.start, face.end - self.along), self.bends, strict=True
            )
        )
        return self._replace(along=self.along + middle_of_bed((near, far), self.bends, depth))


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
        self.tile = Face(near, self._far, model.tile_height)
        self._level = PhalanxShape.of(model).fine
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
            Phalanges from the base on, as many as rest on rock with their tiles' faces one after
            the other.
        """
        laid: list[ClosedPhalanx] = []
        joint, angle, u = 0j, 0.0, 1.0 + 0j
        for lower, opened, span in self._joints:
            rest = self._rest(cut, joint, u * opened, span)
            if rest is None:
                break
            turn, u, along, flat = rest
            angle += lower + turn
            bends = (0.0, 0.0)
            if not flat:
                if not self._face.start < along < self._far:
                    # on an edge of the tile or beyond it
                    break
                bends = self._bends(cut, joint, u, along)
            laid.append(ClosedPhalanx(angle, u, joint, along, bends))
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
        level = abs(start[0] - end[0]) * (face.end - face.start) <= self._level
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

    def _bends(
        self, cut: SmoothCut, joint: complex, u: complex, along: float
    ) -> tuple[float, float]:
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
