"""Read tables in text: one point per line, as programs and people write them."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.scans.scan import AXIS_NAMES, RawScan

__all__ = ["read_columns"]


class _Style(NamedTuple):
    """Mark between the columns of a table, None for blanks, and mark of its decimals."""

    mark: str | None
    decimal: str


def read_columns(path: Path) -> RawScan:
    """Read points from a text file: one per line, separated by commas, semicolons or blanks.

    A first line without numbers names the columns; without names the first three columns are read.
    A first line with the number of the other lines is left out. Commas may mark decimals, unless
    commas separate the columns, too. An empty cell is not finite (NaN).

    Raises
    ------
    InvalidInputError
        If the file is not a text, columns are missing or ambiguous, or a line is not a point.
    """
    whole = _text(path).rstrip("\x1a").splitlines()  # old programs end a file with that
    places = [i for i, line in enumerate(whole) if line.strip() and line.strip()[0] != "#"]
    lines = [whole[i] for i in places]
    # the count stands before the points, and before or after the names
    for i, line in enumerate(lines[:2]):
        if _is_count(line, len(lines) - i - 1, path):
            del lines[i], places[i]
            break
    if not lines:
        return RawScan(np.empty((0, 3)))
    sample = 1000  # lines that show how a table is written
    style = _style(lines[: sample + 1], path)
    first = _cells(lines[0], style)
    names = None
    # a line of numbers whose decimals have the other mark is no names, and refused below
    if not any(_numbers(first, style._replace(decimal=mark), finite=0) for mark in ".,"):
        if any(_numbers([cell] * len(AXIS_NAMES), style) for cell in first if cell):
            first_line = f"line {places[-len(lines)] + 1}, {lines[0].strip()[:60]!r}, has"
            raise InvalidInputError(
                f"{first_line} numbers among other words, and is neither three numbers x, y and z "
                f"nor names of columns: {path}"
            )
        names = _names(first, style)
        del lines[0]
    width = len(_cells(lines[0], style)) if lines else len(names or ())
    if width < len(AXIS_NAMES):
        raise InvalidInputError(
            f"three columns are needed, the first line has {width}: {path}; write x, y and z of a "
            "point on each line"
        )
    columns = [0, 1, 2] if names is None else _meant(names, width, path)
    if not lines:
        return RawScan(np.empty((0, 3)))
    if names is None:
        _check_unnamed(lines[:sample], style, width, path)
    numbers = [place + 1 for place in places[-len(lines) :]]
    return RawScan(_read(lines, numbers, style, columns, path))


def _text(path: Path) -> str:
    """Return a text in UTF-8, or in UTF-16 if it begins so; other letters stand in names only."""
    content = path.read_bytes()
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    if b"\0" in content:
        raise InvalidInputError(f"not a text file: {path}; export the points as text")
    return content.decode("utf-8-sig", "replace")


def _is_count(line: str, rest: int, path: Path) -> bool:
    """Return whether a line is the number of those after it; refuse another number."""
    if not (line.strip().isdecimal() and rest):
        return False
    if int(line) != rest:
        raise InvalidInputError(
            f"the line {line.strip()!r} is no point; as the number of points it is wrong, as "
            f"{rest:,} lines follow: {path}; export it again, or remove what is no point",
        )
    return True


def _style(lines: Sequence[str], path: Path) -> _Style:
    """Return the way of writing in which most of some lines are three numbers or more.

    The first line, which may be names, decides only between ways of equally many others.
    """
    # in the order in which they are tried
    marks = ((";", "."), (";", ","), (None, "."), (",", "."), (None, ","))
    styles = [_Style(*each) for each in marks]
    some = lines[1:] or lines
    fits = [
        [_numbers(_cells(line, style), style) for line in (*some, lines[0])] for style in styles
    ]
    ranks = [(sum(others), first) for *others, first in fits]
    best = max(ranks)
    if not best[0]:
        if all(re.fullmatch(r"[\s,;]*(nan[\s,;]*)+", line.lower()) for line in lines):
            raise InvalidInputError(
                f"all numbers are nan: {path}; export it again with the points of the rock"
            )
        raise InvalidInputError(
            f"no line has three numbers separated by commas, semicolons or spaces: {path}; write "
            f"x, y and z of a point on each line, without other marks, not {some[0].strip()[:60]!r}"
        )
    return styles[ranks.index(best)]


def _cells(line: str, style: _Style) -> list[str]:
    if style.mark == "," and line.rstrip().endswith(",") and line.count(",") >= len(AXIS_NAMES):
        line = line.rstrip()[:-1]
    return [cell.strip().strip("\"'") for cell in line.strip("\r\n").split(style.mark)]


def _numbers(cells: Sequence[str], style: _Style, finite: int = 1) -> bool:
    """Return whether the first three cells are numbers, at least ``finite`` of them finite."""
    try:
        found = [_number(cell, style) for cell in cells[: len(AXIS_NAMES)]]
    except ValueError:
        return False
    return len(found) == len(AXIS_NAMES) and sum(map(np.isfinite, found)) >= finite


def _number(cell: str, style: _Style) -> float:
    if style.decimal == ",":
        if "." in cell:
            raise ValueError(_mixed(cell, "point", "commas"))
        cell = cell.replace(",", ".")
    elif "," in cell:
        raise ValueError(_mixed(cell, "comma", "points"))
    try:
        return float(cell or "nan")
    except ValueError:
        raise ValueError(f"{cell!r} is not a number") from None


def _mixed(cell: str, own: str, usual: str) -> str:
    return (
        f"{cell!r} has a decimal {own}, but the file's decimals are {usual}; write all numbers "
        "with one of them, and without thousands separators"
    )


def _names(cells: Sequence[str], style: _Style) -> list[str]:
    """Return columns' names without marks and unit: ``//X``, ``x [m]`` and ``X_m`` are x."""
    if len(cells) < len(AXIS_NAMES) and style.mark != ",":
        # they are parted by something else than the numbers
        cells = re.split(r"[\s,;]+", " ".join(cells))
    bare = [re.sub(r"[\[(].*", "", cell.strip(" \t\"'/#")).strip().lower() for cell in cells]
    found = [re.sub(r"[_ ](m|cm|mm)$", "", name) for name in bare]
    if style.mark is None:
        found = [name for name in found if name]
    if set(AXIS_NAMES) <= set(found):
        return found
    others = {
        **dict.fromkeys(("easting", "east", "e", "points:0"), "x"),
        **dict.fromkeys(("northing", "north", "n", "points:1"), "y"),
        **dict.fromkeys(("height", "elevation", "elev", "altitude", "h", "points:2"), "z"),
    }
    return [others.get(name, name) for name in found]


