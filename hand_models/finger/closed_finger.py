"""Close fingers on the rock along their paths, and return their postures and loads at rest."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger.closure_loads import stays, tendon_loads
from hand_models.finger.model import PHALANGES, FingerModel
from hand_models.finger.path_state import (
    JOINT_COUNT,
    OpenFinger,
    Records,
    drives,
    held_share,
    open_states,
)
from hand_models.finger.phalanx_shape import PhalanxShape, fan_out
from hand_models.finger.sequential_closure import SequentialClosure
from hand_models.finger.settings import CONTACT_CODES
from hand_models.finger.settled_finger import JOINT_STOPS, Contact, SettledFinger
from hand_models.sections import Complexes, Face, FingerRock, Flags, Outlines, Section

__all__ = [
    "ClosedFinger",
    "Refused",
    "cling",
    "close_all",
    "lay_across",
    "starting_angles",
    "straight_lift",
]


class ClosedFinger(NamedTuple):
    """A finger at rest on the rock, and its loads as affine functions of the tendon's tension.

    Attributes
    ----------
    finger : SettledFinger
    shears, normals, torques : ndarray, shape (3, 2)
        Shear and normal load of each phalanx, at zero tension [N] and per newton; torque on each
        joint's stop, at zero tension [N·m] and per newton [m]. See `SettledFinger.shears`,
        `SettledFinger.normals` and `SettledFinger.stop_torques`.
    touches : tuple of float, length 3
        Tension at which each phalanx first touched the rock [N]; NaN if it never did, or is laid.
    laid : bool
        Whether the finger was laid on the rock, without following its path.
    """

    finger: SettledFinger
    shears: Array
    normals: Array
    torques: Array
    touches: tuple[float, ...] = (np.nan,) * len(PHALANGES)
    laid: bool = False

    def mirrored(self) -> ClosedFinger:
        """Return the same finger on the mirror image of its rock across its plane."""
        finger = self.finger
        contacts = tuple([replace(each, across=-each.across) for each in finger.contacts])
        return self._replace(finger=SettledFinger(finger.model, contacts))


class Refused(NamedTuple):
    """Reason why a finger cannot close: rock inside the open finger, or no equilibrium found.

    Attributes
    ----------
    depth : float
        Depth of the rock inside the open finger [m]; zero if no equilibrium was found, or looked
        for.
    lift : float
        Distance along −z of the finger frame F by which the finger would have to be lifted clear of
        the rock [m]; infinite if a finger's length is not enough, NaN if not searched for.
    """

    depth: float
    lift: float


def cling(model: FingerModel, section: Section | None) -> ClosedFinger | Refused:
    """Return a straight, unloaded finger that is to cling with its nail, if no rock is inside it.

    Parameters
    ----------
    model : FingerModel
    section : Section or None
        Rock in the finger's plane, in the finger frame F; None if there is none.

    Returns
    -------
    ClosedFinger or Refused
        All joints at angle 0, all loads zero; or the depth of the rock inside the finger.
    """
    joints, _ = fan_out(np.zeros(JOINT_COUNT), model.joint_spacing)
    places = [(joint.real, joint.imag) for joint in joints.tolist()]
    if section is not None:
        tile = Face(*model.tile_range, model.tile_height)
        depth = max(-section.face_clearance(joint, 1.0, tile) for joint in joints.tolist())
        # a little, in parts of a gap's fineness, may be in a finger that clings
        if depth > 4.0 * PhalanxShape.of(model).fine:
            return Refused(depth, np.nan)
    contacts = (Contact(0.0, place, model.tile_centre, "none", "balance") for place in places)
    nothing = np.zeros((JOINT_COUNT, 2))
    return ClosedFinger(SettledFinger(model, tuple(contacts)), nothing, nothing, nothing)


def lay_across(
    model: FingerModel, solver: SequentialClosure, opened: OpenFinger
) -> ClosedFinger | None:
    """Return a finger that ends its closing laid on rock that is not alike across it.

    Its phalanges rest with the faces of their tiles, which have a part of their spines on the rock.

    Parameters
    ----------
    model : FingerModel
    solver : SequentialClosure
        Of the same model.
    opened : OpenFinger

    Returns
    -------
    ClosedFinger or None
        None for a finger that closes otherwise.
    """
    from hand_models.finger.around import around_rock

    section, closing = opened.rock.tile, opened.tension
    laid = [] if section is None else solver.lay(section)
    if len(laid) < JOINT_COUNT:
        return None
    depths = closing * model.depths(opened.base_tile)
    laid = [each.pressed(solver.tile, depth) for each, depth in zip(laid, depths, strict=True)]
    shape = PhalanxShape.of(model)
    rock = Outlines.of([opened.rock], model.size.reach, shape.spacing)
    q = np.diff([0.0, *(each.angle for each in laid)])
    around = around_rock(rock, shape, drives(model, [opened]), q[None])[0]
    shares = around["share"].tolist()
    # a frame that stands in the rock, or a tile without spines on it
    if around["gap"].min() < -shape.closes or min(shares) == 0.0:
        return None
    loads = tendon_loads(model, laid, closing, opened.base_tile, shares)
    if loads is None or not stays(loads, opened.surface, closing, shares):
        return None
    contacts = [
        Contact(
            angle, (joint.real, joint.imag), along, "face", engagement=share, across=float(across)
        )
        for (angle, _, joint, along, _), share, across in zip(
            laid, shares, around["across"], strict=True
        )
    ]
    shears, normals = (np.array([[each.real, each.imag] for each in of_kind]) for of_kind in loads)
    finger = SettledFinger(model, tuple(contacts))
    return ClosedFinger(finger, shears, normals, np.zeros((JOINT_COUNT, 2)), laid=True)


def close_all(
    model: FingerModel, closings: Sequence[OpenFinger], hands: Sequence[Hashable] | None = None
) -> list[ClosedFinger | Refused]:
    """Close n fingers on the rock together, along their paths (`hand_models.finger.closing`).

    Parameters
    ----------
    model : FingerModel
    closings : sequence of OpenFinger, length n
    hands : sequence, length n, optional
        The hand that each finger belongs to: fingers of a hand that has rock in one of them are not
        closed. Each finger is by itself by default.

    Returns
    -------
    list of ClosedFinger or Refused, length n
        In the order of ``closings``; `Refused` for a finger that starts inside the rock even with
        its joints fully open, that finds no equilibrium, or none of which is looked for.
    """
    from hand_models.finger.closing import follow

    shape = PhalanxShape.of(model)
    rocks = [closing.rock for closing in closings]
    rock = Outlines.of(rocks, model.size.reach, shape.spacing)
    drive = drives(model, closings)
    q = starting_angles(rocks, rock, shape, drive)
    lower, bent = drive["lower"], (q != _straight(drive)).any(axis=1).nonzero()[0]
    shut = np.zeros(len(q), dtype=bool)
    shut[bent] = _in_rock(
        _some(rock, bent), shape, drive[bent], [rocks[i] for i in bent], lower[bent]
    )
    found = [
        _refused(shape, each, angles) if starts and each.sections else None
        for each, angles, starts in zip(rocks, lower, shut.tolist(), strict=True)
    ]
    if hands is not None:
        refused = {hand for hand, each in zip(hands, found, strict=True) if each is not None}
        idle = Refused(0.0, np.nan)
        found = [
            idle if each is None and hand in refused else each
            for hand, each in zip(hands, found, strict=True)
        ]
    going = np.array([i for i, each in enumerate(found) if each is None], dtype=np.intp)
    if not len(going):
        return [each for each in found if each is not None]
    path = follow(_some(rock, going), shape, drive[going], open_states(q[going]))
    closed = _closed(model, [closings[i] for i in going.tolist()], *path)
    return [next(closed) if each is None else each for each in found]


def starting_angles(
    rocks: Sequence[FingerRock], rock: Outlines, shape: PhalanxShape, drive: Records
) -> Array:
    """Return the joint angles with which n fingers begin to close, shape (n, 3) [rad].

    A finger begins straight, or, with rock in its way, at its joints' lower limits. ``rock``: that
    of ``rocks``, as points along its boundary.
    """
    straight = _straight(drive)
    blocked = _in_rock(rock, shape, drive, rocks, straight)
    return np.asarray(np.where(blocked[:, None], drive["lower"], straight))


def straight_lift(model: FingerModel, opened: OpenFinger) -> float:
    """Return the lift along −z of F that clears a straight finger of rock [m].

    Zero if no rock is in the finger; infinite if the finger's length is not enough.
    """
    shape, drive = PhalanxShape.of(model), drives(model, [opened])
    rock = Outlines.of([opened.rock], model.size.reach, shape.spacing)
    q = _straight(drive)
    if not opened.rock.sections or not _in_rock(rock, shape, drive, [opened.rock], q)[0]:
        return 0.0
    return _refused(shape, opened.rock, q[0]).lift


def _straight(drive: Records) -> Array:
    return np.asarray(np.clip(0.0, drive["lower"], drive["upper"]))


def _some(rock: Outlines, fingers: Indices) -> Outlines:
    """Return the rock under some of the fingers, without copying that under all of them."""
    if len(fingers) == len(rock.points):
        return rock
    return Outlines._make(values[fingers] for values in rock)


def _in_rock(
    rock: Outlines,
    shape: PhalanxShape,
    drive: Records,
    rocks: Sequence[FingerRock],
    q: Array,
) -> Flags:
    """Return which fingers turned by q have rock in them, at their sides or all over."""
    from hand_models.finger.around import around_rock

    found = around_rock(rock, shape, drive, q)["gap"].min(axis=1) < -shape.closes
    for i in (~found).nonzero()[0].tolist():
        found[i] = _inside(rocks[i], _axes(shape, q[i])).any()
    return np.asarray(found)


def _inside(rock: FingerRock, places: Complexes) -> Flags:
    """Return which places are inside the rock."""
    inside = np.zeros(places.shape, dtype=bool)
    for each in rock.sections:
        inside |= each.clearances(places) < 0.0
    return inside


def _axes(shape: PhalanxShape, q: Array) -> Complexes:
    """Return places along the axes of the phalanges of a finger."""
    joints, u = fan_out(q, shape.end)
    along = np.linspace(shape.near, shape.end, 24)
    rise = np.interp(along, [shape.far, shape.end], [shape.lift, 0.0])
    return np.asarray(joints[:, None] + (along + 1j * rise) * u[:, None])


def _refused(shape: PhalanxShape, rock: FingerRock, q: Array) -> Refused:
    """Return how deep rock is in a finger, and the lift that would clear it."""
    places, most = _axes(shape, q).ravel(), JOINT_COUNT * shape.end
    outline = Outlines.of([rock], 2.0 * most + shape.end, shape.spacing)

    def depth(lift: float, *, how_far: bool = False) -> float:
        """Return how deep rock is in the finger; where it is, only asked ``how_far`` exactly."""
        lifted = places - 1j * lift
        near = float(shape.radius - outline.least_distance(lifted))
        if near > 0.0 and not how_far:
            return near
        inside = lifted[_inside(rock, lifted)]
        if not len(inside):
            return near
        return float(shape.radius + outline.distances(inside).max())

    now, low, high = max(depth(0.0, how_far=True), shape.closes), 0.0, most
    if depth(high) > 0.0:
        return Refused(now, np.inf)
    for _ in range(24):  # halvings of the lift
        middle = 0.5 * (low + high)
        low, high = (middle, high) if depth(middle) > 0.0 else (low, middle)
    return Refused(now, high)


def _closed(
    model: FingerModel,
    closings: Sequence[OpenFinger],
    state: Records,
    around: Records,
    rests: Flags,
) -> Iterator[ClosedFinger | Refused]:
    """Yield fingers as they are at the ends of their paths."""
    share, places = held_share(state, around), around["place"]
    joints, _ = fan_out(state["q"], model.joint_spacing)
    angles = np.cumsum(state["q"], axis=1)
    tilts = np.angle(around["push"]) - 0.5 * np.pi
    for row, closing in enumerate(closings):
        if not rests[row]:
            yield Refused(0.0, np.nan)
            continue
        mode, stop = state["mode"][row], state["stop"][row]
        caught = share[row] > 0.0
        stops, bears = _stops(mode != CONTACT_CODES.off, caught, stop)
        caught &= bears
        contacts = []
        near, far = model.tile_range
        for j, place in enumerate(places[row].tolist()):
            kind, along, rise, tilt, phi = "none", model.tile_centre, 0.0, 0.0, 0.0
            bearing = 1.0
            if bears[j]:
                along, rise = place.real, place.imag - model.tile_height
                kind, tilt = "frame", float(tilts[row, j])
            if caught[j]:
                kind, phi = "face" if near < along < far else "edge", float(share[row, j])
                if mode[j] != CONTACT_CODES.on:
                    bearing = min(phi / model.least_share, 1.0)
            joint = complex(joints[row, j])
            contacts.append(
                Contact(
                    float(angles[row, j]),
                    (joint.real, joint.imag),
                    along,
                    kind,
                    JOINT_STOPS[stops[j]],
                    rise,
                    tilt,
                    phi,
                    float(around["across"][row, j]) if caught[j] else 0.0,
                    bearing,
                )
            )
        finger, of_tile = SettledFinger(model, tuple(contacts)), closing.base_tile
        shears = finger.shears(closing.tension, of_tile)
        normals = finger.normals(shears, of_tile)
        torques = finger.stop_torques(shears, normals, of_tile)
        yield ClosedFinger(finger, shears, normals, torques, tuple(state["touches"][row].tolist()))


def _stops(presses: Flags, caught: Flags, stop: Indices) -> tuple[list[int], Flags]:
    """Return what holds each joint, by code, and which phalanges bear.

    A joint is held by the contact of its own phalanx, or by that of a later one whose own joint
    stands at a limit. The others are at limits, or balanced by tendon and springs. Those bear that
    press or are held, and those with spines across a gap, for which there is a joint left.
    """
    free, upper, lower, balance = range(len(JOINT_STOPS))
    codes = [{1: upper, -1: lower}.get(int(side), balance) for side in stop]
    bears = np.zeros(JOINT_COUNT, dtype=bool)
    for j in [*presses.nonzero()[0].tolist(), *(caught & ~presses).nonzero()[0].tolist()]:
        # its own joint, or the nearest one before it that is not at a limit
        joints = [i for i in range(j, -1, -1) if codes[i] == balance]
        if joints and (presses[j] or joints[0] == j):
            codes[joints[0]], bears[j] = free, True
    return codes, bears
