"""Scans for tests: rock that is a formula, and files that others would write."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, TiffImagePlugin
from pypcd4 import Encoding, PointCloud


def relief(x, y):
    """Heights of smooth rock [m]."""
    return 0.01 * np.sin(20.0 * x) + 0.008 * np.cos(25.0 * y)


def wall(step=0.004, half=0.12, without=0.0):
    """Points on a wall y = relief that is seen from −y, but for a round hole in the middle [m]."""
    line = np.arange(-half, half + 0.5 * step, step)
    x, z = (v.ravel() for v in np.meshgrid(line, line))
    seen = np.hypot(x, z) > 0.5 * without
    return np.column_stack([x, 1.0 - relief(x, z), z])[seen]


def write_cloud(path: Path, points, encoding: str = "ascii") -> Path:
    """Write points in the format of a path's ending."""
    match path.suffix:
        case ".pcd":
            cloud = PointCloud.from_points(points, ("x", "y", "z"), (np.float64,) * 3)
            cloud.save(path, Encoding(encoding))
        case ".ply":
            cloud = trimesh.PointCloud(points)
            path.write_bytes(cloud.export(file_type="ply", encoding=encoding or "binary"))
        case ".csv":
            np.savetxt(path, points, delimiter=",", header="x,y,z", comments="")
        case _:
            np.savetxt(path, points)
    return path


def write_geotiff(path: Path, heights, cell: float, *, degrees: bool = False, **options) -> Path:
    """Write heights as 32-bit floats, −9999 where there are none."""
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    for tag, kind, value in (
        (33550, 12, (cell, cell, 0.0)),
        (34735, 3, (1, 1, 0, 1, 1024, 0, 1, 2 if degrees else 1)),
        (42113, 2, "-9999"),
    ):
        tags.tagtype[tag] = kind
        tags[tag] = value
    full = np.where(np.isfinite(heights), heights, -9999.0).astype(np.float32)
    Image.fromarray(full).save(path, tiffinfo=tags, **options)
    return path


def write_esri(path: Path, heights, cell: float) -> Path:
    """Write heights with a header of six lines."""
    rows, columns = heights.shape
    header = (
        f"ncols {columns}\nnrows {rows}\nxllcorner 10.0\nyllcorner 20.0\n"
        f"cellsize {cell!r}\nNODATA_value -9999"
    )
    full = np.where(np.isfinite(heights), heights, -9999.0)
    np.savetxt(path, full, header=header, comments="")
    return path