def _meant(names: Sequence[str], width: int, path: Path) -> list[int]:
    """Return where x, y and z are among columns that have names."""
    if set(AXIS_NAMES) <= set(names):
        if len(names) > width:
            raise InvalidInputError(
                f"{len(names)} columns have names ({', '.join(names)}), and the next line has "
                f"{width} numbers; give each named column a number, or remove a name: {path}"
            )
        return [names.index(axis) for axis in AXIS_NAMES]
    angles = ("lat", "lon", "lng", "long", "latitude", "longitude")
    degrees = [name for name in names if name in angles]
    if degrees:
        raise InvalidInputError(
            f"column {degrees[0]} is in degrees, not in a unit of length: project it to metres "
            f"(UTM or the national grid) first: {path}"
        )
    if len(names) == len(AXIS_NAMES) == width:
        return [0, 1, 2]
    raise InvalidInputError(
        f"no columns are named x, y and z, got {', '.join(names[:9])}: name them so in the first "
        f"line of {path}"
    )


def _check_unnamed(lines: Sequence[str], style: _Style, width: int, path: Path) -> None:
    """Refuse a table whose first three columns are hardly x, y and z."""
    some = [_cells(line, style) for line in lines]
    whole = all(cell.removeprefix("-").isdecimal() for cells in some for cell in cells)
    if style.mark == "," and width == 2 * len(AXIS_NAMES) and whole:
        raise InvalidInputError(
            "commas separate the columns and are in the numbers, which is ambiguous: use decimal "
            f"points, or semicolons between the columns: {path}"
        )
    begin = [cells[0] for cells in some]
    if width > len(AXIS_NAMES) and len(some) > 2 and all(cell.isdecimal() for cell in begin):
        numbers = [int(cell) for cell in begin]
        if numbers == list(range(numbers[0], numbers[0] + len(numbers))):
            raise InvalidInputError(
                f"the first column is the index of the point, {numbers[0]} to "
                f"{numbers[-1]}, not x: name the columns in the first line of {path}, such as "
                "index,x,y,z"
            )


def _read(
    lines: Sequence[str],
    numbers: Sequence[int],
    style: _Style,
    columns: Sequence[int],
    path: Path,
) -> Array:
    """Return the numbers of columns; ``numbers``: those of the lines in the file."""
    if style == _Style(None, ".") or style.mark:
        text = "\n".join(lines)
        if style.decimal == ",":
            text = text.replace(",", ".")
        try:
            return np.asarray(
                np.loadtxt(
                    StringIO(text), delimiter=style.mark, usecols=columns, ndmin=2, quotechar='"'
                )
            )
        except ValueError:
            pass  # slower, for what has empty cells
    found = np.empty((len(lines), len(columns)))
    for i, (number, line) in enumerate(zip(numbers, lines, strict=True)):
        cells, where = _cells(line, style), f"line {number}, {line.strip()[:60]!r},"
        if len(cells) <= max(columns):
            raise InvalidInputError(
                f"{where} has {len(cells)} columns, {max(columns) + 1} are needed: {path}"
            )
        try:
            found[i] = [_number(cells[column], style) for column in columns]
        except ValueError as error:
            raise InvalidInputError(
                f"{where} is not three numbers x, y and z: {error}: {path}"
            ) from None
    return found
