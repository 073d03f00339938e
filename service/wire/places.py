"""What may stand at a place of a message: types, names of fields, and units, from its schema."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, Final, NamedTuple

from msgspec import inspect

from service.requests import Later

__all__ = ["Place", "Step", "entered", "field_names", "places_at"]

SYMBOL: Final = r"(?:kg|rad|[Nms·/²])+"
UNITS: Final = re.compile(rf"\[({SYMBOL}(?:, {SYMBOL})*)\]")
"""Where a description says its units: one, or two of a wrench, forces first."""

Step = str | int | None
"""Of a path; None for a key that the caller chose."""


class Place(NamedTuple):
    """What may stand at a place: a type without its metadata, and the units of its numbers."""

    kind: inspect.Type
    units: tuple[str, ...]


def places_at(kind: type, steps: Iterable[Step]) -> list[Place]:
    """Return what may stand at the end of a path into a message of a kind."""
    places = list(_bare(_known(kind)))
    for step in steps:
        places = entered(places, step)
    return places


def entered(places: Iterable[Place], step: Step) -> list[Place]:
    """Return what may stand one step further."""
    found: list[Place] = []
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
    return found


def field_names(types: Iterable[inspect.Type]) -> list[str]:
    """Return the fields of the structs that may be meant, each once, but none not yet taken."""
    names: list[str] = []
    for kind in types:
        if isinstance(kind, inspect.StructType):
            names += [kind.tag_field] if kind.tag_field else []
            names += [field.name for field in kind.fields if not _comes_later(field.type)]
    return list(dict.fromkeys(names))


def _comes_later(kind: inspect.Type) -> bool:
    return kind == _known(Later)


@cache
def _known(kind: Any) -> inspect.Type:
    """Return what is known of a message, which takes milliseconds to find out."""
    return inspect.type_info(kind)


def _bare(kind: inspect.Type, units: tuple[str, ...] = ()) -> Iterator[Place]:
    """Yield a type without its metadata, and each member of a union."""
    if isinstance(kind, inspect.Metadata):
        found = UNITS.findall((kind.extra_json_schema or {}).get("description", ""))
        yield from _bare(kind.type, tuple(found[-1].split(", ")) if found else units)
    elif isinstance(kind, inspect.UnionType):
        for member in kind.types:
            yield from _bare(member, units)
    else:
        yield Place(kind, units)


def _units_of(units: tuple[str, ...], entry: int, length: int) -> tuple[str, ...]:
    """Return the units of one entry of a whole that has one unit, or two of equal halves."""
    which = entry * len(units) // length
    return units[which : which + 1]
