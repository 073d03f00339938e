"""Paths into a plan request: which numbers or words they mean, and what would be valid there.

A request is a document here, of plain lists and dicts. What lies on a path and is left out of the
document is put there with its default, and a surface's preset is replaced by its numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import msgspec
from msgspec import inspect

from hand_models.base import InvalidInputError
from hand_models.tile import Surface as Preset
from planner import EARTH
from service.requests import PlanRequest, Stance, Surface
from service.wire import Place, entered, field_names, places_at

__all__ = ["Paths", "Steps", "Target", "put"]

Steps = tuple[str | int, ...]
"""Keys and indices from the document to a value."""

EVERY: Final = "*"
"""All entries of a list or an object."""

FIXED: Final = frozenset(
    {"v", "id", "deadline", "max_reply_bytes", "confidence", "detail", "want", "draws", "explain"}
)
"""Fields of a request that are no part of what is asked about."""

SURFACE: Final = "surface"
FORCES: Final = ("pull_off_limit", "lateral_limit", "shear_scatter")
"""Numbers of a preset that its parameter file gives over its shear limit."""


@dataclass(frozen=True)
class Target:
    """What a path means.

    Attributes
    ----------
    steps : tuple of Steps
        To the value in the document; several where the path has a ``*``.
    unit : str or None
        Of a number there, where it is known.
    whole : bool
        Whether a number there is a whole one.
    """

    steps: tuple[Steps, ...]
    unit: str | None
    whole: bool


@dataclass
class Paths:
    """Finds what paths mean in one document, and opens it where they lead.

    Attributes
    ----------
    document : dict
        A plan request; changed in place.
    presets : dict
        Names of the surfaces that were replaced by their numbers, by the steps to them.
    """

    document: dict[str, Any]
    presets: dict[Steps, str] = field(default_factory=dict)

    def target(self, path: str) -> Target:
        """Return what a path means.

        Parameters
        ----------
        path : str
            Names and indices with dots between them; the stance's own fields may begin it.

        Raises
        ------
        InvalidInputError
            If there is no such field; the message lists the names that are valid there.
        """
        names = path.replace("[", ".").replace("]", "").split(".")
        if names[0] in _fields(Stance):
            names.insert(0, "stance")
        found: list[tuple[Steps, list[Place]]] = []
        self._walk(path, (), names, self.document, places_at(PlanRequest, ()), found)
        for steps, places in found:
            self._check_end(path, steps, places)
        places = found[0][1]
        units = {place.units for place in places if isinstance(place.kind, NUMBERS)}
        unit = next(iter(units)) if len(units) == 1 else self._own_unit(found[0][0])
        kinds = [type(place.kind) for place in places]
        whole = inspect.IntType in kinds and inspect.FloatType not in kinds
        return Target(
            tuple(steps for steps, _ in found), unit[0] if len(unit) == 1 else None, whole
        )

    def _walk(
        self,
        path: str,
        done: Steps,
        rest: Sequence[str],
        value: Any,
        places: list[Place],
        found: list[tuple[Steps, list[Place]]],
    ) -> None:
        if not rest:
            found.append((done, places))
            return
        name, *after = rest
        if done[-1:] == (SURFACE,) and isinstance(value, str):
            value = self._expanded(done, value)
        places = _meant(places, value)
        where = ".".join(map(str, self._told(done))) or "a request"
        if not isinstance(value, (dict, list)):
            told = f"is {value!r} in the request" if places else "is a number or a word"
            raise InvalidInputError(f"{where} {told}, without entries", field=path)
        entries = self._entries(value, places, done)
        if isinstance(value, list):
            known = {str(i): i for i in range(len(value))} | {
                entry["limb"]: i for i, entry in enumerate(value) if _is_hand(entry, done)
            }
        else:
            known = {key: key for key in entries}
        if not entries:
            raise InvalidInputError(
                f"{where} has no entries in the request; give there what is to vary", field=path
            )
        if name == EVERY and (isinstance(value, list) or _free_keys(places)):
            chosen = list(dict.fromkeys(known.values()))
        elif name in known:
            chosen = [known[name]]
        else:
            every = [EVERY] if isinstance(value, list) or _free_keys(places) else []
            listed = ", ".join([*entries, *every])
            if not done:
                listed += f"; and of the stance {', '.join(_fields(Stance))}"
            raise InvalidInputError(f"{where} has no {name!r}; known are {listed}", field=path)
        for step in chosen:
            into = entered(places, None if _free_keys(places) else step)
            if any(isinstance(place.kind, inspect.AnyType) for place in places):
                into = places
            steps = (*done, step)
            if after:
                self._open(path, value, step, places, into, steps)
            inner = value[step] if _has(value, step) else None
            self._walk(path, steps, after, inner, into, found)

    def _expanded(self, steps: Steps, name: str) -> dict[str, Any]:
        """Put a preset's numbers in place of its name."""
        preset = Preset.named(name)
        numbers = {key: getattr(preset, key) for key in _fields(Surface)}
        put(self.document, steps, numbers)
        self.presets[steps] = name
        return numbers

    def _own_unit(self, steps: Steps) -> tuple[str, ...]:
        """Return the unit that an entry of a hand names itself."""
        entry = _at(self.document, steps[:4]) if steps[:2] == HAND else None
        unit = entry.get("unit") if isinstance(entry, dict) else None
        return (unit,) if isinstance(unit, str) and steps[4:5] == ("value",) else ()

    def follow(self, document: dict[str, Any], varied: Iterable[Steps]) -> None:
        """Let a preset's other forces follow its shear limit, as in its parameter file."""
        given = set(varied)
        for steps, name in self.presets.items():
            numbers = _at(document, steps)
            preset = Preset.named(name)
            share = numbers["shear_limit"] / preset.shear_limit
            for key in FORCES:
                if (*steps, key) not in given:
                    put(document, (*steps, key), share * getattr(preset, key))

    def _open(
        self,
        path: str,
        value: Any,
        step: str | int,
        places: list[Place],
        into: list[Place],
        steps: Steps,
    ) -> None:
        """Put what a path leads through into the document, if it is not there."""
        if _has(value, step) and value[step] is not None:
            return
        where = ".".join(map(str, self._told(steps)))
        if not any(isinstance(place.kind, (*COMPOUND, inspect.AnyType)) for place in into):
            raise InvalidInputError(f"{where} is a number or a word, without entries", field=path)
        default = _default(places, step)
        if steps == ("stance", "gravity"):
            default = list(EARTH)
        if default is None and any(
            isinstance(place.kind, (inspect.StructType, inspect.DictType)) for place in into
        ):
            default = {}
        if default is None:
            raise InvalidInputError(
                f"{where} has no value in the request, of which an entry could vary: give it there",
                field=path,
            )
        value[step] = default

    def _check_end(self, path: str, steps: Steps, places: list[Place]) -> None:
        """Refuse what is no single number or word."""
        if any(not isinstance(place.kind, COMPOUND) for place in _without_null(places)):
            return
        value = _at(self.document, steps)
        entries = self._entries(value, _meant(places, value), steps)
        known = f"; give one of its entries: {', '.join(entries)}" if entries else ""
        raise InvalidInputError(f"is no number or word{known}", field=path)

    def _entries(self, value: Any, places: list[Place], steps: Steps) -> list[str]:
        """Return the names that are valid one step further."""
        limbs = [hand["limb"] for hand in self.document["stance"]["hands"]]
        if isinstance(value, list):
            return limbs if steps == HANDS else [str(i) for i in range(len(value))]
        if any(isinstance(place.kind, inspect.StructType) for place in places):
            names = field_names(place.kind for place in places)
            return [name for name in names if steps or name not in FIXED]
        for place in places:
            if isinstance(place.kind, inspect.TupleType):
                return [str(i) for i in range(len(place.kind.item_types))]
        keys = list(value or ())
        return list(dict.fromkeys([*limbs, *keys])) if steps in BY_LIMB else keys

    def _told(self, steps: Steps) -> list[str]:
        """Return steps as a caller writes them."""
        told = [
            _at(self.document, steps[:i])[step]["limb"] if steps[:i] == HANDS else str(step)
            for i, step in enumerate(steps)
        ]
        return told[1:] if len(told) > 1 and told[0] == "stance" else told


