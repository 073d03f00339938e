"""Convert a validation error of msgspec into a field path and a message with valid values."""

from __future__ import annotations

import math
import re
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import islice
from typing import Any, NamedTuple

import msgspec
from msgspec import inspect

from hand_models.base import InvalidInputError
from service.requests import Later

__all__ = [
    "PossibleType",
    "Step",
    "dotted",
    "entered",
    "field_names",
    "places_at",
    "validation_error",
]

Step = str | int | None
"""Step of a path: a field name, an index, or None for a key of a dict, which the client chooses."""

Decoder = Callable[[Any], object]


def validation_error(
    error: msgspec.ValidationError, kind: type, document: Callable[[], Any], decode: Decoder
) -> tuple[str | None, str]:
    """Convert a validation error of msgspec into a field path and an error message.

    Parameters
    ----------
    error : msgspec.ValidationError
        Error from decoding a message.
    kind : type
        Message type that was expected.
    document : callable
        Returns the message as plain lists and dicts, in which keys of dicts are looked up; or None
        if the message cannot be decoded at all.
    decode : callable
        Validates plain lists and dicts as the message type; raises `msgspec.ValidationError`.

    Returns
    -------
    field : str or None
        Path of the field that is to blame, with dots and indices; None for the whole message.
    message : str
        One line; where possible with the valid values, and with the value that was given.
    """
    complaint, path = _parts(error)
    steps = _steps(path)
    places = places_at(kind, steps)
    types = [place.kind for place in places]
    where = _with_keys(path, steps, document, decode)
    field = path if where is None else dotted(where)
    cause = error.__cause__
    if isinstance(cause, InvalidInputError):
        cause = cause.within(field.removeprefix("."))
        return cause.field, cause.message
    if of_field := re.fullmatch(
        r"Object (?:missing required|contains (unknown)) field `(.*)`", complaint, re.DOTALL
    ):
        unknown, name = of_field.groups()
        field = f"{field}.{name}"
        only = _values(place.kind for place in entered(places, name))
        message = f"missing; valid: {', '.join(only)}" if only and not unknown else "missing"
        if unknown:
            known = field_names(types if where is None else _tagged(types, document(), where))
            message = f"unknown field; known are {', '.join(known)}"
    elif complaint.startswith(("Invalid value ", "Invalid enum value ")):
        value = complaint.partition("value ")[2]
        valid = _values(types)
        if any(isinstance(kind, inspect.DictType | inspect.StructType) for kind in types):
            valid.append("an object")
        message = f"{_clip(value)} is not known; valid: {', '.join(valid)}"
    else:
        message = re.sub(r"`([^`]*)`", _plain, complaint)
        message = message[:1].lower() + message[1:]
        if re.search(r"^Expected `(?:float|int)[^`]*` [<>]", complaint):
            # print a bound such as π with 6 digits, not with all digits of a double
            message = re.sub(r"\d+\.\d{6,}", lambda number: f"{float(number[0]):.6g}", message)
            unit = _unit_of(places)
            bound = float(complaint.rpartition(" ")[2].rstrip("`"))
            message += f", in {unit}" if unit else ""
            message += _got(document, where, unit, bound)
        elif complaint.startswith("Expected `object`, got") and (known := field_names(types)):
            message += f"; an object with {', '.join(known)} is wanted"
        elif where is not None and re.fullmatch(
            r"Expected `(?:array|str|object)` of length [<>= ]*\d+", complaint
        ):
            given = _given(document, where)
            if isinstance(given, list | str | dict):
                message += f", got length {len(given)}"
    return _clip(field.removeprefix(".")) or None, _clip(message)


def _parts(error: msgspec.ValidationError) -> tuple[str, str]:
    """Return msgspec's error message, and the path of the error."""
    text = str(error)
    found = re.search(r" - at (?:`key` in )?`\$([^`]*)`$", text)
    return (text, "") if found is None else (text[: found.start()], found[1])


def _steps(path: str) -> list[Step]:
    # a field, an index, or msgspec's mark for a key that the caller chose
    found = re.findall(r"\.([^.\[\]]+)|\[(\d+)\]|\[\.\.\.\]", path)
    return [name or (int(index) if index else None) for name, index in found]


