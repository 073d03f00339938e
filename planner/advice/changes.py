"""Changes of a question that an advice proposes, by paths of the request message and new values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
from msgspec import structs

from hand_models.base import InvalidInputError, Pose
from hand_models.tile import Surface
from planner.question import HandOnHold, Question
from planner.result import AdviceKind

__all__ = [
    "HAND_PATH",
    "SETTINGS",
    "AdviceSettings",
    "Change",
    "changed",
    "combined",
    "hand_path",
    "pose_message",
]

HAND_PATH: Final = re.compile(r"stance\.hands\[(\d+)\](?:\.(.+))?")
"""Pattern of the path of a hand, or of a hand's field; groups: index of the hand, field."""


@dataclass(frozen=True, slots=True)
class AdviceSettings:
    """Changes that are tried for advice, and the size of each kind of change that counts as 1."""

    plans: int = 100  # for the advice about a question, at most
    worse_tolerance: float = 1e-3  # [m], or without a unit: by how much what is odd may grow
    kinds_of_other_task: tuple[str, ...] = ("mass", "strength")  # no help, nor part of a pair
    outer_turns: tuple[float, ...] = (0.0, math.pi / 2.0, math.pi)  # [rad] of the outer fingers
    palm_turns: tuple[float, ...] = (30.0, -30.0, 60.0, -60.0)  # [deg] of a hand about z
    palm_ways: tuple[tuple[float, float], ...] = (  # [m] of a hand along x and y of its palm
        (0.02, 0.0),
        (-0.02, 0.0),
        (0.0, 0.02),
        (0.0, -0.02),
    )
    shift_gap: float = 2e-3  # of the best utilisation to its lower bound, relative
    least_shift: float = 1e-3  # [m] of the body that counts as one
    most_given: float = 1e3  # in parts of what is needed: more than any direction needs
    hands_apart: float = 0.25  # [m] of a new hold from other hands, at least
    quarter_turns: tuple[float, ...] = (0.0, math.pi / 2.0, -math.pi / 2.0, math.pi)
    """Rotations of a new hand relative to the hand that it copies, tried first [rad]."""
    strongest: float = 4.0  # times a hold's strength, at most
    share_step: float = 0.01  # [1] resolution of the factors of strength and mass
    strength_plans: int = 4  # to find a factor of strength, at most
    late: str = "all changes were tried"  # what a deadline leaves unfinished
    shift_unit: float = 0.1  # [m] of the body
    tilt_unit: float = 0.2  # [rad] of the body
    way_unit: float = 0.02  # [m] of a hand
    turn_unit: float = 0.5  # [rad] of a hand
    outer_turn_unit: float = math.pi / 2.0  # [rad] of the outer fingers
    hand_size: float = 2.0  # of a hand more or less
    strength_unit: float = math.log(1.1)  # of the logarithm of strength or mass


SETTINGS: Final = AdviceSettings()


class Change(NamedTuple):
    """Proposed change of a question; `planner.result.Advice` describes all fields.

    Attributes
    ----------
    kind : str
        Kind of the change, such as ``body`` or ``grasp``.
    limbs : tuple of str
        Limbs whose hands change.
    words : str
        What to do.
    changes : mapping of str to object
        New values of fields, by path in the request; None removes a field or a hand.
    size : float
        Size of the change, with `AdviceSettings` as units.
    """

    kind: AdviceKind
    limbs: tuple[str, ...]
    words: str
    changes: Mapping[str, Any]
    size: float


def _joined(first: Change, second: Change) -> Change | None:
    """Return both changes as a pair; None where they say different things of one field."""
    whole = dict(first.changes)
    for path, value in second.changes.items():
        if whole.setdefault(path, value) != value:
            return None
    hands = {path for path in whole if path.endswith("]") and whole[path] is None}
    if any(path.startswith(f"{hand}.") for hand in hands for path in whole):
        # of a hand that is let go
        return None
    limbs = tuple(dict.fromkeys(first.limbs + second.limbs))
    words = f"{first.words}; and {second.words}"
    return Change("pair", limbs, words, whole, first.size + second.size)


def combined(changes: Sequence[Change]) -> Change | None:
    """Return several changes as one.

    Parameters
    ----------
    changes : sequence of Change
        Changes to be made together.

    Returns
    -------
    Change or None
        A single change as given; of kind ``pair`` for two, ``combination`` for more. None if there
        are no changes, or two give different values to one field.
    """
    if not changes:
        return None
    free = [each for each in changes if each.kind == "free_hand"]
    new = [_further(each, k) for k, each in enumerate(free)]
    whole: Change | None
    whole, *others = [*(each for each in changes if each.kind != "free_hand"), *new]
    for each in others:
        whole = whole and _joined(whole, each)
    return whole if whole is None or len(changes) < 3 else whole._replace(kind="combination")


def _further(change: Change, count: int) -> Change:
    """Return a new hand as the one after so many others that are new."""
    hands = [HAND_PATH.fullmatch(path) for path in change.changes]
    moved = [
        path if hand is None else hand_path(int(hand[1]) + count, hand[2])
        for path, hand in zip(change.changes, hands, strict=True)
    ]
    return change._replace(changes=dict(zip(moved, change.changes.values(), strict=True)))


