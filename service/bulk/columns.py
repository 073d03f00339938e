"""Columns of tables of plans, routes and climbs, with units, and conversion of replies into rows.

If a column has a unit, its name ends in the unit, as in ``front_left_fx_N``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any, Literal, NamedTuple

import msgspec

from hand_models.base import InvalidInputError
from hand_models.hand import FINGERS
from planner import LimitName
from service.replies import WRENCH_AXES, ErrorDetail

__all__ = [
    "Column",
    "TableRow",
    "chosen_columns",
    "climb_columns",
    "columns_of",
    "route_columns",
    "row_of",
    "value_at",
]

Kind = Literal["int", "float", "bool", "text"]


class Column(NamedTuple):
    """Column of a table that is written to a file.

    Attributes
    ----------
    name : str
        Head of the column.
    kind : {'int', 'float', 'bool', 'text'}
        Type of the values.
    unit : str
        Unit of the numbers, ``1`` for numbers without a unit; empty for bool and text.
    meaning : str
        Description of the values, in a few words.
    path : tuple of str or int
        Keys and indices of the value in a decoded reply; by default the name alone. Hands are keyed
        by limb here, the hardest stage of a route is ``hardest``, and stages and moves are counted.
    """

    name: str
    kind: Kind
    unit: str
    meaning: str
    path: tuple[str | int, ...] = ()

    @property
    def is_index(self) -> bool:
        """True for the first column of all but sweeps, the index of the request."""
        return self.name == "index"


class TableRow(msgspec.Struct):
    """Row of a table, for one answer.

    Attributes
    ----------
    values : list
        Values of all columns except ``index``.
    status : str or None
        Status of the plan, route or climb; None for an error.
    error : ErrorDetail or None
        The error; None for any other answer.
    """

    values: list[Any]
    status: str | None = None
    error: ErrorDetail | None = None


def columns_of(limbs: Sequence[str], explained: bool = False) -> tuple[Column, ...]:
    """Return all columns of a table of plans for a robot.

    Parameters
    ----------
    limbs : sequence of str
        Names of the robot's limbs; each has columns for its hand.
    explained : bool, optional
        True to include the columns of an explanation (irreducible infeasible subset).

    Returns
    -------
    tuple of Column
        Columns in the order of the table, ``index`` first.
    """
    return tuple(_columns(limbs, explained))


def _columns(limbs: Sequence[str], explained: bool) -> Iterator[Column]:
    yield from _asked()
    yield Column("status", "text", "", "of the plan; empty for an error")
    yield Column("utilisation", "float", "1", "the largest of any limit")
    yield from _load_factor("where the request wants it, and it is bounded", "it")
    yield from _limiting("limiting")
    yield Column("verified", "bool", "", "whether the plan has passed its independent check")
    for limb in limbs:
        hand, meaning = ("hands", limb), "the largest of the hand's limits"
        yield Column(f"{limb}_utilisation", "float", "1", meaning, (*hand, "utilisation"))
        for i, finger in enumerate(FINGERS):
            name = f"{limb}_{finger}_tension_N"
            yield Column(name, "float", "N", "tension of its tendon", (*hand, "tensions", i))
        for i, axis in enumerate(WRENCH_AXES):
            unit = "N" if axis.startswith("f") else "N·m"
            name = f"{limb}_{axis}_{unit.replace('·', '')}"
            meaning = f"{axis} of the hand's wrench on the rock, in its own frame"
            yield Column(name, "float", unit, meaning, (*hand, "wrench", i))
        yield from _wrist(limb)
    yield Column("warnings", "text", "", "with '; ' between them")
    if explained:
        yield Column("irreducible", "text", "", "limits that together leave no plan")
        yield Column("sufficient", "text", "", "those of them of which one less would do")
    yield from _failed()


def _wrist(limb: str) -> Iterator[Column]:
    meanings = {
        "twist": "of where its wrist goes, about the pose that was given; empty if fixed",
        "pose_target": "of where the limb is to aim, likewise; empty without limb_stiffness",
    }
    for part, meaning in meanings.items():
        for i, axis in enumerate(("vx", "vy", "vz", "wx", "wy", "wz")):
            unit = "m" if axis.startswith("v") else "rad"
            path = ("hands", limb, "wrist", part, i)
            yield Column(f"{limb}_{part}_{axis}_{unit}", "float", unit, f"{axis} {meaning}", path)


def route_columns() -> Iterator[Column]:
    """Yield all columns of a table of routes, one row for each route."""
    yield from _asked()
    yield Column("name", "text", "", "the route's")
    yield Column("status", "text", "", "of the stage that is worst off; empty for an error")
    yield Column("stages", "int", "1", "stances, those with a limb in the air among them")
    yield Column("crux", "int", "1", "the hardest stage, from zero")
    meaning = "its move, from one; zero is the start"
    yield Column("crux_move", "int", "1", meaning, ("hardest", "move"))
    for part, what in (("phase", "of the move"), ("limb", "that moves"), ("reason", "in words")):
        meaning = f"the crux's {part}, {what}"
        yield Column(f"crux_{part}", "text", "", meaning, ("hardest", part))
    yield Column("utilisation", "float", "1", "of the crux: the largest of any limit")
    yield from _load_factor("the least of all stages, where it is bounded", "any of them")
    yield from _limiting("limiting")
    yield Column("warnings", "text", "", "with '; ' between them")
    yield from _failed()


def climb_columns() -> Iterator[Column]:
    """Yield all columns of a table of climbs that are searched for, one row for each rock."""
    yield from _asked()
    yield Column("name", "text", "", "the climb's")
    yield Column("robot", "text", "", "name of the robot")
    meaning = "found, not_proven, none, blocked or unknown; empty for an error"
    yield Column("status", "text", "", meaning)
    yield Column("least", "float", "1", "least load factor of all stages; empty without a climb")
    yield Column("bound", "float", "1", "no other climb has a larger least load factor")
    yield Column("gap", "float", "1", "how much larger the bound is, as a part of the least")
    meaning = "the least of all stages with compliant wrists; empty unless asked for"
    yield Column("least_compliant", "float", "1", meaning)
    yield Column("moves", "int", "1", "of limbs, in the climb")
    yield Column("knots", "int", "1", "of the climb's trajectory")
    for name, what in (("placements", "of hands"), ("bodies", "poses of the body")):
        yield Column(name, "int", "1", f"{what}, of which climbs were made")
    for part, meaning in (
        ("stage", "the stage with the least load factor, from zero"),
        ("move", "its move, from one; zero is the start"),
    ):
        yield Column(f"deciding_{part}", "int", "1", meaning, ("deciding", part))
    for part, meaning in (("phase", "its part of the move"), ("limb", "that moves in it")):
        yield Column(f"deciding_{part}", "text", "", meaning, ("deciding", part))
    yield from _limiting("deciding", "limiting")
    yield from _failed()


def _asked() -> Iterator[Column]:
    yield Column("index", "int", "1", "of the request, from zero; blank lines do not count")
    yield Column("id", "text", "", "the request's")


def _load_factor(meaning: str, which: str) -> Iterator[Column]:
    yield Column("load_factor", "float", "1", meaning)
    yield Column("load_factor_unbounded", "bool", "", f"whether there is no end to {which}")
    meaning = "found, at_least; or why there is none: unbounded, none, not_asked, not_finished"
    yield Column("load_factor_status", "text", "", meaning)


def _limiting(*path: str) -> Iterator[Column]:
    for part in LimitName.__struct_fields__:
        meaning = f"{part} of the limit that is used most"
        yield Column(f"limiting_{part}", "text", "", meaning, (*path, part))


def _failed() -> Iterator[Column]:
    for part in ("kind", "field", "message"):
        meaning = f"{part} of the error; empty without one"
        yield Column(f"error_{part}", "text", "", meaning, ("error", part))


def chosen_columns(
    wanted: str | None, limbs: Sequence[str], explained: bool = False
) -> tuple[Column, ...]:
    """Select columns of a table of plans by name or pattern; ``index`` is always included.

    Parameters
    ----------
    wanted : str or None
        Names separated by commas; ``*`` matches any text. None selects all columns.
    limbs : sequence of str
        Names of the robot's limbs.
    explained : bool, optional
        True if the columns of an explanation can be selected.

    Returns
    -------
    tuple of Column
        Selected columns, in the usual order of the table.

    Raises
    ------
    InvalidInputError
        If a name or pattern matches no column.
    """
    known = columns_of(limbs, explained)
    if wanted is None:
        return known
    names = [name.strip() for name in wanted.split(",")]
    for name in names:
        if not any(fnmatchcase(column.name, name) for column in known):
            hint = ", which needs --explain" if name in {"irreducible", "sufficient"} else ""
            listed = ", ".join(column.name for column in known)
            raise InvalidInputError(
                f"no column {name!r}{hint}; valid are {listed}", field="columns"
            )
    return tuple(
        column
        for column in known
        if column.is_index or any(fnmatchcase(column.name, name) for name in names)
    )


def row_of(payload: bytes, columns: Sequence[Column]) -> TableRow:
    """Convert an encoded reply or error reply into a row of a table.

    Parameters
    ----------
    payload : bytes
        JSON of a whole or brief plan reply, of the reply to a route or a climb, or of an error.
    columns : sequence of Column
        Columns of the table; ``index`` is skipped.

    Returns
    -------
    TableRow
        A value is None where the reply does not have it.
    """
    reply = msgspec.json.decode(payload)
    error = reply.get("error")
    values = _readable(reply)
    return TableRow(
        [
            value_at(values, column.path or (column.name,))
            for column in columns
            if not column.is_index
        ],
        reply.get("status"),
        None if error is None else msgspec.convert(error, ErrorDetail),
    )


def _readable(reply: dict[str, Any]) -> dict[str, Any]:
    """Return a reply with hands by limb, hardest stage, counts, and lists of words as texts."""
    found = reply | {"hands": {}, "stages": None}
    found["warnings"] = "; ".join(reply.get("warnings") or ()) or None
    if reply.get("status") is not None:
        found["load_factor_unbounded"] = bool(reply.get("load_factor_unbounded"))
    for hand in reply.get("hands") or ():
        fingers = hand.get("fingers") or ()
        tensions = hand.get("tensions") or [finger["tendon_tension"] for finger in fingers]
        # a brief reply has the twist and the target beside the tensions
        read = {"tensions": tensions, "wrist": hand.get("wrist", hand)}
        found["hands"][hand["limb"]] = hand | read
    crux, stages = reply.get("crux"), reply.get("stages")
    if crux is not None and stages:
        found |= {"stages": len(stages), "hardest": stages[crux]}
    if reply.get("route") is not None:
        found["moves"] = len(reply["route"]["moves"])
    for name in ("irreducible", "sufficient"):
        limits = (reply.get("certificate") or {}).get(name)
        found[name] = None if limits is None else "; ".join(map(_spoken, limits))
    return found


def value_at(value: Any, path: tuple[str | int, ...]) -> Any:
    """Return what is at the end of a path of keys and indices; None if a part of it is missing."""
    try:
        for step in path:
            value = value[step]
    except (LookupError, TypeError):
        return None
    return value


def _spoken(limit: dict[str, str | None]) -> str:
    parts = (limit.get(part) for part in LimitName.__struct_fields__)
    return " ".join(part for part in parts if part is not None)
