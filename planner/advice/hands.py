"""Propose changes of a stance's hands: release, another grasp, another place or tension.

The rock under a hand keeps its pose in W.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from msgspec import structs

from hand_models.base import InvalidInputError, Pose, turns_about
from hand_models.hand import Grasp
from planner.advice.changes import SETTINGS, Change, combined, hand_path, pose_message
from planner.prepare import PreparedStance, settle_each
from planner.question import HandOnHold, Question

__all__ = [
    "closings",
    "fingers",
    "grasps",
    "lettings",
    "placed",
    "turn_motions",
    "unseated",
    "variants",
    "way_motions",
]

_Motion = tuple[float, float, float]


def lettings(question: Question) -> Iterator[Change]:
    """Yield, for each hand, the change that releases this hand; nothing for a single hand."""
    hands = question.stance.hands
    for i, hand in enumerate(hands if len(hands) > 1 else ()):
        changes: dict[str, Any] = {hand_path(i): None}
        if hand.limb in question.present:
            changes[f"present.{hand.limb}"] = None
        if hand.limb in question.limits.per_hand:
            changes[f"limits.per_hand.{hand.limb}"] = None
        yield Change("let_go", (hand.limb,), f"release {hand.limb}", changes, SETTINGS.hand_size)


def grasps(prepared: PreparedStance, order: Sequence[int]) -> Iterator[Change]:
    """Yield changes of the outer fingers' rotation, for single hands and for all hands together.

    A hand that is seated automatically moves to the seat of its new grasp.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    order : sequence of int
        Indices of the hands to change, in this order.
    """
    hands = prepared.question.stance.hands
    found: dict[float, list[Change]] = {turn: [] for turn in SETTINGS.outer_turns}
    for i in order:
        for turn in _other_grasps(hands[i]):
            found[turn] += _grasped(prepared, i, turn)
    for turn, each in found.items():
        yield from each
        whole = combined(each) if len(each) > 1 else None
        if whole is not None:
            words = f"grasp with {fingers(turn)} at {', '.join(whole.limbs)}"
            yield whole._replace(kind="grasp", words=words)


def _other_grasps(hand: HandOnHold) -> list[float]:
    """Return turns of the outer fingers that are not the hand's; a fingernail has none [rad]."""
    if hand.grasp.fingernail:
        return []
    # within 0.05 rad it is the same grasp
    return [turn for turn in SETTINGS.outer_turns if abs(hand.grasp.outer_rotation - turn) > 0.05]


def variants(prepared: PreparedStance, index: int) -> Iterator[Change]:
    """Yield changes of one hand: other grasps, and moves and rotations along its palm.

    Rotations are multiples of 30° about z of hand frame H, each alone and with every other grasp.
    The rock keeps its pose in world frame W.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    index : int
        Index of the hand.
    """
    hand = prepared.question.stance.hands[index]
    yield from grasps(prepared, [index])
    yield from placed(prepared, index, way_motions())
    for turned in placed(
        prepared, index, turn_motions((30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180))
    ):
        yield turned
        for turn in _other_grasps(hand):
            yield Change(
                "place",
                turned.limbs,
                f"{turned.words} and grasp with {fingers(turn)}",
                {**turned.changes, hand_path(index, "grasp.outer_rotation"): turn},
                turned.size + abs(turn - hand.grasp.outer_rotation) / SETTINGS.outer_turn_unit,
            )


def closings(prepared: PreparedStance) -> Iterator[Change]:
    """Yield changes that close all hands with a closing tension of 20 N, and of 50 N.

    Yields nothing where a hand was placed by contact: it would come to rest elsewhere.
    """
    stance = prepared.question.stance
    if any(hand.contact_offset is not None for hand in stance.hands):
        return
    known = [hand.closing_tension for hand in prepared.batch.hands]
    for tension in (20.0, 50.0):  # [N] of all hands
        changes = {hand_path(i, "grasp.closing_tension"): tension for i in range(len(known))}
        size = sum(abs(tension - each) for each in known) / 10.0  # 10 N are of size 1
        limbs = tuple(hand.limb for hand in stance.hands)
        yield Change("grasp", limbs, f"close all hands with {tension:g} N", changes, size)


def fingers(turn: float) -> str:
    """Return words for a rotation of the outer fingers: ``the outer fingers at 90°``.

    Parameters
    ----------
    turn : float
        Rotation [rad].
    """
    return f"the outer fingers at {math.degrees(turn):.0f}°"


