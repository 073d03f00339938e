"""What helps where a scan is left full of holes: each remedy is tried before it is advised."""

from __future__ import annotations

from typing import Final, NamedTuple

from hand_models.parameters import scan_table
from hand_models.scans.holes import Gaps
from hand_models.scans.meshing import triangulated, wider_holes
from hand_models.scans.outliers import drop_outliers
from hand_models.scans.rock import ScannedRock
from hand_models.scans.scan import Scan

__all__ = ["Remedy", "remedy"]

STD_RATIO: Final = 2.0
"""Standard deviations beyond which points are dropped on trial, as in Open3D's example."""

KEPT: Final = 0.95
"""Part of what was covered that has to be covered still: dropped points may be of the rim."""


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
    """Return what would leave a scan in one piece with few holes and steps, None if nothing does.

    Few are a tenth of those that it has or of those that are many, and it has to cover half of its
    outline, and as much as it did. Tried are dropping points that stand alone (`drop_outliers`),
    unless some were dropped, and bridging holes up to the palm's width.

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
    count = max(len(rock.holes) + len(rock.steps), table.scalar("mesh", "many_holes"))
    enough = table.scalar("mesh", "left_holes") * count
    covered = max(KEPT * rock.covered, table.scalar("mesh", "least_covered"))

    def tried(option: str, value: float, gaps: Gaps, wide: float) -> Remedy | None:
        left = sum(map(len, gaps.left(wide)))
        helps = left <= enough and gaps.covered(wide) >= covered
        return Remedy(option, value, left) if helps else None

    if not scan.outliers and len(scan.points) > table.scalar("outliers", "neighbours"):
        gaps = triangulated(drop_outliers(scan, STD_RATIO), spacing).gaps
        found = tried("std_ratio", STD_RATIO, gaps, hole)
        if found is not None:
            return found
    gaps = triangulated(scan, spacing).gaps
    each = (tried("hole", wider, gaps, wider) for wider in wider_holes(hole))
    return next((found for found in each if found is not None), None)
