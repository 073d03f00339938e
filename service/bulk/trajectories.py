"""Write the knots of a climb as JSON lines and as Parquet, and read the lines again."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from hand_models.base import InvalidInputError, whole_file
from hand_models.hand import FINGERS
from planner import LimitName
from service.bulk.columns import Column, value_at
from service.bulk.exports import exporter_at
from service.replies import WRENCH_AXES, ClimbFailureReply, KnotReply

__all__ = [
    "ClimbSummary",
    "knot_columns",
    "read_climb",
    "read_climb_summary",
    "read_trajectory",
    "trajectory_digest",
    "write_trajectory",
]


def write_trajectory(knots: Sequence[KnotReply], folder: Path) -> dict[str, Path]:
    """Write ``trajectory.jsonl``, a knot a line, and the same as a table, ``trajectory.parquet``.

    Parameters
    ----------
    knots : sequence of KnotReply
        Knots in climbing order.
    folder : Path
        Existing folder; files of these names are replaced, or removed where there are no knots.

    Returns
    -------
    dict of str to Path
        Files by the names ``trajectory`` and ``trajectory table``; without the latter if pyarrow
        is not installed, without both if there are no knots.
    """
    lines = _lines_of(folder)
    table = lines.with_suffix(".parquet")
    lines.unlink(missing_ok=True)
    table.unlink(missing_ok=True)
    if not knots:
        return {}
    with whole_file(lines) as part:
        part.write_bytes(msgspec.json.Encoder().encode_lines(knots))
    try:
        export = exporter_at(table)
    except InvalidInputError:
        # pyarrow is missing
        return {"trajectory": lines}
    assert export is not None  # of this ending
    columns = knot_columns(knots[0])
    paths = [column.path or (column.name,) for column in columns]
    plain = map(msgspec.to_builtins, knots)
    export(table, columns, ([value_at(knot, path) for path in paths] for knot in plain))
    return {"trajectory": lines, "trajectory table": table}


def read_trajectory(folder: Path) -> list[KnotReply]:
    """Read the knots that `write_trajectory` has written into a folder.

    Raises
    ------
    InvalidInputError
        If the folder has no trajectory, or a line of it is no knot, or does not follow the one
        before: a knot is missing, the times decrease, or limbs, hands or joints are others.
    """
    path = _lines_of(folder)
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InvalidInputError(
            f"{path}: {error.strerror}; write it with: {_command(folder)}", field="DIR"
        ) from None
    knots: list[KnotReply] = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            knots.append(msgspec.json.decode(line, type=KnotReply))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InvalidInputError(f"{path}, line {number}: {error}", field="DIR") from None
        wrong = _wrong_alone(knots[-1]) or (_wrong_after(*knots[-2:]) if len(knots) > 1 else None)
        if wrong is not None:
            raise InvalidInputError(
                f"{path}, line {number}: {wrong}; write it again with: {_command(folder)}",
                field="DIR",
            )
    if not knots:
        raise InvalidInputError(f"{path}: has no knots", field="DIR")
    return knots


def _wrong_alone(knot: KnotReply) -> str | None:
    """Return what is wrong with the numbers of a knot that are played; None if nothing is."""
    if not knot.time <= 1e9:
        return f"time must be at most 1e9 s, got {knot.time:g} s"
    x, turn = knot.body.position, knot.body.orientation
    if len(x) != 3 or len(turn) != 4 or not abs(math.hypot(*turn) - 1.0) <= 1e-6:
        return "body must have three coordinates and a unit quaternion [x, y, z, w]"
    for hand in knot.hands:
        if len(hand.tensions) != len(FINGERS) or min(hand.tensions) < 0.0:
            return f"tensions of {hand.limb} must be {len(FINGERS)}, none below zero"
    return None


def _wrong_after(before: KnotReply, knot: KnotReply) -> str | None:
    """Return why a knot cannot follow another; None if it can."""
    if not knot.time >= before.time:
        return f"time must not decrease, got {knot.time:g} s after {before.time:g} s"
    if knot.index != before.index + 1:
        return f"index must be {before.index + 1}, got {knot.index}: knots are missing"
    here, there = ({limb: len(own) for limb, own in each.joints.items()} for each in (before, knot))
    if here != there:
        return "joints must be of the same limbs, and as many, as in the line before"
    if [hand.limb for hand in before.hands] != [hand.limb for hand in knot.hands]:
        return "hands must be of the same limbs, in the same order, as in the line before"
    return None


def trajectory_digest(folder: Path, rates: Mapping[str, float]) -> str:
    """Return a digest (SHA-256, hexadecimal) of a folder's trajectory and the controller's rates.

    Parameters
    ----------
    folder : Path
        Folder with the file that `write_trajectory` has written.
    rates : mapping of str to float
        As `Climb.rates`.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    found = hashlib.sha256(json.dumps(dict(rates), sort_keys=True).encode())
    found.update(_lines_of(folder).read_bytes())
    return found.hexdigest()