def pose_message(pose: Pose) -> dict[str, list[float]]:
    """Return a pose as in a request: ``position`` [m] and ``orientation`` (quaternion)."""
    return {"position": pose.position.tolist(), "orientation": pose.quaternion().tolist()}


def hand_path(index: int, field: str | None = None) -> str:
    """Return the path in a request of a hand, or of one of that hand's fields.

    Parameters
    ----------
    index : int
        Index of the hand.
    field : str, optional
        Field of the hand, such as ``grasp.outer_rotation``.
    """
    path = f"stance.hands[{index}]"
    return path if field is None else f"{path}.{field}"


def changed(question: Question, changes: Mapping[str, Any]) -> Question:
    """Return a question with some of its fields changed.

    Parameters
    ----------
    question : Question
        Question to be changed; it stays as it is.
    changes : mapping of str to object
        New values by path, as in `planner.result.Advice`.

    Raises
    ------
    InvalidInputError
        If the changed question is invalid, or a path is not one that advice can change.
    """
    hands: dict[int, dict[str | None, Any]] = {}
    stance: dict[str, Any] = {}
    whole: dict[str, Any] = {}
    for path, value in changes.items():
        hand = HAND_PATH.fullmatch(path)
        # said of a limb outside the stance
        named = re.fullmatch(r"(present|limits\.per_hand)\.(.+)", path)
        if hand is not None:
            hands.setdefault(int(hand[1]), {})[hand[2]] = value
        elif path == "stance.body":
            stance["body"] = _pose(value)
        elif path == "stance.joints":
            stance["joints"] = value
        elif path in ("load.mass", "load.com"):
            part = value if path == "load.mass" else tuple(value)
            whole["load"] = structs.replace(
                whole.get("load", question.load), **{path.removeprefix("load."): part}
            )
        elif named is not None and value is None:
            _drop(question, whole, *named.groups())
        else:
            raise InvalidInputError(
                "no advice changes this field; apply the changes that a plan's advice has",
                field=path,
            )
    there = _hands(question.stance.hands, hands)
    return replace(question, stance=replace(question.stance, hands=there, **stance), **whole)


def _drop(question: Question, whole: dict[str, Any], what: str, limb: str) -> None:
    """Leave out what is said of a limb: its present tensions, or its force's cap."""
    if what == "present":
        kept = whole.get("present", question.present)
        whole["present"] = {name: each for name, each in kept.items() if name != limb}
    else:
        limits = whole.get("limits", question.limits)
        caps = {name: each for name, each in limits.per_hand.items() if name != limb}
        whole["limits"] = structs.replace(limits, per_hand=caps)


def _hands(
    hands: tuple[HandOnHold, ...], changes: Mapping[int, Mapping[str | None, Any]]
) -> tuple[HandOnHold, ...]:
    """Return hands with new ones, and without those that are let go."""
    found = dict(enumerate(hands))
    for i in sorted(changes):
        fields = dict(changes[i])
        if None in fields and fields[None] is None:
            del found[i]
            continue
        like = fields.pop(None, hand_path(i))
        match = HAND_PATH.fullmatch(like)
        assert match is not None
        updates: dict[str, Any] = {}
        original = hands[int(match[1])]
        for field, value in fields.items():
            assert field is not None
            name, part = _field(original, updates, field, value)
            updates[name] = part
        found[i] = replace(original, **updates)
    return tuple(found.values())


def _field(hand: HandOnHold, updates: Mapping[str, Any], field: str, value: Any) -> tuple[str, Any]:
    """Return what a field of a hand's message is called here, and its value."""
    if field.startswith("grasp."):
        grasp = updates.get("grasp", hand.grasp)
        return "grasp", structs.replace(grasp, **{field.removeprefix("grasp."): value})
    if field not in HAND_FIELD_READERS:
        known = ", ".join(("grasp.*", *HAND_FIELD_READERS))
        raise InvalidInputError(
            f"no advice changes this field; known are {known}", field=f"stance.hands.{field}"
        )
    name, read = HAND_FIELD_READERS[field]
    if value is None:
        return name, "rest" if name == "seat" else None
    return name, read(value)


def _pose(message: Mapping[str, Any]) -> Pose:
    return Pose.from_quaternion(message["position"], message["orientation"])


HAND_FIELD_READERS: Final[Mapping[str, tuple[str, Callable[[Any], Any]]]] = {
    "limb": ("limb", str),
    "pose": ("pose", _pose),
    "place": ("at", _pose),
    "hold.pose": ("hold_pose", _pose),
    "hold.pose_in_hand": ("hold_in_hand", _pose),
    "surface": ("surface", Surface.from_values),
    "seat": ("seat", str),
    "seat_direction": ("seat_direction", np.array),
    "placing": ("contact_offset", _pose),
    "contact_offset": ("contact_offset", _pose),
    "wrench": ("wrench", tuple),
}
"""Fields of a hand's message, what they are called in `HandOnHold`, and how they are read."""
