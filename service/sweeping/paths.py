"""Paths of fields in a plan request: find the places that a path leads to, and set their values.

A request is a document here, of plain lists and dicts in which all fields are filled in with their
values or defaults. Optional parts that a path leads through are created, and a surface that is
given by the name of a preset is replaced by the preset's numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import msgspec
from msgspec import inspect

from hand_models.base import InvalidInputError
from hand_models.tile import Surface
from planner import EARTH_GRAVITY
from service.requests import PlanRequest, StanceMessage, SurfaceMessage
from service.wire import PossibleType, entered, field_names, places_at

__all__ = ["Paths", "Steps", "Target"]

Steps = tuple[str | int, ...]
"""Keys and indices that lead from a document to one value in it."""

KEYED_TYPES: Final = (inspect.StructType, inspect.DictType)
LISTED_TYPES: Final = (inspect.ListType, inspect.TupleType, inspect.VarTupleType)

LIMB_KEYED: Final[tuple[Steps, ...]] = (
    ("stance", "joints"), ("limits", "joint_torque"), ("limits", "per_hand"), ("present",),
)  # fmt: skip
"""Objects whose keys are limbs."""

FIXED_FIELDS: Final = {
    "v", "id", "deadline", "max_reply_bytes", "confidence", "detail", "want", "draws", "open_loop",
    "survival", "explain",
}  # fmt: skip
"""Fields of a request that are no part of what is asked about."""


class Target(NamedTuple):
    """Places in a document that a path leads to.

    Attributes
    ----------
    path : str
        The path.
    steps : tuple of Steps
        Keys and indices that lead to each value; several if the path has a ``*``.
    unit : str or None
        Unit of the number there, if it is known.
    whole : bool
        True if only whole numbers are valid there.
    """

    path: str
    steps: tuple[Steps, ...]
    unit: str | None
    whole: bool

    @property
    def label(self) -> str:
        """Path and unit, such as ``load.mass [kg]``."""
        return self.path if self.unit is None else f"{self.path} [{self.unit}]"


@dataclass
class Paths:
    """Lookup of paths in one document.

    Attributes
    ----------
    document : dict
        A plan request as plain lists and dicts; changed in place.
    presets : dict of Steps to str
        Names of surface presets that were replaced by their numbers, by the steps that lead to the
        surface.
    """

    document: dict[str, Any]
    presets: dict[Steps, str] = field(default_factory=dict)

    @classmethod
    def into(cls, request: PlanRequest) -> Paths:
        """Return the lookup in a plan request's document, without samples of any kind."""
        document = _filled(msgspec.structs.replace(request, open_loop=None, survival=None))
        del document["draws"]
        document["stance"].setdefault("gravity", list(EARTH_GRAVITY))
        return cls(document)

    def target(self, path: str) -> Target:
        """Find the places that a path leads to, and create missing parts on the way.

        Parameters
        ----------
        path : str
            Names and indices with dots between them, as ``load.mass``. Hands are named by limb, and
            ``*`` stands for all entries. A path may begin with a field of the stance.

        Returns
        -------
        Target
            Steps to all places of the path, with the unit of the values.

        Raises
        ------
        InvalidInputError
            If the path leads to no field, or to one that is no number or word. The message has the
            valid names.
        """
        names = path.replace("[", ".").replace("]", "").split(".")
        if names[0] in _fields(StanceMessage):
            names.insert(0, "stance")
        found: list[tuple[Steps, list[PossibleType]]] = [((), places_at(PlanRequest, ()))]
        for name in names:
            found = [each for end in found for each in self._entered(path, name, *end)]
        for steps, places in found:
            compound = (*KEYED_TYPES, *LISTED_TYPES, inspect.NoneType)
            if all(isinstance(each.kind, compound) for each in places):
                known = ", ".join(self._listed(steps, places, _at(self.document, steps)))
                more = f"; give one of its entries: {known}" if known else ""
                raise InvalidInputError(f"is not a number or a word{more}", field=path)
        steps, places = found[0]
        kinds = {type(each.kind): each.units for each in places}
        units = kinds.get(inspect.FloatType) or kinds.get(inspect.IntType) or self._own_unit(steps)
        whole = inspect.IntType in kinds and inspect.FloatType not in kinds
        unit = units[0] if len(units) == 1 else None
        return Target(path, tuple(each for each, _ in found), unit, whole)

    def set_values(self, given: Mapping[Steps, Any]) -> None:
        """Set values, and scale the other strengths of surface presets with their shear limits.

        In a preset, pull-off limit, lateral limit and shear scatter are proportional to the shear
        limit. They keep this ratio unless they vary themselves.

        Parameters
        ----------
        given : mapping of Steps to object
            Values by their places.
        """
        for steps, value in given.items():
            _set_value(self.document, steps, value)
        for steps, name in self.presets.items():
            preset = Surface.named(name)
            share = _at(self.document, steps)["shear_limit"] / preset.shear_limit
            # its parameter file gives these over its shear limit
            for key in ("pull_off_limit", "lateral_limit", "shear_scatter"):
                if (*steps, key) not in given:
                    _set_value(self.document, (*steps, key), share * getattr(preset, key))

    def _entered(
        self, path: str, name: str, steps: Steps, places: list[PossibleType]
    ) -> list[tuple[Steps, list[PossibleType]]]:
        """Return the entries of a name or index, or all of them, with what may stand there."""
        value = self._opened(path, steps, places)
        places = _meant(places, value)
        listed = self._listed(steps, places, value)
        words = self._words(steps)
        if not listed:
            raise InvalidInputError(
                f"{words} has no entries in the request; add the one to vary", field=path
            )
        free = _may_be(places, inspect.DictType)
        several = ["*"] if free or isinstance(value, list) else []
        known: dict[str, str | int] = {key: key for key in listed}
        if isinstance(value, list):
            known = {name: i for i, key in enumerate(listed) for name in (key, str(i))}
        if name not in (*known, *several):
            more = "" if steps else f"; and of the stance {', '.join(_fields(StanceMessage))}"
            raise InvalidInputError(
                f"{words} has no {name!r}; known are {', '.join(listed + several)}{more}",
                field=path,
            )
        anything = _may_be(places, inspect.AnyType)
        chosen = dict.fromkeys(known.values()) if name in several else [known[name]]
        return [
            ((*steps, step), places if anything else entered(places, None if free else step))
            for step in chosen
        ]

    def _opened(self, path: str, steps: Steps, places: list[PossibleType]) -> Any:
        """Return the value that a path leads through; put there, if it is left out."""
        value = _at(self.document, steps)
        structs = [each.kind for each in places if isinstance(each.kind, inspect.StructType)]
        if value is None and _may_be(places, *KEYED_TYPES):
            value = _default(structs[0]) if structs else {}
            _set_value(self.document, steps, value)
        elif isinstance(value, str) and any(kind.cls is SurfaceMessage for kind in structs):
            self.presets[steps], preset = value, Surface.named(value)
            value = {key: getattr(preset, key) for key in _fields(SurfaceMessage)}
            _set_value(self.document, steps, value)
        if isinstance(value, (dict, list)):
            return value
        words = self._words(steps)
        if value is None and _may_be(places, *LISTED_TYPES, inspect.AnyType):
            raise InvalidInputError(
                f"{words} has no value in the request; add one to vary its entries", field=path
            )
        found = f"is {value!r} in the request" if _meant(places, value) else "is a number or a word"
        raise InvalidInputError(f"{words} {found}, without entries: end the path there", field=path)

    def _own_unit(self, steps: Steps) -> tuple[str, ...]:
        """Return the unit that an entry of a hand names itself."""
        # stance.hand.SECTION.ENTRY.value
        entry = _at(self.document, steps[:4]) if steps[:2] == ("stance", "hand") else None
        unit = entry.get("unit") if isinstance(entry, dict) else None
        return (unit,) if isinstance(unit, str) and steps[4:5] == ("value",) else ()

    def _listed(self, steps: Steps, places: list[PossibleType], value: Any) -> list[str]:
        """Return the names that are valid one step further."""
        limbs = [hand["limb"] for hand in self.document["stance"]["hands"]]
        if isinstance(value, list):
            return limbs if steps == ("stance", "hands") else [str(i) for i in range(len(value))]
        for each in places:
            if isinstance(each.kind, inspect.StructType):
                names = field_names(place.kind for place in _meant(places, value))
                return [name for name in names if steps or name not in FIXED_FIELDS]
            if isinstance(each.kind, inspect.TupleType):
                return [str(i) for i in range(len(each.kind.item_types))]
        return list(dict.fromkeys([*(limbs if steps in LIMB_KEYED else ()), *(value or ())]))

    def _words(self, steps: Steps) -> str:
        """Return steps as a caller writes them."""
        words = [str(step) for step in steps]
        if steps[:2] == ("stance", "hands") and len(steps) > 2:
            words[2] = _at(self.document, steps[:3])["limb"]
        return ".".join(words[1:] if words[1:] and words[0] == "stance" else words) or "a request"


