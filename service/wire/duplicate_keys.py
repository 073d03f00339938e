"""Refuse requests in which an object has the same key twice; a decoder would keep only the last."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import msgspec

from service.wire.errors import MalformedError

__all__ = ["refuse_in_json", "refuse_in_msgpack"]


def refuse_in_json(payload: bytes) -> None:
    """Raise an error if an object in a JSON payload has the same key twice.

    Parameters
    ----------
    payload : bytes
        JSON that has been decoded without an error.

    Raises
    ------
    MalformedError
        If a key is repeated; the error's ``field`` is the path of the key.
    """
    # a long list of numbers, or of lists of them, as an object's value, has no keys
    long_list = rb":[ \t\n\r]*\[[-+0-9.eE,\[\] \t\n\r]{1000,}\](?=[ \t\n\r]*[,}])"
    short = re.sub(long_list, b":[]", payload) if _is_long(payload) else payload
    found: list[_Repeated] = []
    # numbers stay text, also those of thousands of digits
    read = json.JSONDecoder(
        object_pairs_hook=partial(_object, found), parse_int=str, parse_float=str, strict=False
    ).decode
    try:
        document = read(short.decode())
    except ValueError:
        document = read(payload.decode())
    if found:
        _refuse(document, "")


def refuse_in_msgpack(payload: bytes) -> None:
    """Raise an error if a map in a MessagePack payload has the same key twice.

    Parameters
    ----------
    payload : bytes
        MessagePack that has been decoded without an error.

    Raises
    ------
    MalformedError
        If a key is repeated; the error's ``field`` is the path of the key.
    """
    if not _is_long(payload):
        again = msgspec.msgpack.encode(msgspec.msgpack.decode(payload))
        if again == payload:
            return
    found: list[_Repeated] = []
    document = _maps(payload, found)
    if found:
        _refuse(document, "")


class _Repeated(dict[str, Any]):
    """Object that has a key twice."""

    key: str


def _object(found: list[_Repeated], pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of these keys and values; one with a key twice is added to ``found``."""
    whole = dict(pairs)
    if len(whole) < len(pairs):
        whole = _Repeated(whole)
        known: set[str] = set()
        for whole.key, _ in pairs:
            if whole.key in known:
                break
            known.add(whole.key)
        found.append(whole)
    return whole


def _refuse(document: Any, path: str) -> None:
    """Refuse a document in which an object has a key twice."""
    if isinstance(document, _Repeated):
        key = document.key
        raise MalformedError(
            f"the key {key[:80]!r} is given twice; remove one",
            field=f"{path}.{key}".removeprefix("."),
        )
    if isinstance(document, dict):
        for key, part in document.items():
            _refuse(part, f"{path}.{key}")
    elif isinstance(document, list):
        for i, part in enumerate(document):
            _refuse(part, f"{path}[{i}]")


def _is_long(payload: bytes) -> bool:
    """Return whether a payload is so large that its long lists of numbers are skipped."""
    return len(payload) > 2**16


def _is_map(first: int) -> bool:
    """Return whether a map of MessagePack begins with this byte."""
    return first >> 4 == 0x8 or first in {0xDE, 0xDF}


def _maps(value: bytes, found: list[_Repeated]) -> Any:
    """Return a map, or a list whose first item is a map, with the maps in it; None otherwise."""
    if _is_map(value[0]):
        parts = _parts(value, 2)
        pairs = zip(parts, parts, strict=True)
        return _object(
            found, [(str(msgspec.msgpack.decode(key)), _maps(part, found)) for key, part in pairs]
        )
    # the first bytes of lists
    if value[0] >> 4 == 0x9 or value[0] in {0xDC, 0xDD}:
        head, count = _header(value)
        if count and _is_map(value[head]):
            return [_maps(part, found) for part in _parts(value, 1)]
    return None


def _parts(value: bytes, each: int) -> Iterator[bytes]:
    """Yield the items of a list, or with ``each`` of 2 a map's keys and values in turn."""
    head, count = _header(value)
    as_list = b"\xdd" + (each * count).to_bytes(4, "big") + value[head:]
    return map(bytes, msgspec.msgpack.decode(as_list, type=list[msgspec.Raw]))


def _header(value: bytes) -> tuple[int, int]:
    """Return the bytes before the items of a map or a list, and the number of items."""
    match value[0]:
        case 0xDC | 0xDE:
            size = 2
        case 0xDD | 0xDF:
            size = 4
        case short:
            return 1, short & 0x0F
    return 1 + size, int.from_bytes(value[1 : 1 + size], "big")
