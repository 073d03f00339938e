"""Digits that coordinates have left: far from their origin they may have lost those needed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import scan_table
from hand_models.scans.scan import UNITS

__all__ = ["check_digits"]

FEW_DIGITS: Final = (6, 7)
"""Digits that programs write unless they are told otherwise: C++ streams and ``%g``, and floats of
32 bits."""

SAME: Final = 0.9
"""Part of the points that are at places of their own, below which digits are taken to be lost."""


def check_digits(points: Array, scale: float, path: Path) -> None:
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
    step = float(np.spacing(np.float32(largest)))
    if scale * step > coarsest and np.array_equal(points, points.astype(np.float32)):
        raise InvalidInputError(
            f"coordinates up to {largest:,.0f} are in steps of {step:g} {_of_unit(scale)}, as "
            "floats of 32 bits are at that size: subtract an offset (shift to a local origin) "
            f"before the export, or export 64-bit floats (double): {path}",
            field="file",
        )
    for digits in FEW_DIGITS:
        step = 10.0 ** (math.floor(math.log10(max(largest, 1e-300))) + 1 - digits)
        if scale * step <= coarsest:
            return
        cut = points[:, np.abs(points).max(axis=0).argmax()]
        if np.allclose(cut, step * np.round(cut / step), rtol=1e-12, atol=0.0):
            distinct = len(np.unique(points, axis=0))
            if distinct <= SAME * len(points):
                raise InvalidInputError(
                    f"coordinates up to {largest:,.0f} have {digits} digits, steps of {step:g} "
                    f"{_of_unit(scale)}, and {len(points):,} points are at {distinct:,} places: "
                    f"write more digits, or subtract an offset before the export: {path}",
                    field="file",
                )


def _of_unit(scale: float) -> str:
    """Return the unit of numbers by its metres, if it has a name."""
    return next((name for name, metres in UNITS.items() if metres == scale), f"times {scale:.3g} m")
