"""Find a seat for a hand on a hold: the hold's pose in the hand frame H, if none is given.

Axes of the hold are parallel to H's. The proximal tiles of the inner fingers touch at
``seated_contact`` (c₁) from their joints, where they first meet the rock across their width: of the
hold's place (x, z) in H one number is given by the grasp, and the other follows.

- In a *pinch* the crest is midway between the opposed finger bases, and the palm's stand-off z
  follows.
- Otherwise the *palm rests on the rock*, and the crest's place along x follows.
- Where neither is possible the palm rests on the rock with the crest under its centre.
- On rock known only by its outline the palm rests on the highest rock found under it, on a few
  lines along it; the crest of a pinch is the hold's origin; c₁ is the mean of both inner fingers.
- A seat with rock inside an open finger backs off along −z of H until the finger is clear, by
  ``HandModel.back_off`` at most.
- On a plane every tile lies flat: the palm stands off by the tiles' height, within the spines'
  travel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np
import scipy

from hand_models.base import Array, Pose
from hand_models.hand.grasp import Grasp
from hand_models.hand.model import HandModel
from hand_models.rock import Hold, Plane
from hand_models.sections import Face, PolylineSection, Section

__all__ = ["CENTRED_SEATING", "RockUnder", "Seating", "propose", "seating_given", "touches_seat"]

Angle = TypeVar("Angle", float, Array)

Place = tuple[float, float]
"""(x, z) of a hold's frame in H [m]."""


@dataclass(frozen=True)
class Seating:
    """Pose of a hold in the hand, and the rule that chose it. Arrays are read-only.

    Attributes
    ----------
    pose : Pose
        The hold's frame in the hand frame H.
    rule : {'given', 'pinch', 'palm_on_rock', 'palm_on_rock_centred', 'flat', 'best', 'contact'}
        How the pose was found.
    backed_off : float
        Distance along −z of H by which the hand then backed off, so that its open fingers are
        clear of the rock [m].
    offset : Pose, optional
        Pose of H in the frame of its rest, for the rule 'contact'.
    """

    pose: Pose
    rule: str
    backed_off: float = 0.0
    offset: Pose | None = None

    def off(self, distance: float) -> Seating:
        """Return the seating after the hand has backed off from the rock.

        ``distance``: along −z of the hand frame H [m].
        """
        position = self.pose.position + np.array([0.0, 0.0, distance])
        position.setflags(write=False)
        return Seating(Pose(position, self.pose.rotation), self.rule, distance)


def seating_given(pose: Pose) -> Seating:
    """Return the seating for a given pose of the hold in the hand frame H, as a read-only copy."""
    position, rotation = np.array(pose.position, dtype=float), np.array(pose.rotation, dtype=float)
    position.setflags(write=False)
    rotation.setflags(write=False)
    return Seating(Pose(position, rotation), "given")


CENTRED_SEATING: Final = Seating(Pose.identity(), "palm_on_rock_centred")
"""Seating with the palm on the rock and the crest under the palm's centre."""

CENTRED_SEATING.pose.position.setflags(write=False)
CENTRED_SEATING.pose.rotation.setflags(write=False)


def propose(
    hand: HandModel,
    hold: Hold,
    grasp: Grasp,
    at: Pose | None = None,
    known: dict[Hashable, RockUnder] | None = None,
) -> tuple[Seating, bool]:
    """Return the proposed seat of a hand on a hold, and whether to check it for contact.

    Parameters
    ----------
    hand : HandModel
    hold : Hold
    grasp : Grasp
    at : Pose, optional
        Frame on the hold, in the hold's frame, on which to seat the hand; the hold's own frame by
        default.
    known : dict, optional
        Cache of the rock cut under hands of this model, by hold and ``at``; new cuts are added. The
        cut rock does not depend on the grasp.

    Returns
    -------
    seating : Seating
    on_contact : bool
        Whether the seat assumes that the inner fingers' proximal tiles touch at the distance
        ``hand.seated_contact`` from their joints. If so, and `touches_seat` is False for the closed
        finger, the caller uses `CENTRED_SEATING` instead.
    """
    z = hand.inner_place[2]
    if at is not None:
        key = hold, at.position.tobytes(), at.rotation.tobytes()
        known = {} if known is None else known
        if key not in known:
            known[key] = RockUnder(hand, hold, at)
        there = _on_outline(hand, known[key], hand.pinch_crest if grasp.pinch else None)
        return replace(there, pose=there.pose @ at.inverse()), False
    if hold.shape == Plane.shape:
        return Seating(_shifted(0.0, z + hand.finger.tile_height), "flat"), False
    pinch = grasp.pinch
    crest = hand.pinch_crest if pinch else None
    circle = hold.crest_circle(_nearest_side(hand))
    if circle is None and hold.swept is None:
        return _on_outline(hand, RockUnder(hand, hold, Pose.identity()), crest), False
    place = _smooth(hand, hold, crest) if circle is None else _round(hand, *circle, crest)
    if place is None:
        return CENTRED_SEATING, False
    possible = place[1] >= 0.0 if pinch else abs(place[0]) <= 0.5 * hand.palm_length
    if not possible:
        return CENTRED_SEATING, False
    return Seating(_shifted(*place), "pinch" if pinch else "palm_on_rock"), True