def _grasped(prepared: PreparedStance, index: int, turn: float) -> list[Change]:
    """Return one hand with another grasp, if its rock can stay where it is."""
    stance = prepared.question.stance
    hand, rock = stance.hands[index], rock_pose(prepared, index)
    grasp: Grasp = structs.replace(hand.grasp, outer_rotation=turn)
    size = abs(turn - hand.grasp.outer_rotation) / SETTINGS.outer_turn_unit
    changes: dict[str, Any] = {hand_path(index, "grasp.outer_rotation"): turn}
    words = f"grasp with {fingers(turn)} at {hand.limb}"
    if hand.placed_hold() is None:
        (there,) = settle_each(stance.robot.hand, [replace(hand, grasp=grasp)])
        if isinstance(there, InvalidInputError):
            return []
        pose = rock @ there.seating.pose.inverse()
        way = float(np.linalg.norm(pose.position - hand.pose.position))
        if way > 1e-3:  # [m]; less is not worth a word
            words += f", moved by {1e3 * way:.0f} mm"
        size += way / SETTINGS.way_unit
        moved = _moved(prepared, index, pose, seated=hand.at is None)
        if moved is None:
            return []
        changes |= moved
    elif hand.contact_offset is not None:
        moved = _moved(prepared, index, hand.pose)
        if moved is None:
            return []
        changes |= moved
    return [Change("grasp", (hand.limb,), words, changes, size)]


def placed(prepared: PreparedStance, index: int, motions: Sequence[_Motion]) -> Iterator[Change]:
    """Yield changes that move or rotate one hand along its palm; its rock stays.

    Yields nothing where the rock, a scan, has no frame that can be placed.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    index : int
        Index of the hand.
    motions : sequence of (float, float, float)
        Shift along x and y [m] and rotation about z [rad], in hand frame H.
    """
    hand = prepared.question.stance.hands[index]
    for x, y, turn in motions:
        motion = Pose(np.array([x, y, 0.0]), turns_about([0.0, 0.0, turn]))
        changes = _moved(prepared, index, hand.pose @ motion)
        if changes is None:
            return
        words = []
        if x or y:
            words.append(
                f"move {hand.limb} by [{1e3 * x:z.0f}, {1e3 * y:z.0f}] mm along x and y of its H"
            )
        if turn:
            whom = "it" if words else hand.limb
            words.append(f"rotate {whom} by {math.degrees(turn):.0f}° about z of its H")
        size = math.hypot(x, y) / SETTINGS.way_unit + abs(turn) / SETTINGS.turn_unit
        yield Change("place", (hand.limb,), " and ".join(words), changes, size)


def _moved(
    prepared: PreparedStance, index: int, pose: Pose, *, seated: bool = False
) -> dict[str, Any] | None:
    """Return what a question says of a hand elsewhere, whose rock stays; or which is seated there.

    None where its rock, a scan, has no frame of its own that can be placed.
    """
    stance = prepared.question.stance
    hand = stance.hands[index]
    changes: dict[str, Any] = {hand_path(index, "pose"): pose_message(pose)}
    if not seated:
        if hand.at is not None or hand.contact_offset is not None:
            try:
                hand.hold.check_place()
            except InvalidInputError:
                return None
            changes[hand_path(index, "place")] = None
        changes[hand_path(index, "hold.pose")] = pose_message(rock_pose(prepared, index))
        if hand.hold_in_hand is not None:
            changes[hand_path(index, "hold.pose_in_hand")] = None
        changes |= unseated(hand, index)
    if stance.joints is not None:
        changes["stance.joints"] = "solve"
    return changes


def way_motions() -> list[_Motion]:
    """Return shifts of a hand by 2 cm along ±x and ±y of H, as motions for `placed`."""
    return [(x, y, 0.0) for x, y in SETTINGS.palm_ways]


def turn_motions(turns: Sequence[float] = SETTINGS.palm_turns) -> list[_Motion]:
    """Return rotations of a hand about z of H, as motions for `placed`.

    Parameters
    ----------
    turns : sequence of float, optional
        Rotations [deg].
    """
    return [(0.0, 0.0, math.radians(turn)) for turn in turns]


def unseated(hand: HandOnHold, index: int) -> dict[str, Any]:
    """Return the changes of a question that leave out how a hand is seated, as it gets a pose.

    Parameters
    ----------
    hand : HandOnHold
        The hand in the question.
    index : int
        Index of the hand in the question.

    Returns
    -------
    dict of str to None
        Paths of the fields that are removed; see `planner.result.Advice`.
    """
    said = {"seat": hand.seat != "rest", "seat_direction": hand.seat_direction is not None}
    if hand.contact_offset is not None:
        # how such a hand was seated before it came to rest is not known here
        said = dict.fromkeys(("place", "seat", "seat_direction", "placing", "contact_offset"), True)
    return {hand_path(index, name): None for name, given in said.items() if given}


def rock_pose(prepared: PreparedStance, index: int) -> Pose:
    """Return the pose in W of the rock under a hand.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    index : int
        Index of the hand.
    """
    return prepared.question.stance.hands[index].pose @ prepared.batch.hands[index].seating.pose
