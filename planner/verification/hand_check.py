"""One hand's part of the check of a stance that stays: everything affine in its loads, as rows.

Rows (…, m + 1) give a number as their product with the hand's loads y and 1. They are worked out by
the check's own ways: tile loads from the full equilibrium of Eq. 6, not from the affine maps of
Eq. 14 that plans are made of; the wrench force by force; limits from the figures of surface,
structure, drive and limb.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, skew
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from hand_models.hand import FINGERS, HELD, NAIL, SettledHand
from hand_models.tile import inner_half_planes
from planner.prepare import BALL, HandBatch
from planner.question import HandOnHold, Question
from planner.verification.arrays import LOAD
from planner.verification.equilibrium import Equilibrium, equilibrium
from planner.verification.recomputation import STOP

__all__ = ["HandCheck", "JointUse", "hand_check"]


class JointUse(NamedTuple):
    """Torques of a limb's joints over what they bear, for its hand's wrench w: ``rest + turn w``.

    Attributes
    ----------
    rest : ndarray, shape (n,)
    turn : ndarray, shape (n, 6)
    """

    rest: Array
    turn: Array


@dataclass(frozen=True, eq=False)
class HandCheck:
    """Rows of one hand.

    Attributes
    ----------
    tiles : ndarray, shape (3, k, m + 1)
        Shear, normal and lateral load of each tile on rock [N].
    engagement : ndarray, shape (k,)
        Share of the spines of each of these that are on the rock.
    planes : tuple of slice
        The rows of ``used`` that limit each of them.
    used : ndarray, shape (n, m + 1)
        Load over capacity of all limits.
    hard : ndarray, shape (h, m + 1)
        What may not be below zero by more than its part of ``slack``.
    slack : ndarray, shape (h, 2)
        That: a constant, and per newton of the stance's largest load.
    palm : ndarray, shape (2, m + 1)
        Shear and pressing of the palm [N].
    wrench : ndarray, shape (6, m + 1)
        On the rock, in H.
    held : ndarray, shape (17, m + 1)
        What it holds along `HELD` [N].
    """

    tiles: Array
    engagement: Array
    planes: tuple[slice, ...]
    used: Array
    hard: Array
    slack: Array
    palm: Array
    wrench: Array
    held: Array


def hand_check(
    question: Question,
    place: HandOnHold,
    hand: SettledHand,
    columns: tuple[str, ...],
    joints: JointUse | None,
) -> HandCheck:
    """Return one hand's rows.

    Parameters
    ----------
    question : Question
    place : HandOnHold
        With a fixed wrist.
    hand : SettledHand
        On its hold.
    columns : tuple of str
        Names of its loads y.
    joints : JointUse or None
        Of its limb; None if nothing is said of joints.
    """
    rows, solved = _Rows(columns), equilibrium(HandBatch.of((hand,)))
    for i in range(len(FINGERS)):
        _finger(rows, question, hand, i, solved)
    _palm(rows, hand)
    held = HELD @ rows.wrench[:3]
    rows.limit(held / hand.hand.structure.hand_load)
    if joints is not None:
        torques = joints.turn @ rows.wrench
        torques[:, -1] += joints.rest
        rows.limit(torques)
        rows.limit(-torques)
    _cap(rows, question, place)
    return HandCheck(
        tiles=np.array(rows.tiles).reshape(-1, 3, len(columns) + 1).transpose(1, 0, 2),
        engagement=hand.engagement[hand.touching],
        planes=tuple(rows.planes),
        used=np.vstack(rows.used),
        hard=np.vstack(rows.hard),
        slack=np.vstack(rows.slack),
        palm=np.array([rows.load(PALM_SHEAR), rows.load(PALM_PRESSING)]),
        wrench=rows.wrench,
        held=held,
    )


class _Rows:
    """The rows so far, over the columns of those names and 1."""

    def __init__(self, columns: tuple[str, ...]) -> None:
        self._column = {name: j for j, name in enumerate(columns)}
        self._size = len(columns) + 1
        self.tiles: list[Array] = []
        self.planes: list[slice] = []
        self.used: list[Array] = []
        self.hard: list[Array] = []
        self.slack: list[Array] = []
        self.wrench = np.zeros((6, self._size))
        self._limits = 0

    def load(self, name: str) -> Array:
        """Return the row of a load by its column's name; of none where there is no such column."""
        row = np.zeros(self._size)
        if name in self._column:
            row[self._column[name]] = 1.0
        return row

    def constant(self, values: Array) -> Array:
        """Return rows that are constant."""
        rows = np.zeros((len(values), self._size))
        rows[:, -1] = values
        return rows

    def push(self, place: Array, force: Array) -> None:
        """Add a force, rows (3, m + 1), at a place to the wrench."""
        self.wrench[:3] += force
        self.wrench[3:] += skew(place) @ force

    def limit(self, rows: Array) -> slice:
        """Add loads over capacities."""
        rows = np.atleast_2d(rows)
        self.used.append(rows)
        self._limits += len(rows)
        return slice(self._limits - len(rows), self._limits)

    def keep(self, rows: Array, *, constant: float = 0.0, growing: float = LOAD) -> None:
        """Add what may not be below zero."""
        rows = np.atleast_2d(rows)
        self.hard.append(rows)
        self.slack.append(np.tile([constant, growing], (len(rows), 1)))


