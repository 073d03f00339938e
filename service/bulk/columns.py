"""Answers as rows: the columns that a table of plans may have, with their units.

A column's name ends in its unit, if it has one, wherever it stands: ``front_left_fx_N``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any, Final, Literal, NamedTuple

import msgspec

from hand_models.base import InvalidInputError
from hand_models.hand import FINGERS
from planner import LimitName
from service.replies import AXES, ErrorDetail

__all__ = ["INDEX", "Column", "Row", "chosen_columns", "columns_of", "route_columns", "row_of"]

Kind = Literal["int", "float", "bool", "text"]

INDEX: Final = "index"
"""The column that every table begins with."""

EXPLAINED: Final = ("irreducible", "sufficient")
"""Columns that need an explanation."""

FACTOR: Final = "found, at_least; or why there is none: unbounded, none, not_asked, not_finished"
"""Meaning of the column about what is known of a load factor."""

TOLD: Final = (
    "id",
    "name",
    "status",
    "utilisation",
    "load_factor",
    "load_factor_status",
    "verified",
)
"""Columns that are fields of a reply."""

BETWEEN: Final = "; "
"""What stands between the parts of a text that has several."""


class Column(NamedTuple):
    """A column of a table.

    Attributes
    ----------
    name : str
    kind : {'int', 'float', 'bool', 'text'}
    unit : str
        ``1`` for a number that has none; empty where there is no number.
    meaning : str
    """

    name: str
    kind: Kind
    unit: str
    meaning: str


class Row(msgspec.Struct):
    """What a table tells of an answer: its values, and what it came to, chosen or not."""

    values: list[Any]
    status: str | None = None
    error: ErrorDetail | None = None


class _Finger(msgspec.Struct):
    tendon_tension: float


class _Hand(msgspec.Struct):
    limb: str
    wrench: list[float]
    utilisation: float
    tensions: list[float] = []
    fingers: list[_Finger] = []


class _Stage(msgspec.Struct):
    move: int
    phase: str
    limb: str | None
    reason: str


class _Certificate(msgspec.Struct):
    irreducible: list[LimitName] | None = None
    sufficient: list[LimitName] | None = None


class _Told(msgspec.Struct):
    """What rows tell of a reply, brief or whole, or of an error."""

    id: str | None = None
    status: str | None = None
    utilisation: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool | None = None
    load_factor_status: str | None = None
    limiting: LimitName | None = None
    hands: list[_Hand] | None = None
    verified: bool | None = None
    warnings: list[str] = []
    certificate: _Certificate | None = None
    name: str | None = None
    crux: int | None = None
    stages: list[_Stage] = []
    error: ErrorDetail | None = None


def columns_of(limbs: Sequence[str], explained: bool = False) -> tuple[Column, ...]:
    """Return all columns that a table of plans for a robot may have."""
    return tuple(_columns(limbs, explained))


def _columns(limbs: Sequence[str], explained: bool) -> Iterator[Column]:
    yield from _asked()
    yield Column("status", "text", "", "of the plan; empty for an error")
    yield Column("utilisation", "float", "1", "the largest of any limit")
    yield Column("load_factor", "float", "1", "where the request wants it, and it is bounded")
    yield Column("load_factor_unbounded", "bool", "", "whether there is no end to it")
    yield Column("load_factor_status", "text", "", FACTOR)
    yield from _limiting()
    yield Column("verified", "bool", "", "whether the plan has passed its independent check")
    for limb in limbs:
        yield Column(f"{limb}_utilisation", "float", "1", "the largest of the hand's limits")
        for finger in FINGERS:
            yield Column(f"{limb}_{finger}_tension_N", "float", "N", "tension of its tendon")
        for axis in AXES:
            unit = "N" if axis.startswith("f") else "Nm"
            meaning = f"{axis} of the hand's wrench on the rock, in its own frame"
            yield Column(f"{limb}_{axis}_{unit}", "float", unit.replace("Nm", "N·m"), meaning)
    yield Column("warnings", "text", "", f"with {BETWEEN!r} between them")
    if explained:
        yield Column(EXPLAINED[0], "text", "", "limits that together leave no plan")
        yield Column(EXPLAINED[1], "text", "", "those of them of which one less would do")
    yield from _failed()


def route_columns() -> tuple[Column, ...]:
    """Return all columns of a table of routes."""
    return tuple(_route_columns())


def _route_columns() -> Iterator[Column]:
    yield from _asked()
    yield Column("name", "text", "", "the route's")
    yield Column("status", "text", "", "of the stage that is worst off; empty for an error")
    yield Column("stages", "int", "1", "stances, those with a limb in the air among them")
    yield Column("crux", "int", "1", "the hardest stage, from zero")
    yield Column("crux_move", "int", "1", "its move, from one; zero is the start")
    for part, what in (("phase", "of the move"), ("limb", "that moves"), ("reason", "in words")):
        yield Column(f"crux_{part}", "text", "", f"the crux's {part}, {what}")
    yield Column("utilisation", "float", "1", "of the crux: the largest of any limit")
    yield Column("load_factor", "float", "1", "the least of all stages, where it is bounded")
    yield Column("load_factor_unbounded", "bool", "", "whether there is no end to any of them")
    yield Column("load_factor_status", "text", "", FACTOR)
    yield from _limiting()
    yield Column("warnings", "text", "", f"with {BETWEEN!r} between them")
    yield from _failed()


def _asked() -> Iterator[Column]:
    yield Column(INDEX, "int", "1", "of the request, from zero; blank lines do not count")
    yield Column("id", "text", "", "the request's")


def _limiting() -> Iterator[Column]:
    for part in LimitName.__struct_fields__:
        yield Column(f"limiting_{part}", "text", "", f"{part} of the limit that is used most")


def _failed() -> Iterator[Column]:
    for part in ("kind", "field", "message"):
        yield Column(f"error_{part}", "text", "", f"{part} of the error; empty for a plan")


def chosen_columns(
    wanted: str | None, limbs: Sequence[str], explained: bool = False
) -> tuple[Column, ...]:
    """Return the columns of a table, in their usual order, ``index`` always among them.

    Parameters
    ----------
    wanted : str or None
        Names with commas between them, ``*`` in them for any text; None for all.
    limbs : sequence of str
    explained : bool, optional
        Whether there are explanations.

    Raises
    ------
    InvalidInputError
        If a name is none of a column.
    """
    known = columns_of(limbs, explained)
    if wanted is None:
        return known
    names = [name.strip() for name in wanted.split(",")]
    for name in names:
        if not any(fnmatchcase(column.name, name) for column in known):
            hint = "; it needs --explain" if name in EXPLAINED else ""
            listed = ", ".join(column.name for column in known)
            raise InvalidInputError(
                f"no column {name!r}{hint}; valid are {listed}", field="columns"
            )
    return tuple(
        column
        for column in known
        if column.name == INDEX or any(fnmatchcase(column.name, name) for name in names)
    )


def row_of(payload: bytes, columns: Sequence[str]) -> Row:
    """Return a reply in JSON, or an error, as a row of these columns but ``index``."""
    told = msgspec.json.decode(payload, type=_Told)
    values = _values(told)
    return Row([values.get(name) for name in columns if name != INDEX], told.status, told.error)


def _values(told: _Told) -> dict[str, Any]:
    found: dict[str, Any] = {name: getattr(told, name) for name in (*TOLD, "crux")}
    if told.status is not None:
        found["load_factor_unbounded"] = bool(told.load_factor_unbounded)
        found["warnings"] = BETWEEN.join(told.warnings) or None
    if told.limiting is not None:
        for part in LimitName.__struct_fields__:
            found[f"limiting_{part}"] = getattr(told.limiting, part)
    if told.crux is not None:
        found["stages"] = len(told.stages)
        for part in _Stage.__struct_fields__:
            found[f"crux_{part}"] = getattr(told.stages[told.crux], part)
    for hand in told.hands or ():
        found[f"{hand.limb}_utilisation"] = hand.utilisation
        tensions = hand.tensions or [finger.tendon_tension for finger in hand.fingers]
        for finger, tension in zip(FINGERS, tensions, strict=True):
            found[f"{hand.limb}_{finger}_tension_N"] = tension
        for axis, load in zip(AXES, hand.wrench, strict=True):
            found[f"{hand.limb}_{axis}_{'N' if axis.startswith('f') else 'Nm'}"] = load
    if told.certificate is not None:
        for name in EXPLAINED:
            limits = getattr(told.certificate, name)
            found[name] = None if limits is None else BETWEEN.join(map(_spoken, limits))
    if told.error is not None:
        for part in ("kind", "field", "message"):
            found[f"error_{part}"] = getattr(told.error, part)
    return found


def _spoken(limit: LimitName) -> str:
    parts = (getattr(limit, part) for part in LimitName.__struct_fields__)
    return " ".join(part for part in parts if part is not None)