def _clip(text: str) -> str:
    # a message may quote the request
    longest = 400
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def _with_keys(
    path: str, steps: Sequence[Step], document: Callable[[], Any], decode: Decoder
) -> list[str | int] | None:
    """Return the steps of a path with the keys that msgspec leaves open, if all can be found."""
    known: list[str | int] = []
    for step in steps:
        try:
            known.append(_key_to_blame(document(), known, path, decode) if step is None else step)
        except (LookupError, TypeError, AttributeError, RecursionError):
            return None
    return known


def dotted(steps: Iterable[str | int]) -> str:
    """Return the steps of a path as the field of an error has them, after a dot."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)


def _tagged(
    types: list[inspect.Type], document: Any, steps: Iterable[str | int]
) -> list[inspect.Type]:
    """Return the types that an object of a document names by its tag; all if it names none."""
    try:
        given = _at(document, steps)
        named: list[inspect.Type] = [
            kind
            for kind in types
            if isinstance(kind, inspect.StructType) and given.get(kind.tag_field) == kind.tag
        ]
    except (LookupError, TypeError, AttributeError):
        return types
    return named or types


def _at(document: Any, steps: Iterable[str | int]) -> Any:
    for step in steps:
        document = document[step]
    return document


def _key_to_blame(document: Any, place: Sequence[str | int], path: str, decode: Decoder) -> str:
    """Return the key whose value is wrong in an object of a document.

    Values are read in order up to the first that is wrong, so it is the last of the shortest
    beginning of the object that is refused for the same field.

    Raises
    ------
    LookupError
        If none can be found.
    """
    keys = list(_at(document, place))

    def refused(count: int) -> bool:
        try:
            decode(_beginning(document, place, count))
        except msgspec.ValidationError as error:
            return _parts(error)[1] == path
        return False

    return str(keys[bisect_left(range(1, len(keys) + 1), True, key=refused)])


def _beginning(document: Any, steps: Sequence[str | int], count: int) -> Any:
    """Return a document with only the first few entries of the object at a place."""
    if not steps:
        return dict(islice(document.items(), count))
    copy = document.copy()
    copy[steps[0]] = _beginning(document[steps[0]], steps[1:], count)
    return copy


def _plain(match: re.Match[str]) -> str:
    words = {
        "float": "a number",
        "int": "a whole number",
        "str": "a string",
        "bool": "true or false",
        "array": "a list",
        "object": "an object",
        "None": "null",
    }
    return " or ".join(words.get(word, word) for word in match[1].split(" | "))


def _unit_of(places: Iterable[PossibleType]) -> str | None:
    """Return the unit that a number at these places has, if they agree on one."""
    numbers = (inspect.FloatType, inspect.IntType)
    units = {place.units for place in places if isinstance(place.kind, numbers)}
    (first, *others) = units or {()}
    return first[0] if len(first) == 1 and not others else None


def _given(document: Callable[[], Any], where: Iterable[str | int]) -> Any:
    """Return the value of a document at a place; None if there is none."""
    try:
        return _at(document(), where)
    except (LookupError, TypeError, AttributeError, RecursionError):
        return None


def _got(
    document: Callable[[], Any], where: Iterable[str | int] | None, unit: str | None, bound: float
) -> str:
    """Return the number that is beyond a bound, and the unit that it is likely to be in."""
    value = None if where is None else _given(document, where)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    if isinstance(value, int) and value.bit_length() > sys.float_info.max_exp:
        return ", got an integer beyond all floats"
    # sizes from which a number is likely to be in degrees, in mm, or in map coordinates
    circle, many, farthest = 360.0, 10.0, 1e4
    asked = ""
    if unit == "rad" and abs(value) <= circle:
        asked = f"; in degrees? {value:g}° are {math.radians(value):.4g} rad"
    elif unit == "m" and abs(value) > farthest:
        asked = (
            "; in map coordinates or mm? The stance's world may begin anywhere: subtract one "
            "offset from all its positions"
        )
    elif unit == "m" and abs(value) >= many:
        asked = "; in mm?"
    elif unit is None and bound == 1.0 and 1.0 < value <= 100.0:  # of a share, a percentage
        asked = f"; in %? {value:g} % are {value / 100.0:g}"
    elif other := _other_unit(value, unit, bound):
        asked = f"; in {other}?"
    return f", got {value:.10g}{asked}"


def _other_unit(value: float, unit: str | None, bound: float) -> str | None:
    """Return another unit in which a number that is beyond a bound would be within it."""
    other, factor = {
        "m": ("mm", 1e-3),
        "kg": ("g", 1e-3),
        "m/s²": ("mm/s²", 1e-3),
        "N·m": ("N·mm", 1e-3),
        "N/m": ("N/mm", 1e3),
    }.get(unit or "", (None, 1.0))
    # of zero, and across zero, no unit makes anything else
    if not value * bound > 0.0:
        return None
    size, most = abs(value), abs(bound)
    within = size * factor <= most < size if factor < 1.0 else size < most <= size * factor
    return other if within else None


def _values(types: Iterable[inspect.Type]) -> list[str]:
    return [
        str(value)
        for kind in types
        if isinstance(kind, inspect.LiteralType)
        for value in kind.values
    ]


# Places ------------------------------------------------------------------------------------------


class PossibleType(NamedTuple):
    """One type that a field may have, and the units of its numbers.

    Attributes
    ----------
    kind : msgspec.inspect.Type
        The type, without metadata such as bounds and descriptions.
    units : tuple of str
        One unit for all numbers; two units for equal halves of an array, as of a wrench; empty if
        no unit is known.
    """

    kind: inspect.Type
    units: tuple[str, ...]


def places_at(kind: type, steps: Iterable[Step]) -> list[PossibleType]:
    """Return the types that a field may have, from its path in a message.

    Parameters
    ----------
    kind : type
        Message type.
    steps : iterable of (str, int or None)
        Path of the field: names, indices, and None for any key of a dict.

    Returns
    -------
    list of PossibleType
        One for each member of a union; empty if no such field exists.
    """
    places = list(_bare(_known(kind)))
    for step in steps:
        places = entered(places, step)
    return places


def entered(places: Iterable[PossibleType], step: Step) -> list[PossibleType]:
    """Return the types of an entry of a field, from the types that the field may have.

    Parameters
    ----------
    places : iterable of PossibleType
        Types of the field.
    step : str, int or None
        Name or index of the entry; None for any key of a dict.

    Returns
    -------
    list of PossibleType
        Empty if no type has such an entry.
    """
    found: list[PossibleType] = []
    for place in places:
        parent = place.kind
        if isinstance(parent, inspect.StructType) and isinstance(step, str):
            fields = [f.type for f in parent.fields if f.encode_name == step]
            if not fields and parent.tag_field == step:
                fields = [inspect.LiteralType((parent.tag,))]
            found += [bare for field in fields for bare in _bare(field)]
        elif isinstance(parent, inspect.CollectionType):
            found += _bare(parent.item_type, place.units)
        elif isinstance(parent, inspect.DictType) and step is None:
            found += _bare(parent.value_type, place.units)
        elif isinstance(parent, inspect.TupleType) and isinstance(step, int):
            items = parent.item_types
            for item in items[step : step + 1]:
                found += _bare(item, _units_of(place.units, step, len(items)))
    return found


def field_names(types: Iterable[inspect.Type]) -> list[str]:
    """Return the field names of struct types, each once, without fields for later versions.

    Parameters
    ----------
    types : iterable of msgspec.inspect.Type
        Types; those that are no structs are ignored.

    Returns
    -------
    list of str
        Names in the order of the structs' fields, after the name of the tag field.
    """
    names: list[str] = []
    for kind in types:
        if isinstance(kind, inspect.StructType):
            names += [kind.tag_field] if kind.tag_field else []
            names += [field.name for field in kind.fields if field.type != _known(Later)]
    return list(dict.fromkeys(names))


@cache
def _known(kind: Any) -> inspect.Type:
    """Return msgspec's description of a type, cached because it takes milliseconds."""
    return inspect.type_info(kind)


def _bare(kind: inspect.Type, units: tuple[str, ...] = ()) -> Iterator[PossibleType]:
    """Yield a type without its metadata, and each member of a union."""
    if isinstance(kind, inspect.Metadata):
        # one unit, or two of a wrench, forces first
        symbol = r"(?:kg|rad|[Nms·/²])+"
        described = (kind.extra_json_schema or {}).get("description", "")
        found = re.findall(rf"\[({symbol}(?:, {symbol})*)\]", described)
        yield from _bare(kind.type, tuple(found[-1].split(", ")) if found else units)
    elif isinstance(kind, inspect.UnionType):
        for member in kind.types:
            yield from _bare(member, units)
    else:
        yield PossibleType(kind, units)


def _units_of(units: tuple[str, ...], entry: int, length: int) -> tuple[str, ...]:
    """Return the units of one entry of an array with one unit, or with two for equal halves."""
    which = entry * len(units) // length
    return units[which : which + 1]
