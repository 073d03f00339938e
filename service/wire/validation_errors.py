"""From msgspec's complaint to the field to blame and what would be valid."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import islice
from typing import Any, Final, NamedTuple

import msgspec
from msgspec import inspect

__all__ = ["validation_error"]

WHERE: Final = re.compile(r" - at (?:`key` in )?`\$([^`]*)`$")
STEP: Final = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]|\[\.\.\.\]")
"""A field, an index, or what stands in msgspec's paths for a key that the caller chose."""

OF_FIELD: Final = re.compile(
    r"Object (?:missing required|contains (unknown)) field `(.*)`", re.DOTALL
)
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

Step = str | int | None
"""Of a path; None for a key that the caller chose."""

Decoder = Callable[[Any], object]

LONGEST: Final = 400
"""Characters of a message: it may quote the request."""


def validation_error(
    error: msgspec.ValidationError, kind: type, document: Callable[[], Any], decode: Decoder
) -> tuple[str | None, str]:
    """Return the field's dotted path, or None for the whole message, and one line about it.

    Parameters
    ----------
    error : msgspec.ValidationError
        From decoding a ``kind``.
    kind : type
        Message that was expected.
    document : callable
        Returns what was decoded, as plain lists and dicts, to look up keys that the caller chose;
        None where those are not known.
    decode : callable
        Decodes such a document, or a part of it, as the first one was; raises what that raised.
    """
    complaint, path = _parts(error)
    steps = _steps(path)
    places = list(_places_at(_known(kind), steps))
    types = [place.kind for place in places]
    field = _with_keys(path, steps, document, decode)
    if of_field := OF_FIELD.fullmatch(complaint):
        unknown, name = of_field.groups()
        field = f"{field}.{name}"
        known = ", ".join(_field_names(types))
        message = f"unknown field; known are {known}" if unknown else "missing"
    elif complaint.startswith(("Invalid value ", "Invalid enum value ")):
        value = complaint.partition("value ")[2]
        message = f"{_clip(value)} is not known; valid: {', '.join(_values(types))}"
    else:
        message = re.sub(r"`([^`]*)`", _plain, complaint)
        message = message[:1].lower() + message[1:]
        if OUT_OF_RANGE.search(complaint):
            message += _in_units(places)
    return _clip(field.removeprefix(".")) or None, _clip(message)


def _parts(error: msgspec.ValidationError) -> tuple[str, str]:
    """Return what msgspec complains of, and the path where."""
    text = str(error)
    found = WHERE.search(text)
    return (text, "") if found is None else (text[: found.start()], found[1])


def _steps(path: str) -> list[Step]:
    return [name or (int(index) if index else None) for name, index in STEP.findall(path)]


@cache
def _known(kind: type) -> inspect.Type:
    """Return what is known of a message, which takes milliseconds to find out."""
    return inspect.type_info(kind)


def _clip(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def _with_keys(
    path: str, steps: Sequence[Step], document: Callable[[], Any], decode: Decoder
) -> str:
    """Return a path with the keys that msgspec leaves open, if all of them can be told."""
    known: list[Step] = []
    for step in steps:
        try:
            known.append(_key_to_blame(document(), known, path, decode) if step is None else step)
        except (LookupError, TypeError, AttributeError, RecursionError):
            return path
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in known)


def _key_to_blame(document: Any, place: list[Step], path: str, decode: Decoder) -> str:
    """Return the key whose value is wrong in an object of a document.

    Values are read in order up to the first that is wrong, so it is the last of the shortest
    beginning of the object that is refused for the same field.

    Raises
    ------
    LookupError
        If none can be told.
    """
    whole = document
    for step in place:
        whole = whole[step]
    keys = list(whole)

    def refused(count: int) -> bool:
        try:
            decode(_beginning(document, place, count))
        except msgspec.ValidationError as error:
            return _parts(error)[1] == path
        return False

    return str(keys[bisect_left(range(1, len(keys) + 1), True, key=refused)])


def _beginning(document: Any, steps: Sequence[Step], count: int) -> Any:
    """Return a document with only the first few entries of the object at a place."""
    if not steps:
        return dict(islice(document.items(), count))
    copy = document.copy()
    copy[steps[0]] = _beginning(document[steps[0]], steps[1:], count)
    return copy


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


def _places_at(kind: inspect.Type, steps: Iterable[Step]) -> Iterable[_Place]:
    """Return what may stand at the end of a path."""
    places = list(_bare(kind))
    for step in steps:
        found: list[_Place] = []
        for place in places:
            parent = place.kind
            if isinstance(parent, inspect.StructType) and isinstance(step, str):
                fields = [f.type for f in parent.fields if f.encode_name == step]
                if not fields and parent.tag_field == step:
                    fields = [inspect.LiteralType((parent.tag,))]
                found += [bare for field in fields for bare in _bare(field)]
            elif isinstance(parent, inspect.ListType):
                found += _bare(parent.item_type, place.units)
            elif isinstance(parent, inspect.DictType) and step is None:
                found += _bare(parent.value_type, place.units)
            elif isinstance(parent, inspect.TupleType) and isinstance(step, int):
                items = parent.item_types
                for item in items[step : step + 1]:
                    found += _bare(item, _units_of(place.units, step, len(items)))
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
