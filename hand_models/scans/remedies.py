"""Find options that leave a scan with fewer holes: each is tried before it is advised.

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
    """An option of meshing that leaves few holes and steps in a scan, with the result of its trial.

    Attributes
    ----------
    option : {'std_ratio', 'hole'}
        Option that is advised: of `drop_outliers`, or of `mesh_scan`.
    value : float
        Value of the option: standard deviations, or a width [m].
    left : int
        Number of holes and steps that are left.
    std_ratio : float, optional
        Standard deviations beyond which points are dropped in addition to a wider hole.
    covered : float
        Share of the area within the outline that is then covered.
    """

    option: str
    value: float
    left: int
    std_ratio: float | None = None
    covered: float = 1.0


def remedy(
    scan: Scan, rock: ScannedRock, hole: float, *, spacing: float | None = None
) -> Remedy | None:
    """Return an option that meshes a scan with few holes and steps; None if no option does.

    Tried in turn are dropping points that stand alone (`drop_outliers`), unless some were dropped
    or there are neither strays, steps nor pieces, bridging holes up to the palm's width, and both;
    then dropping more points. An option is taken at once if it leaves at most the share
    ``left_holes`` of the present holes and steps (or of ``many_holes`` if that is more), and never
    more than ``many_holes``; else the option that leaves the fewest. It has to leave at most half
    of them, and to cover ``least_covered`` of the outline, and 95 % of the area covered before.

    Parameters
    ----------
    scan : Scan
        Points without triangles.
    rock : ScannedRock
        Result of `mesh_scan` for the scan.
    hole : float
        Width up to which holes were bridged [m].
    spacing : float, optional
        Side of the squares that keep one point each, as in `mesh_scan` [m].
    """
    table = scan_table()
    many, open_ = table.scalar("mesh", "many_holes"), len(rock.holes) + len(rock.steps)
    enough = min(table.scalar("mesh", "left_holes") * max(open_, many), many)
    # dropped points may be of the rim: 5 % less may be covered than was
    covered = max(0.95 * rock.covered, table.scalar("mesh", "least_covered"))
    helping = []
    for option, value, std_ratio, gaps in _trials(scan, rock, hole, spacing):
        wide = value if option == "hole" else hole
        left = sum(map(len, gaps.left(wide)))
        closed = gaps.covered(wide)
        if closed < covered or left > min(0.5 * open_, many):
            continue
        found = Remedy(option, value, left, std_ratio, closed)
        if left <= enough:
            return found
        helping.append(found)
    return min(helping, key=lambda each: each.left, default=None)


def _trials(
    scan: Scan, rock: ScannedRock, hole: float, spacing: float | None
) -> Iterator[tuple[str, float, float | None, Gaps]]:
    """Yield an option, its value, the ratio of dropped points beside it, and what is then open."""
    assert rock.gaps is not None
    table = scan_table()
    # a point that stands alone has steps about it
    alone = rock.alone or rock.steps or rock.covered < table.scalar("mesh", "least_covered")
    dropping = alone and not scan.outliers
    if not dropping or len(scan.points) <= table.scalar("outliers", "neighbours"):
        for wider in wider_holes(hole):
            yield "hole", wider, None, rock.gaps
        return
    # more of them than half of what is open: a wider hole would make rock of them
    strays = 2 * rock.alone >= len(rock.holes) + len(rock.steps) > 0
    # as in Open3D's example; where strays are so many that they widen the deviation, less
    for std_ratio in (2.0, 1.0):
        dropped = triangulated(drop_outliers(scan, std_ratio), spacing).gaps
        yield "std_ratio", std_ratio, None, dropped
        bridges: list[tuple[float | None, Gaps]] = [(std_ratio, dropped)]
        if std_ratio == 2.0:
            bridges.insert(1 if strays else 0, (None, rock.gaps))
        for ratio, gaps in bridges:
            for wider in wider_holes(hole):
                yield "hole", wider, ratio, gaps


def drop_outliers(scan: Scan, std_ratio: float, *, neighbours: int | None = None) -> Scan:
    """Return a scan without points that stand alone (statistical outlier removal).

    A point is left out if its mean distance to its nearest neighbours exceeds the mean of this
    distance over all points by more than ``std_ratio`` standard deviations.

    Parameters
    ----------
    scan : Scan
    std_ratio : float
        Standard deviations, above zero; 1 to 3 are usual.
    neighbours : int, optional
        Number of nearest neighbours of each point; by default as in ``scan.toml``.

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
            f"must be at least 1 and fewer than the scan's {len(scan.points)} points, got "
            f"{neighbours}",
            field="neighbours",
        )
    if scan.faces is not None:
        raise InvalidInputError(
            "is for points, and the file has triangles: leave std_ratio out", field="std_ratio"
        )
    # neighbours one after another, among so many cells along each axis, are found in half the time
    low, size = scan.points.min(axis=0), float(np.ptp(scan.points, axis=0).max())
    order = np.lexsort((100.0 / size * (scan.points - low)).astype(np.int16).T)
    points, mean = scan.points[order], np.empty(len(order))
    away = np.asarray(scipy.spatial.cKDTree(points).query(points, k=neighbours + 1)[0])
    mean[order] = away[:, 1:].mean(axis=1)
    kept = mean <= mean.mean() + std_ratio * mean.std()
    return replace(scan, points=scan.points[kept], outliers=scan.outliers + int((~kept).sum()))
