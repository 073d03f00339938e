"""Check tile loads against the law of spines on rock (Eqs. 20, 21).

Whether a load is within the limit surface is computed from the law itself, not from the half-planes
that approximate it in the programs. The half-planes only serve to recompute the reported
utilisations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array, Indices
from hand_models.tile import HalfPlane, Surface
from planner.prepare import HandBatch
from planner.result import PlanArrays
from planner.verification.residuals import (
    TOLERANCES,
    PartNames,
    Recomputed,
    Residual,
    ResidualLimits,
    claim,
)

__all__ = ["LimitCurves", "TileLimits"]


class LimitCurves:
    """The limit surfaces of n tiles, each on its own rock.

    The same limit as `Surface.strength`, written in the load itself instead of its direction. With
    T the shear, a the load in the tile's plane and r the size of the load, cos φ = a / r and cos θ
    = T / a, so that the strength is

        f_s(φ) [1 − (1 − λ(φ)) cos φ (1 − cos θ)] = f_s(φ) [1 − (1 − λ(φ)) (a − T) / r].

    f_s is the strength in the shear direction at the pull-off angle φ, which falls with φ by the
    surface's exponent; λ is the ratio of the lateral strength to f_s.

    Parameters
    ----------
    surfaces : sequence of Surface
        The surfaces of all tiles, in any order.
    of_tile : ndarray of int, shape (n,)
        Index of each tile's surface.
    shares : ndarray, shape (n,) or ()
        Share of each tile's spines that are on the rock, by which its strength is multiplied.
    """

    def __init__(self, surfaces: Sequence[Surface], of_tile: Indices, shares: Array) -> None:
        numbers = [_numbers(surface) for surface in surfaces]
        of_each = np.array(numbers).T.take(of_tile, 1)
        of_each[[0, 2]] *= shares
        # f_s, and 1 − λ: at φ = 0, and what they lose up to φ_max; −1 / φ_max; γ; p
        self._flat, self._loss = of_each[:2], of_each[2:4]
        self._per_radian, self._gain, self._exponent = of_each[4:]

    def excess(self, shear: Array, normal: Array, lateral: Array, relative: float) -> Array:
        """Return by how much loads exceed their tiles' strength [N]; negative inside the limit.

        Parameters
        ----------
        shear, normal, lateral : ndarray, shape (n,)
            Loads of the tiles [N]; normal is positive if pressing, lateral has either sign.
            Negative shear counts as zero: Coulomb friction carries it, not the spines.
        relative : float
            Part of the strength by which a load may exceed it.

        Returns
        -------
        ndarray, shape (n,)
            Size of the load minus strength. Pressing adds to the strength.
        """
        shear = np.maximum(shear, 0.0)
        along = np.hypot(shear, lateral)
        pull = np.minimum(normal, 0.0)
        # pressed, a tile holds what it does in its own plane, and more by the gain
        size = np.hypot(along, pull)
        ratio = np.minimum(np.arctan2(pull, along) * self._per_radian, 1.0)
        straight = self._flat[0] - self._loss[0] * ratio**self._exponent
        aside = self._flat[1] - self._loss[1] * ratio
        # [N] where there is no load
        strength = straight * (1.0 - aside * ((along - shear) / (size + 1e-300)))
        return np.asarray(size - self._gain * (normal - pull) - (1.0 + relative) * strength)


def _numbers(surface: Surface) -> tuple[float, ...]:
    """Return f_s and 1 − λ at φ = 0, what they lose up to φ_max, −1 / φ_max, γ, p."""
    share = surface.lateral_limit / surface.shear_limit
    return (
        surface.shear_limit,
        1.0 - share,
        surface.shear_limit - surface.pull_off_limit,
        share * (surface.lateral_pull_off_ratio - 1.0),
        -1.0 / surface.pull_off_angle,
        surface.compression_gain,
        surface.pull_off_exponent,
    )


def limiting_shares(known: HandBatch) -> Array:
    """Return the share of a whole tile's strength that limits each tile, shape (T,).

    That is the share of the tile's spines on the rock. Below ``least_share`` of the hand's model,
    φ₀, the share that counts falls along a parabola to φ₀ / 2 without spines on the rock.
    """
    share, least = known.engagement, known.hands[0].hand.least_share
    return np.where(share < least, 0.5 * least * (1.0 + (share / least) ** 2), share)


class TileLimits(ResidualLimits):
    """Limits of tiles: friction, the limit surface, and the reported utilisations of half-planes.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts.
    nails : ndarray of int, shape (k,)
        Indices of the nails that hook, counted among the tiles.
    """

    def __init__(self, names: PartNames, nails: Indices) -> None:
        known = names.known
        surfaces, self._of = [hand.surface for hand in known.hands], known.places.hand
        self._names, self._known, self._nails = names, known, nails
        self._framed = bool(known.touch.framed.any())
        # tiles that touch nothing use nothing of their limits
        shares = np.where(known.touch.away, 1.0, limiting_shares(known))
        sheared = np.array([each.shear_limit for each in surfaces])[self._of]
        self._allowances = sheared * (shares - known.engagement) * known.touch.touches
        self._per_share = (known.touch.touches / shares)[:, None]
        self._curves = LimitCurves(surfaces, self._of, shares)
        self._lateral = np.array([each.lateral_limit for each in surfaces])[self._of, None]
        self._planes: tuple[tuple[tuple[HalfPlane, ...], ...], Array] = (), np.zeros(0)

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals of friction and bare frames, and the utilisations with their errors.

        The utilisation that the plan reports for a nail is compared with that in ``again.nails``.
        """
        name, planned = self._names.tile, again.arrays
        residuals = self.holding(again.loads)
        planes = self._used(planned.half_planes, again.loads) * self._per_share
        residuals.append(Residual("use", planes, self._of))
        used = np.maximum.reduce(planes, axis=1)
        used[self._nails] = again.nails.used
        used, said = np.maximum(used, 0.0), planned.tile_utilisations
        return [
            *residuals,
            claim(used, said, self._of, TOLERANCES.utilisation, name, ": utilisation"),
        ]

    def holding(self, loads: Array, margin: float = 0.0) -> list[Residual]:
        """Return the residuals of friction, and of bare frames that must press on the rock.

        Parameters
        ----------
        loads : ndarray, shape (T, 3)
            Shear, normal and lateral load of each tile [N].
        margin : float, optional
            Load by which each tile must stay within these limits [N]; tiles that touch nothing need
            none.
        """
        known, name = self._known, self._names.tile
        shear, normal, _ = loads.T
        bases, pressed = known.places.bases, normal.copy()
        pressed[bases] = known.engagement[bases] * normal[bases + 1]
        by = f", less than {margin:g} N from it" if margin else ""
        backwards = " is pulled off or dragged backwards: {:.3g} N along, {:.3g} N across" + by
        rubs, across = shear + known.friction * pressed + self._allowances, (shear, normal)
        rubs -= margin * known.touch.touches
        residuals = [Residual("least", rubs, self._of, name, backwards, across)]
        if self._framed:
            text, framed = ": its bare frame would be pulled off" + by, known.touch.framed
            residuals.append(Residual("least", (normal - margin) * framed, self._of, name, text))
        return residuals

    def recompute_curved(self, arrays: PlanArrays, loads: Array, wrenches: Array) -> list[Residual]:
        """Return by how much tile loads (T, 3) are within the limit surface [N].

        These residuals are not affine in the loads. They are zero for tiles beyond their
        half-planes, which may be outside the surface, too: the plan is reported as overloaded.
        """
        inside = -self._curves.excess(loads[:, 0], loads[:, 1], loads[:, 2], TOLERANCES.utilisation)
        if not np.minimum.reduce(inside) >= -TOLERANCES.load:
            sides = loads[:, 2:] / self._lateral * [1.0, -1.0]  # lateral loads to either side
            planes = self._used(arrays.half_planes, loads)
            used = np.hstack([planes, sides]) * self._per_share
            inside[(used.max(axis=1) > 1.0) | self._known.touch.away] = 0.0
        text = " is beyond its limit curve"
        return [Residual("least", inside, self._of, self._names.tile, text, affine=False)]

    def _used(self, half_planes: tuple[tuple[HalfPlane, ...], ...], loads: Array) -> Array:
        """Return what loads use of half-planes, if all spines held, shape (T, 2 p)."""
        known, table = self._planes
        if known != half_planes:
            table = planes_of(half_planes).take(self._of, 0)
            self._planes = half_planes, table
        return np.asarray((table @ loads[:, :, None])[:, :, 0])


def planes_of(pieces: tuple[tuple[HalfPlane, ...], ...]) -> Array:
    """Return the half-planes of H hands, divided by their capacities, shape (H, 2 p, 3).

    Parameters
    ----------
    pieces : tuple of tuple of HalfPlane
        Half-planes of a whole tile of each hand, at most p of them.

    Returns
    -------
    ndarray, shape (H, 2 p, 3)
        Coefficients of shear, normal and lateral load, one row for each sign of the lateral load;
        zero rows for hands with fewer than p half-planes.
    """
    found = np.zeros((len(pieces), 2 * max(map(len, pieces)), 3))
    for rows, own in zip(found, pieces, strict=True):
        for k, plane in enumerate(own):
            row = np.array([plane.a_shear, plane.a_normal, plane.a_lateral]) / plane.capacity
            rows[2 * k], rows[2 * k + 1] = row, row * [1.0, 1.0, -1.0]
    return found