def _nearest_side(hand: HandModel) -> float:
    """Return how far from the palm's middle the tiles of inner fingers begin, along y [m].

    There they first meet a crest that is under the palm's middle.
    """
    return max(abs(hand.inner_place[1]) - 0.5 * hand.finger.tile_width, 0.0)


def touches_seat(hand: HandModel, along: float) -> bool:
    """Return True if an inner finger's proximal contact is where its seat assumed it.

    ``along``: distance of the contact from the proximal joint, compared with ``seated_contact``
    [m].
    """
    return abs(along - hand.seated_contact) < 1e-6  # [m]


def _shifted(x: float, z: float) -> Pose:
    position = np.array([x, 0.0, z])
    position.setflags(write=False)
    return Pose(position, CENTRED_SEATING.pose.rotation)


def _round(hand: HandModel, depth: float, radius: float, crest: float | None) -> Place | None:
    """Return (x, z) of a round hold's crest, whose x may be given and whose z is else zero."""
    x, _, z = hand.inner_place
    reach = (radius + hand.finger.tile_height) ** 2 + hand.seated_contact**2
    if crest is not None:
        rise = reach - (x - crest) ** 2
        return None if rise <= 0.0 else (crest, z + math.sqrt(rise) - depth)
    run = reach - (depth - z) ** 2
    return None if run <= 0.0 else (x - math.sqrt(run), 0.0)


def _smooth(hand: HandModel, hold: Hold, crest: float | None) -> Place | None:
    """Do the same for a smooth hold that is not round, over the proximal phalanx's angle."""
    x, _, z = hand.inner_joint.tolist()
    y = _nearest_side(hand)

    def place(angle: Angle) -> tuple[Angle, Angle] | None:
        point = hold.tangent_point(y, angle)
        if point is None:
            return None
        # the tile's contact at that angle of the phalanx
        u, v = np.cos(angle), np.sin(angle)
        along, height = hand.seated_contact, hand.finger.tile_height
        return x + along * u - height * v - point[0], z + along * v + height * u - point[1]

    def miss(angle: Angle) -> Angle:
        there = place(angle)
        assert there is not None
        return there[0] - crest if crest is not None else there[1]

    if place(0.0) is None:
        return None
    angles = np.linspace(0.0, hand.finger.joint_upper[0], 64)
    misses = miss(angles)
    turns = np.flatnonzero(np.sign(misses[:-1]) * np.sign(misses[1:]) <= 0.0)
    if not len(turns):
        return None
    first = int(turns[0])
    root = scipy.optimize.brentq(miss, float(angles[first]), float(angles[first + 1]), xtol=1e-13)
    return place(float(root))


# Rock that is known by its outline only -----------------------------------------------------------


class RockUnder:
    """Outlines of the rock under a palm and the inner fingers, in planes y = const of a frame.

    Parameters
    ----------
    hand : HandModel
    hold : Hold
    at : Pose
        The frame, in the hold's frame.

    Attributes
    ----------
    under : list of PolylineSection
        Rock in the planes of the two inner fingers; planes without rock are left out.
    """

    def __init__(self, hand: HandModel, hold: Hold, at: Pose) -> None:
        self._at = at
        self._half = 0.5 * hand.palm_length
        self._reach = hand.finger.reach + hand.palm_length
        y = hand.inner_place[1]
        across = np.abs(hand.palm_tiles[:, 1]).max() + 0.5 * hand.palm_tile_size[1]
        self.under = self._outlines(
            hold.finger_rock(*self._plane(each), hand.finger.size, tiles_only=True).tile
            for each in (y, -y)
        )
        # lines along the palm on which the highest rock under it is looked for
        lines = np.linspace(-across, across, 5).tolist() if self.under else []
        self._lines = self._outlines(hold.section(*self._plane(each)) for each in lines)

    def _plane(self, offset: float) -> tuple[Array, Array, Array]:
        """Return origin and axes of a plane along x, so far along y from the frame's origin."""
        axes = self._at.rotation
        return self._at.apply([0.0, offset, 0.0]), axes[:, 0], axes[:, 2]

    def _outlines(self, sections: Iterable[Section | None]) -> list[PolylineSection]:
        lines = [self._outline(section) for section in sections if section is not None]
        return [line for line in lines if line is not None]

    def _outline(self, section: Section) -> PolylineSection | None:
        if isinstance(section, PolylineSection):
            return section
        chains = section.outline(self._reach, spacing=5e-4)
        pieces = [np.column_stack([chain.real, chain.imag]) for chain in chains]
        return PolylineSection(pieces) if pieces else None

    def top(self, x: Array) -> Array:
        """Return z of the highest rock under the palm, for places of the frame ``at`` along x.

        Parameters
        ----------
        x : ndarray, shape (n,)
            x of the frame in the hand frame H [m].

        Returns
        -------
        ndarray, shape (n,)
            z of the highest rock in the frame [m]; NaN where there is no rock.
        """
        tops = [line.highest(-self._half - x, self._half - x) for line in self._lines]
        least = np.min(tops, axis=0)
        return np.where(np.isfinite(least), least, math.nan)


