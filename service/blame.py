"""From msgspec's complaint to the field to blame and what would be valid."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

import msgspec
from msgspec import inspect

__all__ = ["blame"]

WHERE: Final = re.compile(r" - at (?:`key` in )?`\$([^`]*)`$")
STEP: Final = re.compile(r"\.([^.\[\]]+)|\[([^\]]*)\]")
WORDS: Final = {
    "float": "a number",
    "int": "a whole number",
    "str": "a string",
    "bool": "true or false",
    "array": "a list",
    "object": "an object",
    "null": "null",
}
LONGEST: Final = 400
"""Characters of a message: it may quote the request."""


def blame(error: msgspec.ValidationError, kind: type) -> tuple[str | None, str]:
    """Return the field's dotted path, or None for the whole message, and one line about it.

    Parameters
    ----------
    error : msgspec.ValidationError
        From decoding a ``kind``.
    kind : type
        Message that was expected.
    """
    text = str(error)
    found = WHERE.search(text)
    path = found.group(1) if found else ""
    complaint = text[: found.start()] if found else text
    types = list(_types_at(inspect.type_info(kind), path))
    field = path.removeprefix(".")

    name = re.search(r"`(.*)`$", complaint, re.DOTALL)
    if complaint.startswith("Object missing required field") and name:
        field = f"{field}.{name[1]}" if field else name[1]
        message = "missing"
    elif complaint.startswith("Object contains unknown field") and name:
        field = f"{field}.{name[1]}" if field else name[1]
        message = f"unknown field; known are {', '.join(_field_names(types))}"
    elif complaint.startswith(("Invalid value ", "Invalid enum value ")):
        value = complaint.partition("value ")[2]
        message = f"{_clip(value)} is not known; valid: {', '.join(_values(types))}"
    else:
        message = re.sub(r"`([^`]*)`", _plain, complaint)
        message = message[:1].lower() + message[1:]
    return _clip(field) or None, _clip(message)


def _clip(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def _plain(match: re.Match[str]) -> str:
    return " or ".join(WORDS.get(word, word) for word in match[1].split(" | "))


def _bare(kind: inspect.Type) -> Iterator[inspect.Type]:
    """Yield a type without its metadata, and each member of a union."""
    if isinstance(kind, inspect.Metadata):
        yield from _bare(kind.type)
    elif isinstance(kind, inspect.UnionType):
        for member in kind.types:
            yield from _bare(member)
    else:
        yield kind


def _types_at(kind: inspect.Type, path: str) -> Iterable[inspect.Type]:
    """Return the types that the end of a path may have."""
    types = list(_bare(kind))
    for name, index in STEP.findall(path):
        found: list[inspect.Type] = []
        for parent in types:
            if isinstance(parent, inspect.StructType) and name:
                fields = [f.type for f in parent.fields if f.encode_name == name]
                if not fields and parent.tag_field == name:
                    fields = [inspect.LiteralType((parent.tag,))]
                found += fields
            elif isinstance(parent, inspect.ListType):
                found.append(parent.item_type)
            elif isinstance(parent, inspect.TupleType) and index.isdigit():
                found += parent.item_types[int(index) : int(index) + 1]
        types = [bare for one in found for bare in _bare(one)]
    return types


def _field_names(types: Iterable[inspect.Type]) -> list[str]:
    """Return the fields of the structs that may be meant, each once."""
    names = [
        name
        for kind in types
        if isinstance(kind, inspect.StructType)
        for name in (*([kind.tag_field] if kind.tag_field else []), *(f.name for f in kind.fields))
    ]
    return list(dict.fromkeys(names))


def _values(types: Iterable[inspect.Type]) -> list[str]:
    return [
        str(value)
        for kind in types
        if isinstance(kind, inspect.LiteralType)
        for value in kind.values
    ]
