"""Points that stand alone: statistical outlier removal, as Open3D and PCL name it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy

from hand_models.base import InvalidInputError
from hand_models.parameters import scan_table
from hand_models.scans.scan import Scan

__all__ = ["drop_outliers"]


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
        raise InvalidInputError("is of points, and the file has triangles", field="std_ratio")
    away = scipy.spatial.cKDTree(scan.points).query(scan.points, k=neighbours + 1)[0]
    mean = np.asarray(away)[:, 1:].mean(axis=1)
    kept = mean <= mean.mean() + std_ratio * mean.std()
    return replace(scan, points=scan.points[kept], outliers=scan.outliers + int((~kept).sum()))