def _on_outline(hand: HandModel, rock: RockUnder, crest: float | None) -> Seating:
    """Seat a hand on rock that is known by its outlines; centred if there is none under it."""
    under = rock.under
    if not under:
        return CENTRED_SEATING
    x, _, z = hand.inner_joint.tolist()
    model = hand.finger
    face = Face(model.tile_range[0], model.joint_spacing, model.tile_height)
    limits = model.joint_lower[0], model.joint_upper[0]

    def miss(places: Array) -> Array:
        """Return by how much proximal contacts miss c₁; least in rock, most without rock."""
        missed = np.full(len(places), math.nan)
        there = np.isfinite(places[:, 1])
        if not there.any():
            return missed
        joints = x - places[there, 0] + 1j * (z - places[there, 1])
        rests = [section.rests(joints, face, *limits) for section in under]
        along = np.array([each.distance for each in rests])
        mean = np.where(np.isnan(along), model.joint_spacing, along).mean(axis=0)
        blocked = np.any([each.blocked for each in rests], axis=0)
        missed[there] = np.where(blocked, 0.0, mean) - hand.seated_contact
        return missed

    def resting(along: Array, stand_off: Array) -> Array:
        return np.column_stack([along, stand_off - rock.top(along)])

    centre = resting(np.zeros(1), np.zeros(1))
    if np.isnan(centre).any():
        return CENTRED_SEATING
    level = centre[0] + [0.0, z + model.tile_height]
    lying = [section.rest(complex(x, z - level[1]), face, *limits) for section in under]
    # in the palm's plane, but for a milliradian
    if all(rest is not None and rest.flat and abs(rest.angle) < 1e-3 for rest in lying):
        return Seating(_shifted(*level.tolist()), "flat")
    count = 24  # places tried to bracket a seat
    if crest is None:
        half = 0.5 * hand.palm_length
        tries, rule = np.linspace(-half, half, count), "palm_on_rock"
        place = _first(miss, lambda along: resting(along, np.zeros(len(along))), tries)
    else:
        tries, rule = np.linspace(0.0, hand.finger.joint_spacing, count), "pinch"
        place = _first(miss, lambda off: resting(np.full(len(off), crest), off), tries)
    if place is None:
        place, rule = centre[0], "palm_on_rock_centred"
    return Seating(_shifted(*place.tolist()), rule)


def _first(
    miss: Callable[[Array], Array], places: Callable[[Array], Array], tries: Array
) -> Array | None:
    """Return the place, nearest zero along its parameter, at which nothing is missed."""
    misses = miss(places(tries))
    turns = np.flatnonzero(np.abs(np.diff(np.sign(misses))) > 0.0)
    # how near zero a place in each bracket may be
    least = np.abs(np.clip(0.0, tries[turns], tries[turns + 1]))
    # about where a straight line between its ends is zero, in parts of the bracket
    parts = np.array([-(2.0**-7), -(2.0**-11), 2.0**-11, 2.0**-7])
    best: tuple[float, Array] | None = None
    for which in np.argsort(least, kind="stable").tolist():
        if best is not None and best[0] <= least[which]:
            break
        ends, off = (values[turns[which] : turns[which] + 2] for values in (tries, misses))
        while ends[1] - ends[0] > 1e-8:  # [m]
            # everywhere in the bracket, and about where a straight line has it
            line = ends[0] - off[0] * (ends[1] - ends[0]) / (off[1] - off[0])
            about = np.clip(line + parts * (ends[1] - ends[0]), *ends)
            between = np.unique(np.concatenate([np.linspace(ends[0], ends[1], 17), about]))
            missed = miss(places(between))
            inside = np.flatnonzero(np.abs(np.diff(np.sign(missed))) > 0.0)
            if not len(inside):
                break
            ends, off = (values[inside[0] : inside[0] + 2] for values in (between, missed))
        root = ends[:1] - off[:1] * (ends[1] - ends[0]) / (off[1] - off[0])
        there = places(root)
        # where the contact jumps over c₁ there is no root
        near = 5e-5  # [m] on an outline a contact moves in small steps
        met = np.abs(off).max() < near or abs(miss(there)[0]) < near
        if met and (best is None or abs(root[0]) < best[0]):
            best = abs(root[0]), there[0]
    return None if best is None else best[1]
