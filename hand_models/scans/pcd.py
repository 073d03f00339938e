"""Read PCD files: check the header against the file's size, then read points and scanner's pose."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from hand_models.base import InvalidInputError, Pose, to_install
from hand_models.scans.scan import AXIS_NAMES, RawScan

__all__ = ["read_pcd"]

UNKNOWN_VIEWPOINT: Final = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""The VIEWPOINT that programs write if they know none: zero position, no rotation."""


def read_pcd(path: Path) -> RawScan:
    """Read the points and the viewpoint of a PCD file (ascii, binary or binary_compressed).

    A VIEWPOINT with a rotation is the pose of the scanner in whose frame the points are. Without a
    rotation it is the scanner's position in the points' axes.

    Raises
    ------
    InvalidInputError
        If the file is broken or cut short, has no x, y or z, or the package pypcd4 is missing.
    """
    with path.open("rb") as file:
        # a PCD file has its header in the first 64 KiB
        _check_header(path, file.read(65_536), path.stat().st_size)
    try:
        from pypcd4.pypcd4 import PointCloud
    except ImportError:
        raise InvalidInputError(
            f"reading PCD needs the package pypcd4: {to_install('scans')}"
        ) from None
    cloud = PointCloud.from_path(path)
    own = {field.lower(): field for field in reversed(cloud.fields)}
    absent = [axis for axis in AXIS_NAMES if axis not in own]
    if absent:
        raise InvalidInputError(
            f"fields x, y and z are needed, {absent[0]} is missing: {path}; "
            "export it again with them"
        )
    points = np.column_stack(
        [np.atleast_1d(cloud.pc_data[own[axis]]) for axis in AXIS_NAMES]
    ).astype(float)
    if len(points) != cloud.metadata.points:
        raise InvalidInputError(
            f"{len(points)} of {cloud.metadata.points} points are there, cut short: {path}; export "
            "it again"
        )
    if tuple(cloud.metadata.viewpoint) == UNKNOWN_VIEWPOINT:
        return RawScan(points)
    x, y, z, *turn = cloud.metadata.viewpoint
    length = math.hypot(*turn)
    if not (math.isfinite(x + y + z) and math.isfinite(length) and length > 0.0):
        raise InvalidInputError(
            "VIEWPOINT of the header must be finite, with a quaternion that is not zero, got "
            f"{' '.join(f'{x:g}' for x in cloud.metadata.viewpoint)}: {path}"
        )
    w, *axis = (part / length for part in turn)
    return RawScan(points, scanner=Pose.from_quaternion([x, y, z], [*axis, w]))


def _check_header(path: Path, head: bytes, size: int) -> None:
    """Refuse what has no header, and a header that names more than can be in the file."""
    data = head.find(b"\n", head.find(b"\nDATA") + 1) + 1
    lines = [words for line in head[:data].split(b"\n") if (words := line.split())]
    named = [words for words in lines if not words[0].startswith(b"#")]
    found = {words[0].upper(): words[1:] for words in named}
    if b"FIELDS" not in found or b"DATA" not in found:
        raise InvalidInputError(
            f"not a PCD file, its header is missing: {path}; export it again as PCD"
        )
    # pypcd4 looks no farther than ten lines, comments apart
    if len(found) < len(named) or len(named) > 10:
        raise InvalidInputError(
            f"the header must have at most 10 lines, each key once, got {len(named)} lines "
            f"with {len(found)} keys: {path}; remove the lines that are extra or repeated"
        )
    try:
        sizes, counts = ([int(each) for each in found[name]] for name in (b"SIZE", b"COUNT"))
        rows = [int(found[name][0]) for name in (b"WIDTH", b"HEIGHT", b"POINTS")]
        width, height, points = rows
        kind = found[b"DATA"][0]
    except (KeyError, IndexError, ValueError):
        keys = (b"SIZE", b"COUNT", b"WIDTH", b"HEIGHT", b"POINTS", b"DATA")
        got = ", ".join(f"{str(key, 'ascii')} {_words(found.get(key, [])) or '-'}" for key in keys)
        raise InvalidInputError(
            "the header must have SIZE, COUNT, WIDTH, HEIGHT and POINTS, all whole numbers, and a "
            f"format after DATA, got {got}: {path}; export it again"
        ) from None
    kinds, pose = found.get(b"TYPE", []), found.get(b"VIEWPOINT", UNKNOWN_VIEWPOINT)
    if len(kinds) != len(sizes) or not {*kinds} <= {b"F", b"I", b"U"}:
        raise InvalidInputError(
            f"TYPE of the header must be F, I or U for each field, got {_words(kinds)}: {path}",
            field="file",
        )
    if len(pose) != len(UNKNOWN_VIEWPOINT):
        raise InvalidInputError(
            "VIEWPOINT of the header must be seven numbers, a position and a quaternion [w, x, "
            f"y, z], got {_words(pose)}: {path}",
            field="file",
        )
    if min(sizes + counts + rows) < 0:
        raise InvalidInputError(
            "SIZE, COUNT, WIDTH, HEIGHT and POINTS of the header must not be negative, got "
            f"{min(sizes + counts + rows)}: {path}"
        )
    # the longest descriptors in use have some 2,000 numbers
    if not 0 < sum(counts) <= 10_000:
        raise InvalidInputError(
            "the numbers of a point, the sum of COUNT, must be 1 to 10,000, got "
            f"{sum(counts):,}: {path}"
        )
    if width * height != points:
        raise InvalidInputError(
            f"WIDTH {width} times HEIGHT {height} of the header must be POINTS, got {points}: "
            f"{path}"
        )
    left, record = size - data, sum(a * b for a, b in zip(sizes, counts, strict=False))
    if kind == b"ascii":
        needed = 2 * points * sum(counts) - 1  # a digit and a blank each
    elif kind == b"binary":
        needed = points * record
    else:
        sizes_of = head[data : data + 8].ljust(8, b"\0")
        packed, unpacked = struct.unpack("<II", sizes_of)
        # LZF writes at most 264 bytes as three
        needed = 8 + max(packed, -(-max(unpacked, points * record) // 100))
    if needed > left:
        raise InvalidInputError(
            f"{points:,} points need at least {needed:,} bytes, and {left:,} are there, cut short: "
            f"{path}; export it again"
        )


def _words(values: Sequence[bytes | float]) -> str:
    """Return what a line of a header says after its name."""
    return " ".join(str(each, "ascii", "replace") for each in values if isinstance(each, bytes))
