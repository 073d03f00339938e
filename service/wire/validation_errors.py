"""From msgspec's complaint to the field to blame and what would be valid."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from itertools import islice
from typing import Any, Final, NamedTuple

import msgspec
from msgspec import inspect

__all__ = ["leaves_open", "validation_error"]

WHERE: Final = re.compile(r" - at (?:`key` in )?`\$([^`]*)`$")
ANY_KEY: Final = "[...]"
"""What stands in msgspec's paths for a key that the caller chose."""

STEP: Final = re.compile(r"\.([^.\[\]]+)|\[([^\]]*)\]")
WORDS: Final = {
    "float": "a number",
    "int": "a whole number",
    "str": "a string",
    "bool": "true or false",
    "array": "a list",
    "object": "an object",
    "null": "null",
    "None": "null",
}
OUT_OF_RANGE: Final = re.compile(r"^Expected `(?:float|int)[^`]*` [<>]")
SYMBOL: Final = r"(?:kg|rad|[Nms·/²])+"
UNITS: Final = re.compile(rf"\[({SYMBOL}(?:, {SYMBOL})*)\]")
"""Where a description says its units: one, or two of a wrench, forces first."""

Decoder = Callable[[Any], object]

LONGEST: Final = 400
"""Characters of a message: it may quote the request."""


def validation_error(
    error: msgspec.ValidationError, kind: type, document: Any, decode: Decoder
) -> tuple[str | None, str]:
    """Return the field's dotted path, or None for the whole message, and one line about it.

    Parameters
    ----------
    error : msgspec.ValidationError
        From decoding a ``kind``.
    kind : type
        Message that was expected.
    document : object
        What was decoded, as plain lists and dicts, to look up keys that the caller chose; None
        where those are not known.
    decode : callable
        Decodes such a document, or a part of it, as the first one was; raises what that raised.
    """
    text = str(error)
    found = WHERE.search(text)
    path = found.group(1) if found else ""
    complaint = text[: found.start()] if found else text
    places = list(_places_at(_known(kind), path))
    types = [place.kind for place in places]
    field = _with_keys(path, document, decode).removeprefix(".")

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
        if OUT_OF_RANGE.search(complaint):
            message += _in_units(places)
    return _clip(field) or None, _clip(message)


@cache
def _known(kind: type) -> inspect.Type:
    """Return what is known of a message, which takes milliseconds to find out."""
    return inspect.type_info(kind)


def leaves_open(error: msgspec.ValidationError) -> bool:
    """Say whether an error names its field but for a key that the caller chose."""
    return ANY_KEY in str(error)


def _clip(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def _with_keys(path: str, document: Any, decode: Decoder) -> str:
    """Return a path with the keys that msgspec leaves open."""
    first, *others = path.split(ANY_KEY)
    text, steps = first, _steps(first)
    for part in others:
        key = _key_to_blame(steps, path, document, decode)
        if key is None:
            return path
        text += f".{key}{part}"
        steps += [key, *_steps(part)]
    return text


def _steps(path: str) -> list[str | int]:
    return [name or int(index) for name, index in STEP.findall(path)]


def _key_to_blame(place: list[str | int], path: str, document: Any, decode: Decoder) -> str | None:
    """Return the key whose value is wrong in an object of a document; None if none can be told.

    Values are read in order up to the first that is wrong, so it is the last of the shortest
    beginning of the object that is refused for the same field.
    """
    try:
        keys = list(_at(document, place))
        few, many = 0, len(keys)
        if not _refused(document, path, decode):
            return None
        while many - few > 1:
            middle = (few + many) // 2
            if _refused(_beginning(document, place, middle), path, decode):
                many = middle
            else:
                few = middle
        return str(keys[few])
    except (LookupError, TypeError, AttributeError, RecursionError):
        return None


def _at(document: Any, steps: list[str | int]) -> Any:
    for step in steps:
        document = document[step]
    return document


def _beginning(document: Any, steps: list[str | int], count: int) -> Any:
    """Return a document with only the first few entries of the object at a place."""
    if not steps:
        return dict(islice(document.items(), count))
    copy = document.copy()
    copy[steps[0]] = _beginning(document[steps[0]], steps[1:], count)
    return copy


def _refused(document: Any, path: str, decode: Decoder) -> bool:
    """Say whether a document is refused for the field of that path."""
    try:
        decode(document)
    except msgspec.ValidationError as error:
        found = WHERE.search(str(error))
        return found is not None and found.group(1) == path
    return False


def _plain(match: re.Match[str]) -> str:
    return " or ".join(WORDS.get(word, word) for word in match[1].split(" | "))


class _Place(NamedTuple):
    """What may stand at a place: a type without its metadata, and the units of its numbers."""

    kind: inspect.Type
    units: tuple[str, ...]


def _bare(kind: inspect.Type, units: tuple[str, ...] = ()) -> Iterator[_Place]:
    """Yield a type without its metadata, and each member of a union."""
    if isinstance(kind, inspect.Metadata):
        found = UNITS.findall((kind.extra_json_schema or {}).get("description", ""))
        yield from _bare(kind.type, tuple(found[-1].split(", ")) if found else units)
    elif isinstance(kind, inspect.UnionType):
        for member in kind.types:
            yield from _bare(member, units)
    else:
        yield _Place(kind, units)


def _places_at(kind: inspect.Type, path: str) -> Iterable[_Place]:
    """Return what may stand at the end of a path."""
    places = list(_bare(kind))
    for name, index in STEP.findall(path):
        found: list[_Place] = []
        for place in places:
            parent = place.kind
            if isinstance(parent, inspect.StructType) and name:
                fields = [f.type for f in parent.fields if f.encode_name == name]
                if not fields and parent.tag_field == name:
                    fields = [inspect.LiteralType((parent.tag,))]
                found += [bare for field in fields for bare in _bare(field)]
            elif isinstance(parent, inspect.ListType):
                found += _bare(parent.item_type, place.units)
            elif isinstance(parent, inspect.DictType) and f"[{index}]" == ANY_KEY:
                found += _bare(parent.value_type, place.units)
            elif isinstance(parent, inspect.TupleType) and index.isdigit():
                entry, items = int(index), parent.item_types
                for item in items[entry : entry + 1]:
                    found += _bare(item, _units_of(place.units, entry, len(items)))
        places = found
    return places


def _units_of(units: tuple[str, ...], entry: int, length: int) -> tuple[str, ...]:
    """Return the units of one entry of a whole that has one unit, or two of equal halves."""
    which = entry * len(units) // length
    return units[which : which + 1]


def _in_units(places: Iterable[_Place]) -> str:
    """Say what unit a number at these places has, if they agree on one."""
    numbers = (inspect.FloatType, inspect.IntType)
    units = {place.units for place in places if isinstance(place.kind, numbers)}
    (first, *others) = units or {()}
    return f", in {first[0]}" if len(first) == 1 and not others else ""


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
