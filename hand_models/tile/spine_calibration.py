"""Published strengths of tiles, and fits of the planner's limit laws to the spine array.

The tile strengths are those of Wang, Jiang, Cutkosky (IJRR 2017), Fig. 7. The strength of
asperities is not printed; ``parameters/spines.toml`` has one that reproduces tiles with 20 spines
or more.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, InvalidInputError
from hand_models.parameters import spine_table
from hand_models.tile.spine_array import SpineArray

__all__ = [
    "LateralFit",
    "LineFit",
    "TileShear",
    "fit_lateral",
    "fit_line",
    "measured_tile_shear",
    "within_law",
]

LEAST_SPINES: Final = 20
"""Smallest tile that is fitted: error bars of smaller ones are as long as their means."""


class TileShear(NamedTuple):
    """Measured shear strength of a tile.

    Attributes
    ----------
    spines : int
        Count of spines.
    backlash : float
        Largest play of a spine in its channel [m].
    mean, error : float
        Mean, and half the length of the error bar [N].
    """

    spines: int
    backlash: float
    mean: float
    error: float


class LineFit(NamedTuple):
    """Straight line of Eq. 21, fitted to strengths in the finger plane.

    Attributes
    ----------
    shear_limit, pull_off_limit : float
        f_max, strength in pure shear, and f_min, strength at the pull-off angle φ_max [N].
    rms, worst : float
        Root mean square and largest residual [N].
    r_squared : float
        R², share of the variance that the line explains.
    """

    shear_limit: float
    pull_off_limit: float
    rms: float
    worst: float
    r_squared: float


class LateralFit(NamedTuple):
    """Lateral law of `Surface`, fitted to a spine array.

    F(φ, θ) is the strength at the angle φ toward pull-off and the azimuth θ from the drag.

    Attributes
    ----------
    lateral_ratio : float
        Lateral strength over strength in drag, at φ = 0.
    lateral_pull_off_ratio : float
        λ at φ_max over λ at φ = 0, with λ the lateral strength over that along the drag.
    rms, worst : float
        Root mean square and largest error of F(φ, θ) / F(φ, 0), over 0 ≤ φ ≤ φ_max, 0 ≤ θ ≤ π/2.
    """

    lateral_ratio: float
    lateral_pull_off_ratio: float
    rms: float
    worst: float


def measured_tile_shear(concrete: str) -> tuple[TileShear, ...]:
    """Return the measured shear strengths of Fig. 7 for one kind of concrete.

    Parameters
    ----------
    concrete : {'fine', 'coarse'}

    Returns
    -------
    tuple of TileShear
        Tiles of all spine counts with tight channels, then with loose ones.

    Raises
    ------
    InvalidInputError
        If ``concrete`` is neither of the two.
    """
    table, section = spine_table(), f"fig07-{concrete}"
    if section not in table.sections:
        raise InvalidInputError(f"must be fine or coarse, got {concrete!r}", field="concrete")
    backlashes = dict(zip(("tight", "loose"), table.vector(section, "backlash"), strict=True))
    return tuple(
        TileShear(int(spines), backlash, mean, error)
        for name, backlash in backlashes.items()
        for spines, mean, error in zip(
            table.vector(section, "spines"),
            table.vector(section, f"{name}_mean"),
            table.vector(section, f"{name}_error"),
            strict=True,
        )
    )


def within_law(angles: Array, pull_off_angle: float) -> Array:
    """Return True for loading angles in [0, φ_max], the range for which Eq. 21 is published.

    Parameters
    ----------
    angles : ndarray
        φ of each load, from shear toward pull-off [rad].
    pull_off_angle : float
        φ_max [rad].

    Returns
    -------
    ndarray of bool
        Flags in the shape of ``angles``.
    """
    return np.asarray((angles >= 0.0) & (angles <= pull_off_angle + BASE_TOLERANCES.angle))


def fit_line(angles: Array, strengths: Array, pull_off_angle: float) -> LineFit:
    """Fit Eq. 21 to strengths in the finger plane, by least squares.

    Parameters
    ----------
    angles : ndarray, shape (n,)
        φ of each load; those outside [0, φ_max] are left out [rad].
    strengths : ndarray, shape (n,)
        Strength at each angle [N].
    pull_off_angle : float
        φ_max [rad].
    """
    within = within_law(angles, pull_off_angle)
    share, strengths = angles[within] / pull_off_angle, strengths[within]
    design = np.column_stack([1.0 - share, share])
    limits = np.linalg.lstsq(design, strengths, rcond=None)[0]
    residuals = strengths - design @ limits
    spread = strengths - strengths.mean()
    return LineFit(
        shear_limit=float(limits[0]),
        pull_off_limit=float(limits[1]),
        rms=float(np.sqrt(np.mean(residuals**2))),
        worst=float(np.abs(residuals).max()),
        r_squared=1.0 - float(residuals @ residuals) / float(spread @ spread),
    )


def fit_lateral(array: SpineArray, pull_off_angle: float) -> LateralFit:
    """Fit the lateral law of `Surface` to a spine array.

    The law is F(φ, θ) / F(φ, 0) = 1 − (1 − λ(φ)) cos φ (1 − cos θ), with λ falling linearly from
    ``lateral_ratio`` at φ = 0 to ``lateral_ratio`` times ``lateral_pull_off_ratio`` at φ_max. The
    former is the array's F(0, π/2) / F(0, 0); the latter is found by least squares over a grid of
    directions.

    Parameters
    ----------
    array : SpineArray
    pull_off_angle : float
        φ_max [rad].
    """
    count = 46  # angles φ, and azimuths θ, of the grid
    share = np.linspace(0.0, 1.0, count)[:, None]
    angle, azimuth = share * pull_off_angle, np.linspace(0.0, math.pi / 2, count)[None, :]
    loss = np.cos(angle) * (1.0 - np.cos(azimuth))
    target = array.share(angle, azimuth) / array.share(angle)
    lateral = float(array.share(0.0, math.pi / 2))
    # linear in what λ has lost at φ_max
    rest = target - 1.0 + (1.0 - lateral) * loss
    slope = -lateral * share * loss
    lost = float(np.sum(slope * rest) / np.sum(slope**2))
    error = slope * lost - rest
    return LateralFit(
        lateral_ratio=lateral,
        lateral_pull_off_ratio=1.0 - lost,
        rms=float(np.sqrt(np.mean(error**2))),
        worst=float(np.abs(error).max()),
    )
