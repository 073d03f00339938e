"""Read scans from files, in metres and with z up."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, Pose, finite_vector, reading_file
from hand_models.parameters import scan_table
from hand_models.rock import MESH_ENDINGS, read_vertices
from hand_models.scans.columns import read_columns
from hand_models.scans.grids import is_esri, read_esri, read_geotiff, read_numpy
from hand_models.scans.pcd import read_pcd
from hand_models.scans.scan import UNIT_METRES, UP_ROTATIONS, RawScan, Scan, Unit, Up, box_about

__all__ = ["SCAN_ENDINGS", "read_scan"]

SCAN_ENDINGS: Final = (
    ".pcd",
    *MESH_ENDINGS,
    *(".xyz", ".txt", ".csv", ".pts", ".asc"),
    *(".npy", ".npz", ".tif", ".tiff"),
)
"""Endings of files that can be read: point clouds, triangles, tables in text, grids of heights."""

ADVICE_BY_ENDING: Final = {
    **dict.fromkeys(
        (".las", ".laz", ".e57", ".ptx", ".fls", ".rcp", ".bin"),
        "save it as PLY or PCD with 64-bit coordinates, or as text with all decimals, in "
        "CloudCompare or by `pdal translate`",
    ),
    **dict.fromkeys(
        (".glb", ".gltf", ".fbx", ".dae", ".3mf", ".3ds", ".wrl", ".usdz"),
        "save its triangles as PLY, STL or OBJ, in MeshLab or Blender",
    ),
    **dict.fromkeys(
        (".vrt", ".img", ".dem", ".hgt", ".adf", ".nc"),
        "make it GeoTIFF by `gdal_translate -of GTiff`",
    ),
    **dict.fromkeys(
        (".gz", ".zip", ".bz2", ".xz", ".zst", ".7z", ".rar", ".tgz"),
        "it is packed: unpack it first",
    ),
}
"""Advice on how to convert files of other kinds, by their ending."""

ENDING_BY_BEGINNING: Final = {
    b"ply\n": ".ply",
    b"ply\r": ".ply",
    b"# .PCD": ".pcd",
    b"LASF": ".las",
    b"ASTM-E57": ".e57",
    b"\x93NUMPY": ".npy",
    b"II*\0": ".tif",
    b"MM\0*": ".tif",
    b"PK\x03\x04": ".zip",
    b"\x1f\x8b": ".gz",
    b"BZh": ".bz2",
    b"\xfd7zXZ": ".xz",
    b"7z\xbc\xaf": ".7z",
    b"glTF": ".glb",
}
"""First bytes of files, by which a file with the ending of another kind is recognised."""


def read_scan(
    path: Path,
    *,
    unit: Unit = "m",
    up: Up = "z",
    view: ArrayLike | None = None,
    viewpoint: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    cell: float | None = None,
    width: float | None = None,
) -> Scan:
    """Read a scan from a file; points that are not finite are left out, and several at zero.

    Parameters
    ----------
    path : Path
        A point cloud (PCD, PLY, OBJ, XYZ, CSV), triangles (PLY, OBJ, STL, OFF), or a grid of
        heights (``.npy``, ``.npz``, GeoTIFF, ESRI ASCII): columns along x, rows against y, heights
        along z.
    unit : {'m', 'cm', 'mm'}
        Unit of the file's numbers.
    up : {'x', 'y', 'z', '-x', '-y', '-z'}
        The file's axis that points up.
    view : array_like, shape (3,), optional
        Direction in which the scanner looked, in the file's axes. By default from the viewpoint, if
        that is given, to the points' middle; down a grid's heights; else the result of
        `Scan.direction`.
    viewpoint : array_like, shape (3,), optional
        Position of the scanner, in the file's axes and unit; by default that of a PCD file, else
        the file's origin. With a view or a viewpoint, a PCD's VIEWPOINT is not used; without,
        its rotation, if it has one, takes the points from the scanner's frame to the world.
    origin : array_like, shape (3,), optional
        Wanted origin of the rock's frame, in the file's axes and unit; by default the middle.
    cell : float, optional
        Distance between neighbours of a grid, in the file's unit, in place of the file's.
    width : float, optional
        Length of the longest side, to which all lengths are scaled, in place of a unit [m].

    Raises
    ------
    InvalidInputError
        If the file cannot be read or has no three points, a grid's cell is not known, or a
        parameter is out of range.
    """
    if unit not in UNIT_METRES:
        raise InvalidInputError(f"valid are {', '.join(UNIT_METRES)}, got {unit!r}", field="unit")
    if up not in UP_ROTATIONS:
        raise InvalidInputError(f"valid are {', '.join(UP_ROTATIONS)}, got {up!r}", field="up")
    raw = _raw(path, cell)
    if raw.scanner is not None and view is None and viewpoint is None:
        raw = _in_world(raw, raw.scanner)
    else:
        raw = raw._replace(scanner=None)
    read = len(raw.points)
    raw = _finite(_measured(raw))
    _check_numbers(raw.points, read, path)
    scale, turn = _scale(raw.points, unit, width), UP_ROTATIONS[up]
    _check_digits(raw.points, scale, path)
    if np.equal(*box_about(raw.points)).all():
        place = ", ".join(f"{x:g}" for x in raw.points[0])
        raise InvalidInputError(
            f"all {len(raw.points):,} points of {path} are at ({place}); a scan has points at "
            "different places: export it again",
            field="file",
        )

    def placed(point: ArrayLike, field: str) -> Array:
        return np.asarray(scale * turn @ finite_vector(point, 3, field))

    points = scale * raw.points @ turn.T
    seen = None if view is None else turn @ finite_vector(view, 3, "view")
    known = viewpoint
    if known is None and raw.scanner is not None:
        known = raw.scanner.position
    scanner = placed((0.0, 0.0, 0.0) if known is None else known, "viewpoint")
    if seen is None and viewpoint is not None:
        seen = points.mean(axis=0) - scanner
    elif seen is None and raw.heights:
        seen = -turn[:, 2]
    return Scan(
        points=points,
        read=read,
        view=None if seen is None else _unit_vector(seen),
        viewpoint=scanner,
        origin=None if origin is None else placed(origin, "origin"),
        assumed=known is None,
        heights=raw.heights,
        faces=raw.faces,
    )


def _in_world(raw: RawScan, scanner: Pose) -> RawScan:
    """Return points placed by the pose of the scanner in whose frame they are, if it is turned."""
    # a turn below 1e-3 rad is taken for none
    if 0.5 * (float(np.trace(scanner.rotation)) - 1.0) > math.cos(1e-3):
        return raw
    return raw._replace(points=raw.points @ scanner.rotation.T + scanner.position)


def _measured(raw: RawScan) -> RawScan:
    """Return a cloud whose points at exactly (0, 0, 0), if there are several, are not finite.

    So scanners write directions in which nothing was measured.
    """
    nowhere = np.asarray((raw.points == 0.0).all(axis=1))
    if raw.heights or raw.faces is not None or np.count_nonzero(nowhere) < 2 or nowhere.all():
        return raw
    return raw._replace(points=np.where(nowhere[:, None], np.nan, raw.points))


def _finite(raw: RawScan) -> RawScan:
    """Return the points that are finite, and the triangles of three such."""
    finite = np.asarray(np.isfinite(raw.points).all(axis=1))
    if finite.all():
        return raw
    faces = raw.faces
    if faces is not None:
        faces = (np.cumsum(finite) - 1)[faces[np.all(finite[faces], axis=1)]]
    return raw._replace(points=raw.points[finite], faces=faces)


def _check_numbers(points: Array, read: int, path: Path) -> None:
    if len(points) < 3:
        more = read - len(points)
        others = f", and {more} that are not finite" if more else ""
        raise InvalidInputError(
            f"at least three points are needed, {path} has {len(points)}{others}: export it again "
            "with the points of the rock",
            field="file",
        )
    largest = float(np.abs(points).max())
    most = 1e12  # what is beyond that is lost in rounding
    if largest > most:
        raise InvalidInputError(
            f"coordinates must be within ±{most:g}, got {largest:.3g} in {path}; write nan for "
            "points that were not measured",
            field="file",
        )


def _check_digits(points: Array, scale: float, path: Path) -> None:
    """Refuse coordinates that come in steps too large for a hand, and name their cause.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        In the file's unit.
    scale : float
        Metres of that unit.
    path : Path

    Raises
    ------
    InvalidInputError
        If they are floats of 32 bits, or were written with few digits; the field is ``file``.
    """
    largest = float(np.abs(points).max())
    coarsest = scan_table().scalar("scan", "coarsest")
    axis = int(np.abs(points).max(axis=0).argmax())
    single = float(np.spacing(np.float32(largest)))
    too_few = InvalidInputError(
        f"coordinates up to {largest:,.0f} are in steps of {single:g} {_of_unit(scale)}, as "
        "floats of 32 bits are at that size: subtract an offset (shift to a local origin) "
        f"before the export, and then give --view, or export 64-bit floats (double): {path}",
        field="file",
    )
    if scale * single > coarsest and np.array_equal(points, points.astype(np.float32)):
        raise too_few
    # of digits that programs write by default (C++ streams and %g, floats of 32 bits, and more),
    # and of floats that were converted to text
    whole = math.floor(math.log10(max(largest, 1e-300))) + 1
    steps: dict[float, int | None] = {10.0 ** (whole - digits): digits for digits in (6, 7, 8)}
    steps[single] = None
    for step in sorted(steps, reverse=True):
        if scale * step <= coarsest or not _in_steps(points[:, axis], step):
            continue
        if (digits := steps[step]) is None:
            if _alone_in_steps(points, axis, step):
                raise too_few
            continue
        distinct = len(np.unique(points, axis=0))
        # so few places that digits are taken to be lost
        if distinct <= 0.9 * len(points) or _alone_in_steps(points, axis, step):
            raise InvalidInputError(
                f"coordinates up to {largest:,.0f} have {digits} digits, steps of {step:g} "
                f"{_of_unit(scale)}, and {len(points):,} points are at {distinct:,} places: "
                "write more digits, or subtract an offset before the export, and then give "
                f"--view; or give --unit, if that is not the unit: {path}",
                field="file",
            )


def _in_steps(numbers: Array, step: float) -> bool:
    return np.allclose(numbers, step * np.round(numbers / step), rtol=1e-12, atol=0.0)


def _alone_in_steps(points: Array, axis: int, step: float) -> bool:
    """Return whether coordinates along one axis vary in steps, and along no other axis.

    Those of a grid are in steps along two.
    """
    others = np.delete(points, axis, axis=1).T
    return (
        bool(np.ptp(points[:, axis]))
        and _in_steps(points[:, axis], step)
        and not any(_in_steps(each, step) for each in others)
    )


def _of_unit(scale: float) -> str:
    """Return the unit of numbers by its metres, if it has a name."""
    return next(
        (name for name, metres in UNIT_METRES.items() if metres == scale), f"times {scale:.3g} m"
    )


def _raw(path: Path, cell: float | None) -> RawScan:
    """Return what a file has; an error whose field its reader does not name is of the file."""
    ending = path.suffix.lower()
    if ending not in SCAN_ENDINGS:
        does = ADVICE_BY_ENDING.get(ending, "")
        raise InvalidInputError(
            f"{path}: a scan's file ends in {', '.join(SCAN_ENDINGS)}" + (does and f"; {does}"),
            field="file",
        )
    with reading_file(path):
        _check_kind(path, ending)
        match ending:
            case ".npy" | ".npz":
                return read_numpy(path, cell)
            case ".tif" | ".tiff":
                return read_geotiff(path, cell)
            case ".pcd":
                read = read_pcd
            case _ if ending in MESH_ENDINGS:
                read = _read_vertices
            case _:
                if is_esri(path):
                    return read_esri(path, cell)
                read = read_columns
        if cell is not None:
            raise InvalidInputError(
                f"is for grids of heights, {path} has points: leave cell out", field="cell"
            )
        return read(path)


def _check_kind(path: Path, ending: str) -> None:
    """Refuse a file that is empty, or begins as one of another kind than its ending says."""
    with path.open("rb") as file:
        begin = file.read(max(map(len, ENDING_BY_BEGINNING)))
    if not begin:
        raise InvalidInputError(f"{path} is empty: export it again with the points of the rock")
    own = next((own for key, own in ENDING_BY_BEGINNING.items() if begin.startswith(key)), ending)
    if own not in (ending, {".tiff": ".tif", ".npz": ".zip"}.get(ending)):
        does = ADVICE_BY_ENDING.get(own, f"name it so that it ends in {own}")
        raise InvalidInputError(f"{path} is named {ending}, and begins as {own} does; {does}")


def _read_vertices(path: Path) -> RawScan:
    vertices, faces = read_vertices(path)
    return RawScan(vertices, faces=faces if len(faces) else None)


def _scale(points: Array, unit: Unit, width: float | None) -> float:
    if width is None:
        return UNIT_METRES[unit]
    if unit != "m":
        raise InvalidInputError(
            f"a unit, {unit!r}, and a width, {width} m, are given, not both are possible: remove "
            "the unit to scale by the width, or the width to keep the unit",
            field="width",
        )
    if not (math.isfinite(width) and width > 0.0):
        raise InvalidInputError(f"must be finite and above zero, got {width:g} m", field="width")
    longest = float(np.ptp(points, axis=0).max())
    if longest == 0.0:
        raise InvalidInputError(
            f"all {len(points):,} points are equal; a scan has points at different places: "
            "export it again",
            field="file",
        )
    return width / longest


def _unit_vector(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise InvalidInputError(
            "must be a direction, not zero: give one such as [0, 0, -1]", field="view"
        )
    return np.asarray(vector / length)
