"""Read grids of heights from files: NumPy arrays, GeoTIFF, ESRI ASCII.

Columns go along x, rows against y: the first row has the largest y, as in pictures of maps.
"""

from __future__ import annotations

import codecs
import io
import math
import zipfile
from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, InvalidInputError, to_install
from hand_models.scans.scan import RawScan

__all__ = ["is_esri", "read_esri", "read_geotiff", "read_numpy"]

Cell = tuple[float, float]
"""Size of a grid's cell along x and along y, in the file's unit."""


class GeoTag(IntEnum):
    """Numbers of the GeoTIFF tags that are read."""

    PIXEL_SCALE = 33550
    TRANSFORMATION = 34264
    GEO_KEYS = 34735
    NO_DATA = 42113


def read_numpy(path: Path, cell: float | None) -> RawScan:
    """Read a grid of heights from an ``.npy`` file, or an ``.npz`` file, which may give dx and dy.

    Parameters
    ----------
    path : Path
    cell : float or None
        Size of a cell, in place of the file's, in the file's unit.

    Raises
    ------
    InvalidInputError
        If the file is not a grid of heights or is broken, or the cell's size is not known.
    """
    with path.open("rb") as file:
        # an .npy begins with the first, an .npz with the second
        if not file.read(6).startswith((b"\x93NUMPY", b"PK")):
            raise InvalidInputError(
                f"not a NumPy file: {path}; save it by numpy.save or numpy.savez"
            )
    arrays = _arrays(path)
    flat = [name for name, array in arrays.items() if array.ndim == 2]
    usual = ("elevation", "heights", "height", "z", "dem")
    named = [name for name in usual if name in flat]
    if len(flat) != 1 and not named:
        raise InvalidInputError(
            f"one grid of heights is needed, or one named {', '.join(usual)}; {path} has "
            f"{len(flat)} arrays of two dimensions"
        )
    heights = arrays[flat[0] if len(flat) == 1 else named[0]]
    if heights.shape[1] == 3 < heights.shape[0]:
        raise InvalidInputError(
            f"an array of three columns holds points, not a grid of heights: {path}; save the "
            "points as .xyz"
        )
    if heights.dtype.kind not in "fiu":
        raise InvalidInputError(
            f"heights must be integers or floats, got {heights.dtype} in {path}; save them as such"
        )
    return _grid(heights, _sides(cell, _numpy_cell(arrays)))


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an ``.npy`` or ``.npz``, whose headers name no more than is there."""
    if not zipfile.is_zipfile(path):
        # maps the file, which must be as long as its header says
        return {"": np.array(np.load(path, mmap_mode="r", allow_pickle=False))}
    found: dict[str, NDArray[Any]] = {}
    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            # a compressed byte stands for 1032 at most, but for more in an array of 1024 or less
            if info.file_size > 1032 * info.compress_size + 1024:
                raise InvalidInputError(f"{info.filename} in {path} is corrupt; save it again")
            with archive.open(info) as file:
                content = io.BytesIO(file.read(info.file_size))
            version = np.lib.format.read_magic(content)
            header = np.lib.format.read_array_header_1_0
            if version != (1, 0):
                header = np.lib.format.read_array_header_2_0
            shape, _, kind = header(content)
            left = info.file_size - content.tell()
            needed = math.prod(shape) * kind.itemsize
            if not kind.hasobject and needed > left:
                raise InvalidInputError(
                    f"{info.filename} in {path} is cut short: shape {shape} needs {needed:,} "
                    f"bytes, {left:,} are there; save it again"
                )
            content.seek(0)
            name = info.filename.removesuffix(".npy")
            found[name] = np.lib.format.read_array(content, allow_pickle=False)
    return found


def _numpy_cell(arrays: Mapping[str, NDArray[Any]]) -> Cell | None:
    if "dx" not in arrays:
        return None
    return float(arrays["dx"]), float(arrays.get("dy", arrays["dx"]))


def read_geotiff(path: Path, cell: float | None) -> RawScan:
    """Read the heights of a GeoTIFF of one band, in any compression that libtiff supports.

    Parameters
    ----------
    path : Path
    cell : float or None
        Size of a cell, in place of the file's, in the file's unit.

    Raises
    ------
    InvalidInputError
        If the file is not a grid of heights or is cut short, pillow is missing, or the cell's size
        is not known, as with degrees.
    """
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError:
        raise InvalidInputError(
            f"reading GeoTIFF needs the package pillow: {to_install('scans')}"
        ) from None
    try:
        image = Image.open(path, formats=["TIFF"])
    except UnidentifiedImageError:
        raise InvalidInputError(
            f"not a TIFF file of integers or 32-bit floats: {path}; convert 64-bit floats with "
            "gdal_translate -ot Float32"
        ) from None
    # heights that a byte of the file may stand for: of LZW at most 1,400
    if math.prod(image.size) > 1500 * path.stat().st_size:
        raise InvalidInputError(
            f"{path} is too small for {image.size[0]} by {image.size[1]} heights, as if cut short: "
            "export it again"
        )
    with image:
        tags = {tag: image.getexif().get(tag) for tag in GeoTag}
        heights = np.asarray(image)
    if heights.ndim != 2:
        bands = math.prod(heights.shape[2:])
        raise InvalidInputError(
            f"one band of heights is needed, got {bands}: {path}; take one by gdal_translate -b 1"
        )
    if (missing := tags[GeoTag.NO_DATA]) is not None:
        heights = _without(heights, float(str(missing).strip("\0 ")))
    return _grid(heights, _sides(cell, _geo_cell(tags)))


def _geo_cell(tags: Mapping[GeoTag, Any]) -> Cell | None:
    """Return the cell of a GeoTIFF in its unit, None if it is in degrees or not given."""
    # four numbers a key: 1024 is that of the model's type, and its value 2 means degrees
    keys = tags[GeoTag.GEO_KEYS] or ()
    if 2 in [keys[i + 3] for i in range(4, len(keys) - 3, 4) if keys[i] == 1024]:
        return None
    if (scale := tags[GeoTag.PIXEL_SCALE]) is not None:
        return float(scale[0]), float(scale[1])
    if (turn := tags[GeoTag.TRANSFORMATION]) is not None:
        across, down = np.reshape(turn, (4, 4))[:2, :2].T
        return float(np.hypot(*across)), float(np.hypot(*down))
    return None


def is_esri(path: Path) -> bool:
    """Return True if a text file is an ESRI ASCII grid, False if it may be columns of points."""
    with path.open("rb") as file:
        begin = file.read(64).removeprefix(codecs.BOM_UTF8).lstrip().lower()
    return begin.startswith((b"ncols", b"nrows"))


def read_esri(path: Path, cell: float | None) -> RawScan:
    """Read the heights of an ESRI ASCII grid.

    Parameters
    ----------
    path : Path
    cell : float or None
        Size of a cell, in place of the file's, in the file's unit.

    Raises
    ------
    InvalidInputError
        If rows and columns do not fit the heights, or the cell's size is not known.
    """
    header: dict[str, float] = {}
    # some programs write a comma before decimals, none between heights
    text = path.read_text(encoding="utf-8-sig").replace(",", ".")
    lines = (line for line in text.splitlines() if line.strip())
    first = ""
    for first in lines:
        words = first.split()
        if len(words) != 2 or not words[0][0].isalpha():
            break
        header[words[0].lower()] = float(words[1])
    values = np.array(" ".join([first, *lines]).split(), dtype=float)
    shape = int(header.get("nrows", 0)), int(header.get("ncols", 0))
    if values.size != math.prod(shape):
        raise InvalidInputError(
            f"{shape[0]} rows (NROWS) of {shape[1]} heights (NCOLS) are needed, {values.size} "
            f"heights are in {path}: export it again"
        )
    heights = _without(values.reshape(shape), header.get("nodata_value", -9999.0))
    if "cellsize" in header:
        own: Cell | None = header["cellsize"], header["cellsize"]
    else:
        own = (header["dx"], header["dy"]) if {"dx", "dy"} <= set(header) else None
    return _grid(heights, _sides(cell, own))


def _without(heights: NDArray[Any], missing: float) -> Array:
    found = np.array(heights, dtype=float)
    # a float of 32 bits is not what the text says to the last digit
    found[np.isclose(found, missing, rtol=1e-6, atol=0.0)] = np.nan
    return found


def _sides(cell: float | None, own: Cell | None) -> Cell:
    sides = own if cell is None else (cell, cell)
    if sides is None:
        raise InvalidInputError(
            "must be given: the file has no cell size in a unit of length; use that of the heights",
            field="cell",
        )
    if not all(math.isfinite(side) and side > 0.0 for side in sides):
        got = f"{sides[0]:g} by {sides[1]:g} from the file" if cell is None else f"{cell:g}"
        raise InvalidInputError(
            f"must be finite and above zero, in the file's unit, got {got}", field="cell"
        )
    return sides


def _grid(heights: NDArray[Any], cell: Cell) -> RawScan:
    rows, columns = heights.shape
    x, y = np.meshgrid(cell[0] * np.arange(columns), cell[1] * np.arange(rows)[::-1])
    points = np.stack([x, y, heights.astype(float)], axis=-1).reshape(-1, 3)
    return RawScan(points, heights=True)
