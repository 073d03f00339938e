"""PCD files: their header compared with their size, then their points and the scanner's pose."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from hand_models.base import InvalidInputError, Pose, to_install
from hand_models.scans.scan import RawScan

__all__ = ["read_pcd"]

AXES: Final = ("x", "y", "z")

HEAD: Final = 65_536
"""Bytes in which a PCD file has its header."""

HEADER_LINES: Final = 10
"""Lines of a header, comments apart; the reader looks no farther."""

MOST_COLUMNS: Final = 10_000
"""Numbers of a point; the longest descriptors in use have some 2,000."""

LZF: Final = 100
"""Bytes that one compressed byte may stand for: 264 for every three."""

NOWHERE: Final = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""The VIEWPOINT that programs write which know none."""


def read_pcd(path: Path) -> RawScan:
    """Return the points of a PCD file (ascii, binary or binary_compressed), and its viewpoint.

    A VIEWPOINT with a rotation is the pose of the scanner in whose frame the points are: they are
    placed by it. Without one it says where the scanner was in the points' own axes.
    """
    with path.open("rb") as file:
        _check_header(path, file.read(HEAD), path.stat().st_size)
    try:
        from pypcd4.pypcd4 import PointCloud
    except ImportError:
        raise InvalidInputError(
            f"reading PCD needs the package pypcd4: {to_install('scans')}"
        ) from None
    cloud = PointCloud.from_path(path)
    absent = [axis for axis in AXES if axis not in cloud.fields]
    if absent:
        raise InvalidInputError(f"no field {absent[0]} in {path}")
    points = np.column_stack([np.atleast_1d(cloud.pc_data[axis]) for axis in AXES]).astype(float)
    if len(points) != cloud.metadata.points:
        raise InvalidInputError(
            f"{len(points)} of {cloud.metadata.points} points, cut short: {path}"
        )
    if tuple(cloud.metadata.viewpoint) == NOWHERE:
        return RawScan(points)
    x, y, z, *turn = cloud.metadata.viewpoint
    length = math.hypot(*turn)
    if not (math.isfinite(x + y + z) and math.isfinite(length) and length > 0.0):
        raise InvalidInputError(f"VIEWPOINT is not a pose: {cloud.metadata.viewpoint} in {path}")
    w, *axis = (part / length for part in turn)
    return RawScan(points, scanner=Pose.from_quaternion([x, y, z], [*axis, w]))


def _check_header(path: Path, head: bytes, size: int) -> None:
    """Refuse what has no header, and a header that names more than can be in the file."""
    data = head.find(b"\n", head.find(b"\nDATA") + 1) + 1
    lines = [words for line in head[:data].split(b"\n") if (words := line.split())]
    named = [words for words in lines if not words[0].startswith(b"#")]
    found = {words[0].upper(): words[1:] for words in named}
    if b"FIELDS" not in found or b"DATA" not in found:
        raise InvalidInputError(f"not a PCD file, its header is missing: {path}")
    if len(found) < len(named) or len(named) > HEADER_LINES:
        raise InvalidInputError(
            f"the header has {len(named)} lines; the maximum is {HEADER_LINES}, each once: {path}"
        )
    try:
        sizes, counts = ([int(each) for each in found[name]] for name in (b"SIZE", b"COUNT"))
        rows = [int(found[name][0]) for name in (b"WIDTH", b"HEIGHT", b"POINTS")]
        width, height, points = rows
        kind = found[b"DATA"][0]
    except (KeyError, IndexError, ValueError):
        raise InvalidInputError(
            f"SIZE, COUNT, WIDTH, HEIGHT and POINTS of the header must be whole numbers: {path}"
        ) from None
    kinds, pose = found.get(b"TYPE", []), found.get(b"VIEWPOINT", NOWHERE)
    if len(kinds) != len(sizes) or not {*kinds} <= {b"F", b"I", b"U"}:
        raise InvalidInputError(
            f"TYPE of the header must be F, I or U for each field, got {_words(kinds)}: {path}",
            field="file",
        )
    if len(pose) != len(NOWHERE):
        raise InvalidInputError(
            "VIEWPOINT of the header must be seven numbers, a position and a quaternion [w, x, "
            f"y, z], got {_words(pose)}: {path}",
            field="file",
        )
    if min(sizes + counts + rows) < 0:
        raise InvalidInputError(f"the header has a negative number: {path}")
    if not 0 < sum(counts) <= MOST_COLUMNS:
        raise InvalidInputError(
            f"a point must have 1 to {MOST_COLUMNS:,} numbers, the header of {path} has "
            f"{sum(counts):,}"
        )
    if width * height != points:
        raise InvalidInputError(
            f"WIDTH {width} times HEIGHT {height} is not POINTS {points}: {path}"
        )
    left, record = size - data, sum(a * b for a, b in zip(sizes, counts, strict=False))
    if kind == b"ascii":
        needed = 2 * points * sum(counts) - 1  # a digit and a blank each
    elif kind == b"binary":
        needed = points * record
    else:
        sizes_of = head[data : data + 8].ljust(8, b"\0")
        packed, unpacked = struct.unpack("<II", sizes_of)
        needed = 8 + max(packed, -(-max(unpacked, points * record) // LZF))
    if needed > left:
        raise InvalidInputError(
            f"{points:,} points need at least {needed:,} bytes, and {left:,} are there, cut short: "
            f"{path}"
        )


def _words(values: Sequence[bytes | float]) -> str:
    """Return what a line of a header says after its name."""
    return " ".join(str(each, "ascii", "replace") for each in values if isinstance(each, bytes))
