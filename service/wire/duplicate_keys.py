"""Keys that an object has twice, of which a decoder would take the last without a word."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, Final

import msgspec

from service.wire.errors import MalformedError

__all__ = ["refuse_in_json", "refuse_in_msgpack"]

LONG: Final = 2**16
"""Bytes of a payload from which on its long lists of numbers are left out."""

BULK: Final = re.compile(rb":[ \t\n\r]*\[[-+0-9.eE,\[\] \t\n\r]{1000,}\](?=[ \t\n\r]*[,}])")
"""A long list of numbers, or of lists of them, as an object's value."""

MAPS: Final = frozenset({*range(0x80, 0x90), 0xDE, 0xDF})
LISTS: Final = frozenset({*range(0x90, 0xA0), 0xDC, 0xDD})
LENGTHS: Final = {0xDC: 2, 0xDD: 4, 0xDE: 2, 0xDF: 4}
"""First bytes of MessagePack's maps and lists; of long ones, in how many bytes their length is."""


def refuse_in_json(payload: bytes) -> None:
    """Refuse a payload that has been decoded, if an object in it has a key twice.

    Raises
    ------
    MalformedError
        With the key's path.
    """
    short = BULK.sub(b":[]", payload) if len(payload) > LONG else payload
    known: list[_Repeated] = []

    def kept(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        whole = dict(pairs)
        if len(whole) == len(pairs):
            return whole
        known.append(_Repeated(pairs))
        return known[-1]

    # numbers stay text: those of thousands of digits, too
    read = json.JSONDecoder(
        object_pairs_hook=kept, parse_int=str, parse_float=str, strict=False
    ).decode
    try:
        document = read(short.decode())
    except ValueError:
        document = read(payload.decode())
    if known:
        path, first = next(_repeated(document, ""))
        raise _twice(path, first.key)


class _Repeated(dict[str, Any]):
    """An object that has a key twice.

    Attributes
    ----------
    key : str
        The first such.
    """

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__()
        names = iter(pairs)
        for self.key, value in names:
            if self.key in self:
                break
            self[self.key] = value
        self.update(names)


def _repeated(document: Any, path: str) -> Iterator[tuple[str, _Repeated]]:
    """Yield the objects that have a key twice, and where they are."""
    if isinstance(document, _Repeated):
        yield path, document
    if isinstance(document, dict):
        for key, part in document.items():
            yield from _repeated(part, f"{path}.{key}")
    elif isinstance(document, list):
        for i, part in enumerate(document):
            yield from _repeated(part, f"{path}[{i}]")


def refuse_in_msgpack(payload: bytes) -> None:
    """Refuse a payload that has been decoded, if a map in it has a key twice.

    Raises
    ------
    MalformedError
        With the key's path.
    """
    if len(payload) <= LONG:
        again = msgspec.msgpack.encode(msgspec.msgpack.decode(payload))
        if again == payload:
            return
    _look(payload, "")


def _look(value: bytes, path: str) -> None:
    """Look into a map, and into a list whose first item is one."""
    if value[0] in MAPS:
        keys, parts = set(), _parts(value, 2)
        for key, part in zip(parts, parts, strict=True):
            name = msgspec.msgpack.decode(key)
            if name in keys:
                raise _twice(path, str(name))
            keys.add(name)
            _look(part, f"{path}.{name}")
    elif value[0] in LISTS:
        head, count = _header(value)
        if count and value[head] in MAPS:
            for i, part in enumerate(_parts(value, 1)):
                _look(part, f"{path}[{i}]")


def _parts(value: bytes, each: int) -> Iterator[bytes]:
    """Yield what is in a list, or with two of ``each`` a map's keys and values in turn."""
    head, count = _header(value)
    as_list = b"\xdd" + (each * count).to_bytes(4, "big") + value[head:]
    return map(bytes, msgspec.msgpack.decode(as_list, type=list[msgspec.Raw]))


def _header(value: bytes) -> tuple[int, int]:
    """Return how many bytes come before the items of a map or a list, and how many items it has."""
    size = LENGTHS.get(value[0])
    if size is None:
        return 1, value[0] & 0x0F
    return 1 + size, int.from_bytes(value[1 : 1 + size], "big")


def _twice(path: str, key: str) -> MalformedError:
    return MalformedError(
        f"the key {key[:80]!r} is given twice", field=f"{path}.{key}".removeprefix(".")
    )