HAND: Final[Steps] = ("stance", "hand")
HANDS: Final[Steps] = ("stance", "hands")
BY_LIMB: Final[tuple[Steps, ...]] = (
    ("stance", "joints"),
    ("limits", "joint_torque"),
    ("limits", "per_hand"),
    ("present",),
)
NUMBERS: Final = (inspect.FloatType, inspect.IntType)
COMPOUND: Final = (
    inspect.StructType,
    inspect.DictType,
    inspect.ListType,
    inspect.TupleType,
    inspect.VarTupleType,
)


def put(document: Any, steps: Steps, value: Any) -> None:
    """Set a value in a document."""
    _at(document, steps[:-1])[steps[-1]] = value


def _at(document: Any, steps: Steps) -> Any:
    for step in steps:
        document = document[step] if _has(document, step) else None
    return document


def _has(value: Any, step: str | int) -> bool:
    if isinstance(value, dict):
        return step in value
    return isinstance(value, list) and isinstance(step, int) and step < len(value)


def _is_hand(entry: Any, steps: Steps) -> bool:
    return steps == HANDS and isinstance(entry, dict)


def _fields(kind: type) -> list[str]:
    return field_names(place.kind for place in places_at(kind, ()))


def _without_null(places: Iterable[Place]) -> list[Place]:
    return [place for place in places if not isinstance(place.kind, inspect.NoneType)]


def _meant(places: list[Place], value: Any) -> list[Place]:
    """Return the places of compounds that a value is one of."""
    found = []
    for place in places:
        kind = place.kind
        if isinstance(kind, inspect.StructType):
            tagged = kind.tag_field is not None and isinstance(value, dict)
            if tagged and value.get(kind.tag_field) != kind.tag:
                continue
            found.append(place)
        elif isinstance(kind, (*COMPOUND, inspect.AnyType)):
            found.append(place)
    return found


def _free_keys(places: list[Place]) -> bool:
    return any(isinstance(place.kind, inspect.DictType) for place in places)


def _default(places: list[Place], step: str | int) -> Any:
    """Return a field's default as a document has it; None if there is none."""
    for place in places:
        if isinstance(place.kind, inspect.StructType):
            for each in place.kind.fields:
                if each.encode_name == step and each.default_factory is not msgspec.NODEFAULT:
                    return _plain(each.default_factory())
                if each.encode_name == step and each.default is not msgspec.NODEFAULT:
                    return _plain(each.default)
    return None


def _plain(value: Any) -> Any:
    return msgspec.json.decode(msgspec.json.encode(value))
