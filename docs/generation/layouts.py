"""The page of messages byte by byte, for clients that write and read MessagePack by hand."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

__all__ = ["Item", "items", "layout_page"]

SHOWN: Final = {
    "plan-request": "A plan is asked for, with `detail` `set_points`",
    "plan-reply": "The plan",
    "set_points-request": "Set-points of a stream are asked for",
    "set_points-reply": "The set-points",
    "stream_wrench-wrench": "A body wrench is published on a stream",
    "stream_wrench-set_points": "Set-points are published for it",
}
"""Payloads that the page shows, by the names of their files, with a heading each."""

WIDTH: Final = 16
"""Bytes in a line."""

NUMBERS: Final = {
    **{0xCC: ">B", 0xCD: ">H", 0xCE: ">I", 0xCF: ">Q"},
    **{0xD0: ">b", 0xD1: ">h", 0xD2: ">i", 0xD3: ">q", 0xCB: ">d"},
}
"""Format in `struct` of a number after each of MessagePack's first bytes."""

PLAIN: Final = {0xC0: None, 0xC2: False, 0xC3: True}
"""Values that are one byte."""

COUNTS: Final = {0xD9: ">B", 0xDA: ">H", 0xDB: ">I", 0xDC: ">H", 0xDD: ">I", 0xDE: ">H", 0xDF: ">I"}
"""Format of the count after the first byte of a long text, array or map."""


class Item(NamedTuple):
    """Value of a message, with its name, or the head of an array or a map.

    Attributes
    ----------
    start, end : int
        Offsets of its first byte, the name's if it has one, and of the byte after its last.
    path : str
        Path of the value in the message, such as ``hands[0].tensions[2]``.
    words : str
        What the bytes are, for a reader.
    value : object
        The value; of an array or a map its number of entries.
    """

    start: int
    end: int
    path: str
    words: str
    value: object


def items(payload: bytes) -> list[Item]:
    """Return all values of a message in MessagePack, in the order of their bytes."""
    found: list[Item] = []
    _walk(payload, 0, 0, "", found)
    return found


def _walk(payload: bytes, start: int, at: int, path: str, found: list[Item]) -> int:
    """Add the value at an offset, whose name begins at ``start``; return where it ends."""
    kind, count, end = _head(payload, at)
    if kind == "map":
        found.append(Item(start, end, path, f"map of {count}", count))
        for _ in range(count):
            _, size, begins = _head(payload, end)
            name = payload[begins : begins + size].decode()
            inner = f"{path}.{name}" if path else name
            end = _walk(payload, end, begins + size, inner, found)
    elif kind == "array":
        found.append(Item(start, end, path, f"array of {count}", count))
        for index in range(count):
            end = _walk(payload, end, end, f"{path}[{index}]", found)
    elif kind == "text":
        text = payload[end : end + count].decode()
        end += count
        found.append(Item(start, end, path, f'text "{text}"', text))
    else:
        value: object = PLAIN.get(payload[at], count)
        if payload[at] in NUMBERS:
            form = NUMBERS[payload[at]]
            (value,) = struct.unpack_from(form, payload, at + 1)
        named = {None: "nil", True: "true", False: "false"}
        words = named[PLAIN[payload[at]]] if payload[at] in PLAIN else f"{kind} {value:g}"
        found.append(Item(start, end, path, words, value))
    return end


def _head(payload: bytes, at: int) -> tuple[str, int, int]:
    """Return kind, count or small integer, and end of the head of the value at an offset."""
    byte = payload[at]
    for least, most, mask, kind in (
        (0x80, 0x8F, 0x0F, "map"),
        (0x90, 0x9F, 0x0F, "array"),
        (0xA0, 0xBF, 0x1F, "text"),
        (0x00, 0x7F, 0x7F, "integer"),
    ):
        if least <= byte <= most:
            return kind, byte & mask, at + 1
    if byte >= 0xE0:
        return "integer", byte - 0x100, at + 1
    if byte in PLAIN:
        return "plain", 0, at + 1
    if byte in NUMBERS:
        kind = "float64" if byte == 0xCB else "integer"
        return kind, 0, at + 1 + struct.calcsize(NUMBERS[byte])
    if byte in COUNTS:
        (count,) = struct.unpack_from(COUNTS[byte], payload, at + 1)
        kind = "text" if byte <= 0xDB else "array" if byte <= 0xDD else "map"
        return kind, count, at + 1 + struct.calcsize(COUNTS[byte])
    raise ValueError(f"byte {byte:#04x} at {at} begins nothing that crux sends")


def layout_page(pages: Mapping[str, bytes]) -> str:
    """Return the page.

    Parameters
    ----------
    pages : dict of str to bytes
        Generated files, the payloads ``bytes/<name>.msgpack`` among them.
    """
    text = [BEGINNING]
    for name, heading in SHOWN.items():
        payload = pages[f"bytes/{name}.msgpack"]
        lines = "\n".join(_lines(payload))
        text += [
            f"## {heading}\n",
            f"{len(payload):,} bytes ({{download}}`download <bytes/{name}.msgpack>`):\n",
            f"```{{code-block}} text\n:class: bytes\n{lines}\n```\n",
        ]
    return "\n".join(text)


def _lines(payload: bytes) -> Iterator[str]:
    """Yield a line for each value; of arrays of maps, only the first map."""
    left_out, size, first = "", 0, 0
    for item in items(payload):
        if _is_later(item.path):
            if not left_out:
                left_out, first = item.path, item.start
            size = item.end - first
            continue
        if left_out:
            yield f"{first:06x}  … {left_out} and further ones, {size:,} bytes, as the first"
            left_out = ""
        yield from _dumped(payload, item)
    if left_out:
        yield f"{first:06x}  … {left_out} and further ones, {size:,} bytes, as the first"


def _is_later(path: str) -> bool:
    """Return whether a value belongs to a hand that is not the first."""
    return "hands[" in path and "hands[0]" not in path


def _dumped(payload: bytes, item: Item) -> Iterator[str]:
    words = f"{item.path}: {item.words}" if item.path else item.words
    for begin in range(item.start, item.end, WIDTH):
        part = payload[begin : min(begin + WIDTH, item.end)]
        yield f"{begin:06x}  {part.hex(' '):<47}  {words}".rstrip()
        words = ""


BEGINNING = """# Messages byte by byte

What real messages in MessagePack are made of. The name of a field stands before its value, in one
line with it. Of hands, the first one is shown. [The bytes of messages](../bytes.md) has the rules.
"""
