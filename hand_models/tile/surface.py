"""Strength of one spine tile: a limit surface over the direction of its load.

A tile loaded in the finger plane at the angle φ from pure shear toward pull-off fails at (Eq. 21)

    f_s(φ) = f_max − (f_max − f_min) (φ / φ_max)ᵖ,        0 ≤ φ ≤ φ_max,

with p = 1, and at f_min beyond φ_max (``assumed``: nothing is published there); other exponents p
are other laws. Out of the finger plane, at the azimuth θ in the tile's plane from the drag, its
strength is

    F(φ, θ) = f_s(φ) [1 − (1 − λ(φ)) cos φ (1 − cos θ)],

a fit to the spine array (``spine_array.py``): channels lean along the drag, so that spines are
weaker sideways, above all under pull-off. λ falls linearly from f_lateral / f_max at φ = 0 to that
times ``lateral_pull_off_ratio`` at φ_max, and stays; with cos φ, θ loses its effect at pure
pull-off, where it has no meaning. Pressed into the rock with the normal load N, a tile carries
F(0, θ) + γ N in its plane, with γ the compression gain.

Spines grip only while they are dragged toward the finger's base. A tile that is dragged the other
way carries Coulomb friction alone, in proportion to its pressing, and one that is pulled off needs
the drag in proportion: both are, for the shear T,

    T ≥ −μ N

(Section 6.1 has Coulomb friction for pressed tiles; that the same μ ends the pull-off at the angle
atan(1 / μ) is ``assumed``, and the published data leave μ open). A base tile, which carries no
normal load, counts as pressed by its finger's proximal phalanx, times its spine engagement
(``assumed``). Half-planes inside and outside the surface are in `hand_models.tile.half_planes`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import ParameterTable, surface_table
from hand_models.tile.half_planes import HalfPlane, inner_half_planes

__all__ = [
    "LEAST_SHARE",
    "Surface",
    "engaged_share",
    "preset_strengths",
    "pull_strength",
    "surface_names",
]

LEAST_SHARE: Final = 1e-6
"""Share of a tile's spines that counts as none: far less than one spine, and too little to divide
loads by."""

SURFACE_BOUNDS: Final = {
    name: surface_table().scalar("bounds", name) for name in surface_table().sections["bounds"]
}
"""Section ``bounds`` of ``surfaces.toml``, in SI units."""


@dataclass(frozen=True)
class Surface:
    """Strength of a tile on one kind of rock, as a limit surface over the direction of the load.

    Attributes
    ----------
    shear_limit : float
        f_max, strength in pure shear [N].
    pull_off_limit : float
        f_min, strength at ``pull_off_angle`` [N].
    pull_off_angle : float
        φ_max, angle from shear toward pull-off at which the strength is least, at most π/2 [rad].
    lateral_limit : float
        Strength in the tile's plane straight sideways [N].
    compression_gain : float
        γ, shear strength gained per newton of pressing.
    half_planes : int
        Count of straight pieces that approximate the curve from pure shear to φ_max; one is the
        paper's straight line, more come closer to the curve from inside.
    lateral_pull_off_ratio : float
        λ at ``pull_off_angle`` over λ at pure shear, with λ the lateral share of the strength; in
        (0, 1].
    shear_scatter : float
        Standard deviation of ``shear_limit`` from place to place [N].
    friction : float
        μ, Coulomb friction of a tile that is dragged away from the finger's base.
    pull_off_exponent : float
        p, how strength falls from ``shear_limit`` to ``pull_off_limit``: 1 is Eq. 21's straight
        line over the angle.
    name : str or None
        Name of the preset; None for a caller's numbers. Not part of equality.

    Raises
    ------
    InvalidInputError
        If a number is not finite or out of its range.
    """

    shear_limit: float
    pull_off_limit: float
    pull_off_angle: float
    lateral_limit: float
    compression_gain: float
    half_planes: int = 1
    lateral_pull_off_ratio: float = 1.0
    shear_scatter: float = 0.0
    friction: float = 0.0
    pull_off_exponent: float = 1.0
    name: str | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        for name in self._numbers():
            value = getattr(self, name)
            if not math.isfinite(value):
                raise InvalidInputError(f"must be finite, got {value}", field=name)

        def check(name: str, valid: bool, needed: str, why: str = "") -> None:
            if not valid:
                got = f"must {needed}, got {getattr(self, name):g}{why}"
                raise InvalidInputError(got, field=name)

        for name in ("shear_limit", "pull_off_limit", "lateral_limit"):
            check(name, getattr(self, name) > 0.0, "be a force above 0 N")
        limit = f"shear_limit = {self.shear_limit:g} N"
        check("pull_off_limit", self.pull_off_limit <= self.shear_limit, f"not exceed {limit}")
        check("pull_off_angle", 0.0 < self.pull_off_angle <= math.pi / 2, "be in (0, pi/2] rad")
        for name in ("compression_gain", "shear_scatter", "friction"):
            check(name, getattr(self, name) >= 0.0, "not be negative")
        most = SURFACE_BOUNDS["lateral_ratio"]
        check(
            "lateral_limit",
            self.lateral_limit <= most * self.shear_limit,
            f"be at most {most:g} times {limit}",
            ": spines hold less sideways",
        )
        most = SURFACE_BOUNDS["scatter_ratio"]
        within = self.shear_scatter <= most * self.shear_limit
        check("shear_scatter", within, f"be at most {most:g} times {limit}")
        for name, why in (
            ("compression_gain", "newtons of shear strength for each newton of pressing"),
            ("friction", "newtons of drag for each newton of pull-off"),
        ):
            most = SURFACE_BOUNDS[name]
            check(name, getattr(self, name) <= most, f"be at most {most:g}", f": {why}")
        most = SURFACE_BOUNDS["pull_off_exponent"]
        check(
            "pull_off_exponent",
            1.0 / most <= self.pull_off_exponent <= most,
            f"be in [{1.0 / most:g}, {most:g}]",
            ": strength must fall all the way from pure shear to pull_off_angle",
        )
        check("lateral_pull_off_ratio", 0.0 < self.lateral_pull_off_ratio <= 1.0, "be in (0, 1]")
        if not (1 <= self.half_planes <= 64 and self.half_planes == int(self.half_planes)):
            raise InvalidInputError(
                f"must be a whole number from 1 to 64, got {self.half_planes}", field="half_planes"
            )

    @classmethod
    def _numbers(cls) -> list[str]:
        """Return the names of the numbers."""
        return [each.name for each in fields(cls) if each.compare]

    @property
    def strongest_tile(self) -> float | None:
        """Bound on the strength of a tile [N] if ``shear_limit`` exceeds the bound, else None.

        At the bound (``tile_strength`` of ``parameters/surfaces.toml``) the shafts of all spines
        break.
        """
        most = SURFACE_BOUNDS["tile_strength"]
        return most if self.shear_limit > most else None

    @classmethod
    def named(cls, name: str, table: ParameterTable | None = None) -> Surface:
        """Return a preset surface of ``parameters/surfaces.toml``.

        Parameters
        ----------
        name : str
            One of `surface_names`.
        table : ParameterTable, optional
            All numbers of the surfaces; the bundled ones by default.

        Raises
        ------
        InvalidInputError
            If no preset has that name; the message lists the names.
        """
        return _preset(name) if table is None else _from_table(name, table)

    @classmethod
    def from_values(cls, values: Mapping[str, float]) -> Surface:
        """Return a surface of a caller's numbers.

        Parameters
        ----------
        values : mapping
            ``shear_limit`` [N], and any other numeric attribute. Those left out are ``shear_limit``
            times the default ratios of ``parameters/surfaces.toml``, or its defaults.

        Raises
        ------
        InvalidInputError
            If a name is unknown, ``shear_limit`` is missing or a number is out of its range.
        """
        known = cls._numbers()
        for key in values:
            if key not in known:
                raise InvalidInputError(f"unknown; known are {', '.join(known)}", field=key)
        if "shear_limit" not in values:
            raise InvalidInputError(
                "missing; give a tile's shear strength [N]", field="shear_limit"
            )
        if not (math.isfinite(values["shear_limit"]) and values["shear_limit"] > 0.0):
            raise InvalidInputError(
                f"must be a force above 0 N, got {values['shear_limit']:g}", field="shear_limit"
            )
        numbers = _by_ratios(values["shear_limit"], "defaults", surface_table())
        return cls(**(numbers | dict(values)))  # type: ignore[arg-type]

    def times(self, factor: float) -> Surface:
        """Return the surface with all strengths multiplied by a factor."""
        names = "shear_limit", "pull_off_limit", "lateral_limit", "shear_scatter"
        return replace(self, **{name: factor * getattr(self, name) for name in names})

    def strength(self, angle: ArrayLike, azimuth: ArrayLike = 0.0) -> Array:
        """Return the largest load of a tile in a direction, F(φ, θ); f_s(φ) of Eq. 21 if θ = 0.

        Parameters
        ----------
        angle : array_like
            φ from the tile's plane toward pull-off, in (−π/2, π/2]; negative is pressing [rad].
        azimuth : array_like
            θ in the tile's plane from the drag to either side; broadcast with ``angle``. Beyond π/2
            a tile is dragged backwards, and the strength straight sideways is returned [rad].

        Returns
        -------
        ndarray
            Force magnitude [N]; infinite where pressing adds more strength than the load uses.
        """
        phi = np.asarray(angle, dtype=float)
        sideways = 1.0 - np.maximum(np.cos(azimuth), 0.0)
        lost = (1.0 - self.sideways_share(phi)) * np.cos(np.maximum(phi, 0.0)) * sideways
        pulling = self.straight_strength(phi) * (1.0 - lost)
        # in the tile's plane ≤ F(0, θ) + γ N along the direction φ < 0
        slope = np.cos(phi) + self.compression_gain * np.sin(phi)
        with np.errstate(divide="ignore"):
            pressing = np.where(slope > 0.0, pulling / np.maximum(slope, 0.0), np.inf)
        return np.where(phi >= 0.0, pulling, pressing)

    def straight_strength(self, angle: ArrayLike) -> Array:
        """Return f_s(φ), the strength in the finger's plane, of the shape of ``angle`` [N].

        ``angle``: φ from shear toward pull-off [rad]. f_s never rises with φ; f_max for φ ≤ 0.
        """
        return pull_strength(*self.straight_law, angle)

    @property
    def straight_law(self) -> tuple[float, float, float, float]:
        """Parameters f_max, f_min [N], φ_max [rad] and p of Eq. 21, in `pull_strength`'s order."""
        return self.shear_limit, self.pull_off_limit, self.pull_off_angle, self.pull_off_exponent

    def sideways_share(self, angle: ArrayLike) -> Array:
        """Return λ(φ), strength straight sideways over that along the drag, shape of ``angle``.

        ``angle``: φ from shear toward pull-off [rad]. λ never rises with φ.
        """
        ratio = np.clip(np.asarray(angle) / self.pull_off_angle, 0.0, 1.0)
        kept = 1.0 - (1.0 - self.lateral_pull_off_ratio) * ratio
        return np.asarray(self.lateral_limit / self.shear_limit * kept)

    def excess(self, shear: ArrayLike, normal: ArrayLike, lateral: ArrayLike = 0.0) -> Array:
        """Return the excess of a tile's load over the limit surface [N]; negative inside.

        The tile has all its spines on the rock.

        Parameters
        ----------
        shear, normal, lateral : array_like
            T, N (> 0 pressing) and Y of the tile [N]; broadcast. A tile that is dragged backwards
            (T < 0) is taken to be as strong as one without drag.
        """
        forward, pull = np.maximum(shear, 0.0), -np.asarray(normal, dtype=float)
        angle = np.arctan2(pull, np.hypot(forward, lateral))
        strength = self.strength(angle, np.arctan2(np.abs(lateral), forward))
        return np.asarray(np.hypot(np.hypot(shear, lateral), pull) - strength)

    def inner(self, count: int | None = None) -> tuple[HalfPlane, ...]:
        """Return half-planes inside the limit surface; see `inner_half_planes`.

        ``count``: number of straight pieces from pure shear to φ_max; ``half_planes`` by default.
        """
        return inner_half_planes(self if count is None else replace(self, half_planes=count))