def read_climb(folder: Path) -> tuple[list[KnotReply], ClimbSummary]:
    """Read a climb that is to be played: knots and summary, as one command has written both.

    Raises
    ------
    InvalidInputError
        If a file is missing or cannot be read, the trajectory is cut off, of another climb, or
        edited: its knots have been verified as they were written; or if it lies beside a search
        that found no climb.
    """
    knots, about = read_trajectory(folder), read_climb_summary(folder)
    again, count = f"write both again with: {_command(folder)}", knots[-1].index + 1
    if count != about.climb.knots:
        raise InvalidInputError(
            f"{folder}: the trajectory ends after {count} knots, the climb of summary.json has "
            f"{about.climb.knots}; {again}",
            field="DIR",
        )
    if trajectory_digest(folder, about.climb.rates) != about.climb.digest:
        raise InvalidInputError(
            f"{folder}: the trajectory, or its rates in summary.json, are not those that were "
            f"planned (climb.digest differs): edited knots are not verified; {again}",
            field="DIR",
        )
    searched = all((folder / name).exists() for name in ("wall.npz", "wall.png"))
    if searched and not (folder / "route.json").exists():
        raise InvalidInputError(
            f"{folder}: has a search for a climb (wall.png) that found no route.json, and the "
            "trajectory of another climb; write that one to a folder of its own",
            field="DIR",
        )
    return knots, about


class ClimbOutcome(msgspec.Struct):
    """End of a climb in a summary.

    Attributes
    ----------
    failure : ClimbFailureReply or None
        Why it ends early; None if it runs from end to end.
    knots : int
        Number of knots.
    rates : dict of str to float
        Rates of the controller on which the times rest, as of `Climb`.
    digest : str
        As `trajectory_digest` returns it.
    """

    failure: ClimbFailureReply | None
    knots: int
    rates: dict[str, float]
    digest: str


class ClimbSummary(msgspec.Struct):
    """The parts of ``summary.json`` that are needed to play a climb."""

    route: str
    robot: str
    climb: ClimbOutcome


def read_climb_summary(folder: Path) -> ClimbSummary:
    """Read the parts of the ``summary.json`` beside a trajectory that are needed to play it.

    Raises
    ------
    InvalidInputError
        If there is no such file, or it is of a route without a trajectory.
    """
    path = folder / "summary.json"
    try:
        return msgspec.json.decode(path.read_bytes(), type=ClimbSummary)
    except OSError as error:
        message = str(error.strerror)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        message = str(error)
    raise InvalidInputError(f"{path}: {message}; write it with: {_command(folder)}", field="DIR")


def _command(folder: Path) -> str:
    """Return the command that writes a climb into a folder: the one that has written there."""
    route, climb = f"crux route ROUTE -o {folder}", f"crux climb ROCK --from … --to … -o {folder}"
    if (folder / "wall.npz").exists():
        return climb
    return route if (folder / "stages.csv").exists() else f"{route}, or {climb}"


def _lines_of(folder: Path) -> Path:
    return folder / "trajectory.jsonl"


def knot_columns(knot: KnotReply) -> tuple[Column, ...]:
    """Return the columns of a table of knots, for the limbs and joints that a knot has."""
    return tuple(_columns(knot))


def _columns(knot: KnotReply) -> Iterator[Column]:
    yield Column("index", "int", "1", "of the knot, from zero")
    yield Column("move", "int", "1", "its move, from one; zero is the start")
    yield Column("phase", "text", "", "part of the move that the knot ends, or is in")
    yield Column("limb", "text", "", "that moves")
    yield Column("stage", "int", "1", "stage of the route that the knot is the plan of")
    yield Column("time_s", "float", "s", "since the start", ("time",))
    yield Column("utilisation", "float", "1", "the largest of any limit")
    yield Column("bound", "float", "1", "largest utilisation on the way from the knot before")
    for part in LimitName.__struct_fields__:
        meaning = f"{part} of the limit that is used most"
        yield Column(f"limiting_{part}", "text", "", meaning, ("limiting", part))
    yield Column("verified", "bool", "", "whether the knot has passed its independent check")
    yield from _pose("body", "B", ("body",))
    for limb, angles in knot.joints.items():
        for i in range(len(angles)):
            name, which = f"{limb}_joint_{i + 1}", f"joint {i + 1} of the limb, from the body"
            yield Column(f"{name}_rad", "float", "rad", f"angle of {which}", ("joints", limb, i))
            torque = ("joint_torque", limb, i)
            yield Column(f"{name}_torque_Nm", "float", "N·m", f"torque of {which}", torque)
    for at, hand in enumerate(knot.hands):
        here, limb = ("hands", at), hand.limb
        yield Column(f"{limb}_on_rock", "bool", "", "whether the hand touches", (*here, "on_rock"))
        yield from _pose(f"{limb}_hand", "H", (*here, "pose"))
        for i, finger in enumerate(FINGERS):
            name, whose = f"{limb}_{finger}", "of its tendon"
            at_tension, at_winch = (*here, "tensions", i), (*here, "winch_angles", i)
            yield Column(f"{name}_tension_N", "float", "N", f"tension {whose}", at_tension)
            yield Column(f"{name}_winch_rad", "float", "rad", f"winch angle {whose}", at_winch)
        wrenches = {
            "wrench": ("", "of the hand on the rock, in H"),
            "wrench_in_world": ("world_", "of the rock on the hand, in W about its origin"),
        }
        for part, (word, meaning) in wrenches.items():
            for i, axis in enumerate(WRENCH_AXES):
                unit = "N" if axis.startswith("f") else "N·m"
                name = f"{limb}_{word}{axis}_{unit.replace('·', '')}"
                yield Column(name, "float", unit, f"{axis} {meaning}", (*here, part, i))


def _pose(name: str, frame: str, path: tuple[str | int, ...]) -> Iterator[Column]:
    for i, axis in enumerate("xyz"):
        meaning = f"{axis} of the origin of {frame}, in W"
        yield Column(f"{name}_{axis}_m", "float", "m", meaning, (*path, "position", i))
    for i, part in enumerate(("qx", "qy", "qz", "qw")):
        meaning = f"{part[1]} of the quaternion of {frame} in W"
        yield Column(f"{name}_{part}", "float", "1", meaning, (*path, "orientation", i))
