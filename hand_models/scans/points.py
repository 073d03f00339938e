"""Point clouds in files: PCD, PLY, and columns of text."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from hand_models.base import InvalidInputError, to_install
from hand_models.scans.scan import RawScan

__all__ = ["read_columns", "read_pcd", "read_ply"]

AXES: Final = ("x", "y", "z")

HEAD: Final = 4096
"""Bytes in which a PCD file has its header."""


def read_pcd(path: Path) -> RawScan:
    """Return the points of a PCD file (ascii, binary or binary_compressed), and its viewpoint."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    if b"FIELDS" not in head or b"DATA" not in head:
        raise InvalidInputError(f"no PCD file, its header is missing: {path}", field="file")
    try:
        from pypcd4.pypcd4 import PointCloud
    except ImportError:
        raise InvalidInputError(
            f"reading PCD needs the package pypcd4: {to_install('scans')}", field="file"
        ) from None
    cloud = PointCloud.from_path(path)
    absent = [axis for axis in AXES if axis not in cloud.fields]
    if absent:
        raise InvalidInputError(f"no field {absent[0]} in {path}", field="file")
    points = np.column_stack([np.atleast_1d(cloud.pc_data[axis]) for axis in AXES]).astype(float)
    if len(points) != cloud.metadata.points:
        raise InvalidInputError(
            f"{len(points)} of {cloud.metadata.points} points, cut short: {path}", field="file"
        )
    return RawScan(points, np.array(cloud.metadata.viewpoint[:3]))


def read_ply(path: Path) -> RawScan:
    """Return the vertices of a PLY file, whether it has faces or not."""
    from trimesh.exchange.ply import load_ply

    with path.open("rb") as file:
        found = load_ply(file, fix_texture=False, skip_materials=True)
    return RawScan(np.asarray(found["vertices"], dtype=float).reshape(-1, 3))


def read_columns(path: Path) -> RawScan:
    """Return points of a text with a point a line, parted by commas, semicolons or blanks.

    A first line that is no numbers names the columns; without the names x, y and z the first three
    are meant. What is empty is not finite.
    """
    with path.open(encoding="utf-8-sig") as file:
        lines = [line for line in file if line.strip() and not line.startswith("#")]
    if not lines:
        return RawScan(np.empty((0, 3)))
    mark = next((mark for mark in ",;" if mark in lines[0]), None)
    names = [name.strip().strip("\"'/").lower() for name in lines[0].split(mark)]
    if len(names) < len(AXES):
        raise InvalidInputError(
            f"three columns are needed, the first line has {len(names)}: {path}", field="file"
        )
    columns = [names.index(axis) if axis in names else i for i, axis in enumerate(AXES)]
    if not _all_numbers(names):
        del lines[0]
    if not lines:
        return RawScan(np.empty((0, 3)))
    read = partial(np.loadtxt, lines, delimiter=mark, usecols=columns, ndmin=2)
    try:
        return RawScan(read())
    except ValueError:
        # slower, for what has empty cells
        return RawScan(read(converters=_number, encoding="utf-8"))


def _all_numbers(cells: Sequence[str]) -> bool:
    try:
        [float(cell or "nan") for cell in cells]
    except ValueError:
        return False
    return True


def _number(cell: str) -> float:
    return float(cell.strip() or "nan")
