"""What helps where a scan is left full of holes: each remedy is tried before it is advised."""

from __future__ import annotations

from typing import Final, NamedTuple

from hand_models.parameters import scan_table
from hand_models.scans.meshing import triangulated, wider_holes
from hand_models.scans.outliers import drop_outliers
from hand_models.scans.rock import ScannedRock
from hand_models.scans.scan import Scan

__all__ = ["Remedy", "remedy"]

STD_RATIO: Final = 2.0
"""Standard deviations beyond which points are dropped on trial, as in Open3D's example."""


class Remedy(NamedTuple):
    """Option that leaves few of the holes and steps of a scan, as it was tried.

    Attributes
    ----------
    option : {'std_ratio', 'hole'}
    value : float
        Of it: standard deviations, or [m].
    left : int
        Holes and steps that it leaves.
    """

    option: str
    value: float
    left: int


def remedy(
    scan: Scan, rock: ScannedRock, hole: float, *, spacing: float | None = None
) -> Remedy | None:
    """Return what would leave at most a tenth of the holes and steps of a scan, None if nothing.

    Tried are dropping points that stand alone (`drop_outliers`), unless some were dropped, and
    bridging holes up to the palm's width.

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
    enough = table.scalar("mesh", "left_holes") * (len(rock.holes) + len(rock.steps))
    neighbours = table.scalar("outliers", "neighbours")
    if not scan.outliers and len(scan.points) > neighbours:
        gaps = triangulated(drop_outliers(scan, STD_RATIO), spacing).gaps
        left = sum(map(len, gaps.left(hole)))
        if left <= enough:
            return Remedy("std_ratio", STD_RATIO, left)
    gaps = triangulated(scan, spacing).gaps
    for wider in wider_holes(hole):
        left = sum(map(len, gaps.left(wider)))
        if left <= enough:
            return Remedy("hole", wider, left)
    return None