def _set_value(document: Any, steps: Steps, value: Any) -> None:
    """Set the value at one place of a document, which is changed in place."""
    _at(document, steps[:-1])[steps[-1]] = value


def _at(document: Any, steps: Steps) -> Any:
    """Return the value at the end of steps; None if there is none."""
    for step in steps:
        try:
            document = document[step]
        except (LookupError, TypeError):
            return None
    return document


def _filled(value: Any) -> Any:
    """Return a value as plain lists and dicts, with the fields that have their default."""
    if isinstance(value, msgspec.Struct):
        config = value.__struct_config__
        tag = {} if config.tag_field is None else {config.tag_field: config.tag}
        fields = {
            each.encode_name: getattr(value, each.name) for each in msgspec.structs.fields(value)
        }
        return tag | {key: _filled(each) for key, each in fields.items() if each is not None}
    if isinstance(value, (list, tuple)):
        return [_filled(each) for each in value]
    return {key: _filled(each) for key, each in value.items()} if isinstance(value, dict) else value


def _default(kind: inspect.StructType) -> Any:
    """Return a struct of which nothing is given; empty where something must be."""
    try:
        return _filled(kind.cls())
    except TypeError:
        return {}


def _fields(kind: type) -> list[str]:
    return field_names(place.kind for place in places_at(kind, ()))


def _may_be(places: list[PossibleType], *kinds: type[inspect.Type]) -> bool:
    return any(isinstance(each.kind, kinds) for each in places)


def _meant(places: list[PossibleType], value: Any) -> list[PossibleType]:
    """Return the places of compounds that a value is one of."""
    compound = (*KEYED_TYPES, *LISTED_TYPES, inspect.AnyType)
    return [
        place
        for place in places
        if isinstance(place.kind, compound) and not _tagged_otherwise(place.kind, value)
    ]


def _tagged_otherwise(kind: inspect.Type, value: Any) -> bool:
    """Return whether a value has the tag of another struct than this one."""
    if not (isinstance(kind, inspect.StructType) and kind.tag_field and isinstance(value, dict)):
        return False
    return value.get(kind.tag_field) != kind.tag