def _finger(
    rows: _Rows, question: Question, hand: SettledHand, index: int, solved: Equilibrium
) -> None:
    name, model = FINGERS[index], hand.hand.finger
    structure = hand.hand.structure
    tension = rows.load(f"{name}/tension")

    def affine(rest: Array, slope: Array) -> Array:
        return np.outer(slope, tension) + rows.constant(rest)

    all_own = np.flatnonzero(hand.finger_of == index).tolist()
    own = [t for t in all_own if hand.tiles[t].phalanx != NAIL]
    hooked = [t for t in all_own if hand.tiles[t].contact == NAIL]
    on_rock = [hand.tiles[t].contact in ("face", "edge") for t in own]
    shear, normal = affine(*solved.shear[:, own]), affine(*solved.normal[:, own])
    _drive(rows, question, hand, tension)
    rows.limit(shear.sum(axis=0) / structure.finger_shear)
    rows.limit(normal[-1] / structure.fingertip_force)
    rows.keep(tension)
    rows.keep(shear)
    rows.keep(affine(*solved.stops[:, solved.stop_fingers == index]), constant=STOP, growing=0.0)
    if model.friction > 0.0 and (any(on_rock) or hooked):
        rows.keep(tension - rows.constant(np.array([hand.closing_tension]))[0])
    spines = hand.engagement[own].tolist()
    lateral = rows.load(f"{name}/lateral") / (sum(spines) or 1.0)
    for t, touches, share, along, into in zip(own, on_rock, spines, shear, normal, strict=True):
        aside = lateral * share
        rows.push(hand.positions[t], hand.axes[t].T @ np.array([along, into, aside]))
        if touches:
            rows.tiles.append(np.array([along, into, aside]))
            rows.planes.append(rows.limit(_planes(hand, along, into, aside) / share))
        else:
            rows.keep(into)
    for t in hooked:
        _nail(rows, hand, index, t, tension)


def _drive(rows: _Rows, question: Question, hand: SettledHand, tension: Array) -> None:
    """Add the limits of a tendon and its motor."""
    drive, cap = hand.hand.drive, question.limits.tendon_tension
    most = hand.hand.maximum_tension if cap is None else min(cap, hand.hand.maximum_tension)
    torque = tension * drive.winch_radius / drive.gear_ratio / drive.efficiency
    current = torque / drive.torque_constant
    current[-1] += drive.no_load_current
    for used in (tension / most, torque / drive.maximum_torque, current / drive.maximum_current):
        rows.limit(used)


def _planes(hand: SettledHand, along: Array, into: Array, aside: Array) -> Array:
    """Return what a whole tile uses of its half-planes, with its lateral load of either sign."""
    return np.array(
        [
            (piece.a_shear * along + piece.a_normal * into + sign * piece.a_lateral * aside)
            / piece.capacity
            for piece in inner_half_planes(hand.surface)
            for sign in (1.0, -1.0)
        ]
    )


def _palm(rows: _Rows, hand: SettledHand) -> None:
    shear, pressing = rows.load(PALM_SHEAR), rows.load(PALM_PRESSING)
    rows.keep(shear)
    rows.keep(pressing)
    if hand.palm.engaged:
        rows.push(hand.palm.centre, np.array([-shear, np.zeros_like(shear), pressing]))
        rows.limit(shear / hand.palm.shear_limit)
        rows.limit(pressing / hand.palm.pressing_limit)


def _nail(rows: _Rows, hand: SettledHand, index: int, tile: int, tension: Array) -> None:
    """Add a nail that hooks: balance about its pin and the joints, friction, its limits.

    P across it follows from the balance about the pin; A along it is a load of its own.
    """
    name, model, nail = FINGERS[index], hand.hand.finger, hand.hand.nail
    structure = hand.hand.structure
    frame = hand.hand.frames(hand.grasp.outer_rotation)[index]
    pin = frame.joint + len(model.pulley_radii) * model.joint_spacing * frame.along
    arm = hand.positions[tile] - pin
    x, z = float(arm @ frame.along), float(arm[2])
    reach, loss = float(np.hypot(x, z)), 1.0 - model.friction
    local = tension * loss if name.startswith("outer") else tension
    pulls = []
    for radius, preload in zip(model.pulley_radii, model.joint_preload, strict=True):
        pulls.append(local * radius - rows.constant(np.array([preload]))[0])
        local = local * loss
    held = nail.preload + nail.stiffness * float(np.arctan2(z, x))
    across = (local * nail.pulley_radius - rows.constant(np.array([held]))[0]) / reach
    force = hand.axes[tile].T @ np.array(
        [rows.load(f"{name}/{NAIL}"), across, np.zeros_like(across)]
    )
    rows.push(hand.positions[tile], force)
    along, into = frame.along @ force, force[2]
    for i, pull in enumerate(pulls):
        far = (len(pulls) - i) * model.joint_spacing
        rows.keep((far + x) * into - z * along - pull, growing=LOAD * far)
    normal = hand.nail_normals[index]
    pressed, sideways = -normal @ force, np.cross(normal, np.cross(frame.along, [0.0, 0.0, 1.0]))
    dragged = sideways @ force
    rows.keep(pressed)
    rows.keep(nail.friction * pressed - dragged)
    rows.keep(nail.friction * pressed + dragged)
    rows.limit(-along / structure.finger_shear)
    rows.limit(into / structure.fingertip_force)


def _cap(rows: _Rows, question: Question, place: HandOnHold) -> None:
    """Add the caller's cap on the hand's force."""
    cap = question.limits.per_hand.get(place.limb)
    if cap is None:
        return
    force = rows.wrench[:3]
    if not isinstance(cap.largest_force, tuple):
        rows.limit(BALL @ force / cap.largest_force)
        return
    if cap.frame != "hand":
        force = place.pose.rotation @ force
    if cap.frame == "body":
        force = question.stance.body.rotation.T @ force
    for along, ends in zip(force, cap.largest_force, strict=True):
        for sign, end in zip((-1.0, 1.0), ends, strict=True):
            if end == 0.0:
                rows.keep(-sign * along)
            elif np.isfinite(end):
                rows.limit(along / end)