def pull_strength(
    shear_limit: ArrayLike,
    pull_off_limit: ArrayLike,
    pull_off_angle: ArrayLike,
    pull_off_exponent: ArrayLike,
    angle: ArrayLike,
) -> Array:
    """Return f_s(φ) of Eq. 21 for tiles on several surfaces [N]; f_max if φ ≤ 0.

    Parameters
    ----------
    shear_limit, pull_off_limit : array_like
        f_max and f_min [N].
    pull_off_angle : array_like
        φ_max [rad].
    pull_off_exponent : array_like
        p.
    angle : array_like
        φ, angle of the load from shear toward pull-off [rad]; all arguments broadcast.
    """
    most = np.asarray(shear_limit)
    ratio = np.clip(np.asarray(angle) / np.asarray(pull_off_angle), 0.0, 1.0)
    return np.asarray(most - (most - np.asarray(pull_off_limit)) * ratio**pull_off_exponent)


def engaged_share(gap: ArrayLike, travel: float, exponent: float = 1.0) -> Array:
    """Return the spine engagement of a tile at a gap to the rock: φ = 1 − (gap / travel)^p.

    Spines slide out of their tile by up to their travel; the farther they have to, the fewer find
    an asperity that is near enough. φ is in [0, 1], and 1 where the tile touches; below a millionth
    it counts as 0.

    Parameters
    ----------
    gap : array_like
        Distance from the tile's face to the rock, infinite where there is none [m].
    travel : float
        Distance that spines reach, ``spine_travel`` of ``hand.toml`` [m].
    exponent : float, optional
        p, ``engagement_exponent`` of ``hand.toml``: above 1 φ stays high over most of the travel,
        below it φ falls at once.

    Returns
    -------
    ndarray
        φ, in the shape of ``gap``.
    """
    off = np.asarray(gap, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        # no gap counts as negative, which has no power
        part = np.maximum(off / travel, 0.0) ** exponent
        share = np.where(off > 0.0, 1.0 - part, 1.0)
    return np.where(share > LEAST_SHARE, share, 0.0)


def _by_ratios(shear_limit: float, section: str, table: ParameterTable) -> dict[str, float]:
    """Return the numbers of a surface that follow from its strength by a section's ratios."""

    def ratio(name: str) -> float:
        own = name in table.sections.get(section, {})
        return table.scalar(section if own else "defaults", name)

    return {
        "shear_limit": shear_limit,
        "pull_off_limit": shear_limit * ratio("pull_off_ratio"),
        "pull_off_angle": ratio("pull_off_angle"),
        "lateral_limit": shear_limit * ratio("lateral_ratio"),
        "compression_gain": ratio("compression_gain"),
        "lateral_pull_off_ratio": ratio("lateral_pull_off_ratio"),
        "shear_scatter": shear_limit * ratio("scatter_ratio"),
        "friction": ratio("friction"),
        "pull_off_exponent": ratio("pull_off_exponent"),
    }


def surface_names() -> tuple[str, ...]:
    """Return the names of the surface presets, for `Surface.named`."""
    no_rock = ("bounds", "defaults")
    return tuple(name for name in surface_table().sections if name not in no_rock)


def preset_strengths() -> tuple[float, float]:
    """Return what a tile holds in shear on the weakest and on the strongest preset [N]."""
    strengths = [_preset(name).shear_limit for name in surface_names()]
    return min(strengths), max(strengths)


def _from_table(name: str, table: ParameterTable) -> Surface:
    if name not in surface_names():
        raise InvalidInputError(f"unknown surface {name!r}; known are {', '.join(surface_names())}")
    numbers = _by_ratios(table.scalar(name, "shear_limit"), name, table)
    return Surface(**numbers, name=name)  # type: ignore[arg-type]


@lru_cache(maxsize=64)
def _preset(name: str) -> Surface:
    return _from_table(name, surface_table())
