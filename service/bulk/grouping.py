"""Which questions have hands on the same holds: these are answered together."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b
from typing import NamedTuple

import msgspec

from service.wire import Format, MalformedError

__all__ = ["About", "about", "grouped"]

NOTHING = msgspec.Raw(b"null")


class About(NamedTuple):
    """What must be prepared for a question, by digest.

    Attributes
    ----------
    rock : bytes
        Rocks and holds, wherever hands are on them.
    hands : bytes
        Hands and their poses on these.
    """

    rock: bytes = b""
    hands: bytes = b""


class _Hand(msgspec.Struct):
    hold: msgspec.Raw = NOTHING


class _Stance(msgspec.Struct):
    hands: list[msgspec.Raw] = []
    rocks: msgspec.Raw = NOTHING
    hand: msgspec.Raw = NOTHING


class _Request(msgspec.Struct):
    stance: _Stance


def about(payload: bytes, form: Format) -> About:
    """Return what a request is about, as it is written; nothing where it cannot be read."""
    try:
        stance = form.decode(payload, _Request).stance
        holds = [form.decode(bytes(hand), _Hand).hold for hand in stance.hands]
    except (MalformedError, msgspec.ValidationError):
        return About()
    return About(_digest(stance.rocks, *holds), _digest(stance.hand, *stance.hands))


def _digest(*parts: msgspec.Raw) -> bytes:
    found = blake2b(digest_size=8)
    for part in parts:
        found.update(part)
        found.update(b"\n")
    return found.digest()


def grouped(abouts: Sequence[About]) -> list[int]:
    """Return the indices of questions so that what is about the same stands together.

    Groups, and questions within them, stay in the order of their first ones.
    """
    rocks: dict[bytes, int] = {}
    hands: dict[About, int] = {}
    for i, each in enumerate(abouts):
        rocks.setdefault(each.rock, i)
        hands.setdefault(each, i)
    return sorted(range(len(abouts)), key=lambda i: (rocks[abouts[i].rock], hands[abouts[i]], i))
