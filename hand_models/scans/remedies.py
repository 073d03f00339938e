"""Remedies for a scan that is left full of holes: each is tried before it is advised.

One remedy drops points that stand alone: the statistical outlier removal of Open3D and PCL.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import InvalidInputError
from hand_models.parameters import scan_table
from hand_models.scans.holes import Gaps
from hand_models.scans.meshing import triangulated, wider_holes
from hand_models.scans.rock import ScannedRock
from hand_models.scans.scan import Scan

__all__ = ["Remedy", "drop_outliers", "remedy"]


class Remedy(NamedTuple):
    """Options that leave few of the holes and steps of a scan, as they were tried.

    Attributes
    ----------
    option : {'std_ratio', 'hole'}
    value : float
        Of it: standard deviations, or [m].
    left : int
        Holes and steps that are left.
    std_ratio : float, optional
        Standard deviations beyond which points are dropped too, where a wider hole needs that.
    """

    option: str
    value: float
    left: int
    std_ratio: float | None = None


def remedy(
    scan: Scan, rock: ScannedRock, hole: float, *, spacing: float | None = None
) -> Remedy | None:
    """Return what would leave a scan in one piece with few holes and steps, None if nothing does.

    Few are a tenth of those that it has or of those that are many, else half of them; they are
    never many, and it has to cover half of its outline, and as much as it did. Tried are dropping
    points that stand alone (`drop_outliers`), unless some were dropped, bridging holes up to the
    palm's width, and both together.

    Parameters
    ----------
    scan : Scan
        Of points.
    rock : ScannedRock
        That was made of it.
    hole : float
        That was bridged [m].
    spacing : float, optional
        As of `mesh_scan`.
    """
    table = scan_table()
    many, open_ = table.scalar("mesh", "many_holes"), len(rock.holes) + len(rock.steps)
    enough = min(table.scalar("mesh", "left_holes") * max(open_, many), many)
    # dropped points may be of the rim: 5 % less may be covered than was
    covered = max(0.95 * rock.covered, table.scalar("mesh", "least_covered"))
    helping = []
    for option, value, std_ratio, gaps in _trials(scan, hole, spacing):
        wide = value if option == "hole" else hole
        left = sum(map(len, gaps.left(wide)))
        if gaps.covered(wide) < covered:
            continue
        found = Remedy(option, value, left, std_ratio)
        if left <= enough:
            return found
        if left <= min(0.5 * open_, many):
            helping.append(found)
    return min(helping, key=lambda each: each.left, default=None)


def _trials(
    scan: Scan, hole: float, spacing: float | None
) -> Iterator[tuple[str, float, float | None, Gaps]]:
    """Yield an option, its value, the ratio of dropped points beside it, and what is then open."""
    dropped, std_ratio = None, 2.0  # as in Open3D's example
    if not scan.outliers and len(scan.points) > scan_table().scalar("outliers", "neighbours"):
        dropped = triangulated(drop_outliers(scan, std_ratio), spacing).gaps
        yield "std_ratio", std_ratio, None, dropped
    gaps = triangulated(scan, spacing).gaps
    for wider in wider_holes(hole):
        yield "hole", wider, None, gaps
    if dropped is not None:
        for wider in wider_holes(hole):
            yield "hole", wider, std_ratio, dropped


def drop_outliers(scan: Scan, std_ratio: float, *, neighbours: int | None = None) -> Scan:
    """Return a scan without the points that are farther from their neighbours than is usual.

    A point is left out if its mean distance to its nearest neighbours is above the mean of that
    over all points by more than so many standard deviations.

    Parameters
    ----------
    scan : Scan
    std_ratio : float
        Standard deviations, above zero; 1 to 3 are usual.
    neighbours : int, optional
        Nearest other points of each; by default as ``scan.toml`` says.

    Raises
    ------
    InvalidInputError
        If a number is not above zero, there are no more points than neighbours, or the scan has
        triangles, which are kept.
    """
    if neighbours is None:
        neighbours = int(scan_table().scalar("outliers", "neighbours"))
    if not (math.isfinite(std_ratio) and std_ratio > 0.0):
        raise InvalidInputError(
            f"must be finite and above zero, got {std_ratio:g}", field="std_ratio"
        )
    if not 0 < neighbours < len(scan.points):
        raise InvalidInputError(
            f"must be from 1 to {len(scan.points) - 1}, one less than there are points, got "
            f"{neighbours}",
            field="neighbours",
        )
    if scan.faces is not None:
        raise InvalidInputError(
            "is for points, and the file has triangles: remove it", field="std_ratio"
        )
    away = scipy.spatial.cKDTree(scan.points).query(scan.points, k=neighbours + 1)[0]
    mean = np.asarray(away)[:, 1:].mean(axis=1)
    kept = mean <= mean.mean() + std_ratio * mean.std()
    return replace(scan, points=scan.points[kept], outliers=scan.outliers + int((~kept).sum()))
