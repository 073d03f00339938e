"""What one spine tile can hold: the linear law of the loading angle, and half-planes inside it.

A tile loaded at the angle φ from pure shear toward pull-off lets go at the force (Eq. 21)

    f_s(φ) = f_max − (f_max − f_min) φ / φ_max,        0 ≤ φ ≤ φ_max,

and at f_min beyond φ_max (``assumed``: nothing is published there). Pressed into the rock it holds
the shear ``f_max + γ N``, with γ the compression gain.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from hand_models.errors import InvalidInputError
from hand_models.frames import Array
from hand_models.parameters import surface_table

__all__ = ["HalfPlane", "Surface", "surface_names"]


@dataclass(frozen=True)
class HalfPlane:
    """A limit ``a_shear T + a_normal N + a_lateral |Y| ≤ capacity`` of one tile.

    Attributes
    ----------
    limit : str
        ``shear`` for the side that pressing governs, ``pull_off`` for the others.
    a_shear, a_normal, a_lateral : float
        Coefficients of the tile's shear T, normal N (> 0 pressing) and lateral load Y.
    capacity : float
        Right-hand side [N].
    """

    limit: str
    a_shear: float
    a_normal: float
    a_lateral: float
    capacity: float


@dataclass(frozen=True)
class Surface:
    """How much a tile holds on a kind of rock.

    Attributes
    ----------
    shear_limit : float
        f_max, the tile's strength in pure shear [N].
    pull_off_limit : float
        f_min, its strength at ``pull_off_angle`` [N].
    pull_off_angle : float
        φ_max, at most π/2 [rad].
    lateral_limit : float
        Its strength sideways, out of the finger plane [N].
    compression_gain : float
        γ, shear strength gained per newton of pressing.
    half_planes : int
        How many straight pieces stand for the curve from pure shear to φ_max; one is the paper's
        straight line, more come closer to the curve from inside.
    """

    shear_limit: float
    pull_off_limit: float
    pull_off_angle: float
    lateral_limit: float
    compression_gain: float
    half_planes: int = 1

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value):
                raise InvalidInputError(f"must be finite, got {value}", field=field.name)
        for name in ("shear_limit", "pull_off_limit", "lateral_limit"):
            if getattr(self, name) <= 0.0:
                raise InvalidInputError(
                    f"must be a force above 0 N, got {getattr(self, name):g}", field=name
                )
        if self.pull_off_limit > self.shear_limit:
            raise InvalidInputError(
                f"must not exceed shear_limit = {self.shear_limit:g} N, "
                f"got {self.pull_off_limit:g}",
                field="pull_off_limit",
            )
        if not 0.0 < self.pull_off_angle <= math.pi / 2:
            raise InvalidInputError(
                f"must be in (0, pi/2] rad, got {self.pull_off_angle:g}", field="pull_off_angle"
            )
        if self.compression_gain < 0.0:
            raise InvalidInputError(
                f"must not be negative, got {self.compression_gain:g}", field="compression_gain"
            )
        if not (1 <= self.half_planes <= 64 and self.half_planes == int(self.half_planes)):
            raise InvalidInputError(
                f"must be a whole number from 1 to 64, got {self.half_planes}", field="half_planes"
            )

    @classmethod
    def named(cls, name: str) -> Surface:
        """Return a preset of ``parameters/surfaces.toml``.

        Raises
        ------
        InvalidInputError
            If there is no such preset; the message lists them.
        """
        if name not in surface_names():
            raise InvalidInputError(
                f"unknown surface {name!r}; known are {', '.join(surface_names())}"
            )
        return _preset(name)

    @classmethod
    def from_values(cls, values: Mapping[str, float]) -> Surface:
        """Return a surface of a caller's own numbers.

        Parameters
        ----------
        values : mapping
            ``shear_limit`` [N], and any other attribute; those left out follow from it by the
            default ratios of ``parameters/surfaces.toml``.
        """
        known = [field.name for field in fields(cls)]
        for key in values:
            if key not in known:
                raise InvalidInputError(f"unknown; known are {', '.join(known)}", field=key)
        if "shear_limit" not in values:
            raise InvalidInputError("missing; the tile's strength in N", field="shear_limit")
        if not (math.isfinite(values["shear_limit"]) and values["shear_limit"] > 0.0):
            raise InvalidInputError(
                f"must be a force above 0 N, got {values['shear_limit']:g}", field="shear_limit"
            )
        base = _from_ratios(values["shear_limit"], "defaults")
        return replace(base, **values)  # type: ignore[arg-type]

    def strength(self, angle: ArrayLike) -> Array:
        """Return the force at which a tile lets go, f_s(φ) of Eq. 21.

        Parameters
        ----------
        angle : array_like
            φ from pure shear toward pull-off, in (−π/2, π/2]; negative is pressing [rad].

        Returns
        -------
        ndarray
            Force magnitude [N]; infinite where pressing alone grows faster than the strength used.
        """
        phi = np.asarray(angle, dtype=float)
        ratio = np.clip(phi / self.pull_off_angle, 0.0, 1.0)
        pulling = self.shear_limit - (self.shear_limit - self.pull_off_limit) * ratio
        # T ≤ f_max + γ N along the direction φ < 0
        slope = np.cos(phi) + self.compression_gain * np.sin(phi)
        with np.errstate(divide="ignore"):
            pressing = np.where(slope > 0.0, self.shear_limit / np.maximum(slope, 0.0), np.inf)
        return np.where(phi >= 0.0, pulling, pressing)

    def pieces(self) -> tuple[HalfPlane, ...]:
        """Return the inner approximation of the limit curve for shear T ≥ 0.

        The curve of Eq. 21 bends outward, so chords between points on it lie inside. The last
        chord runs on beyond φ_max; where it would leave the curve there (which stays at f_min), one
        more chord, down to pure pull-off, closes the region.
        """
        return _pieces(self)


def _from_ratios(shear_limit: float, section: str) -> Surface:
    table = surface_table()

    def ratio(name: str) -> float:
        own = name in table.sections.get(section, {})
        return table.scalar(section if own else "defaults", name)

    return Surface(
        shear_limit=shear_limit,
        pull_off_limit=shear_limit * ratio("pull_off_ratio"),
        pull_off_angle=ratio("pull_off_angle"),
        lateral_limit=shear_limit * ratio("lateral_ratio"),
        compression_gain=ratio("compression_gain"),
    )


def surface_names() -> tuple[str, ...]:
    """Return the names of the surface presets."""
    return tuple(name for name in surface_table().sections if name != "defaults")


@lru_cache(maxsize=64)
def _preset(name: str) -> Surface:
    return _from_ratios(surface_table().scalar(name, "shear_limit"), name)


@lru_cache(maxsize=256)
def _pieces(surface: Surface) -> tuple[HalfPlane, ...]:
    sideways = 1.0 / surface.lateral_limit
    angles = np.linspace(0.0, surface.pull_off_angle, int(surface.half_planes) + 1)
    radii = surface.strength(angles)
    # points (shear T, pull P) on the curve
    nodes = [
        (float(r * np.cos(a)), float(r * np.sin(a))) for a, r in zip(angles, radii, strict=True)
    ]
    last = _chord(nodes[-2], nodes[-1])
    if surface.pull_off_angle < math.pi / 2 and last[2] > last[1] * surface.pull_off_limit:
        nodes.append((0.0, surface.pull_off_limit))
    # a gain steeper than the first chord would cut into the side of pull-off
    shear, pull, _ = _chord(*nodes[:2])
    gain = min(surface.compression_gain, pull / shear if shear > 0.0 else math.inf)
    pieces = [HalfPlane("shear", 1.0, -gain, surface.shear_limit * sideways, surface.shear_limit)]
    for start, end in itertools.pairwise(nodes):
        shear, pull, capacity = _chord(start, end)
        pieces.append(HalfPlane("pull_off", shear, -pull, capacity * sideways, capacity))
    return tuple(pieces)


def _chord(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float, float]:
    """Return (a, b, c) of the line ``a T + b P = c`` through two points, with a² + b² = 1."""
    a = end[1] - start[1]
    b = start[0] - end[0]
    scale = math.hypot(a, b)
    a, b = a / scale, b / scale
    return a, b, a * start[0] + b * start[1]
