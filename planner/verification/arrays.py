"""Arrays of the check of plans: what a plan's numbers are, and what they are multiplied by."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import SKEW, Array, Indices
from hand_models.hand import FINGERS, HandModel
from hand_models.tile import HalfPlane, Surface, inner_half_planes
from planner.prepare import KEPT, HandBatch, TileIndex
from planner.verification.equilibrium import tendons_of
from planner.verification.limit_surface import LimitCurves
from planner.verification.sentences import DRIVES

__all__ = [
    "CROSS",
    "DRIVE",
    "DRIVEN",
    "LOAD",
    "SHEAR",
    "TIP",
    "UTILISATION",
    "WINCH",
    "Roles",
    "TileLimits",
    "Uses",
    "arms_of",
    "limits_of",
    "planes_of",
    "roles_of",
    "uses_of",
]

LOAD: Final = 1e-6
"""Largest disagreement of a tile's load, relative to the largest load of its hand."""

UTILISATION: Final = 1e-6
"""How far a utilisation may be from what the plan says."""

DRIVE: Final = 1e-9
"""How far a motor's torque, current or winch angle may be from what the plan says, relative."""

CROSS: Final = SKEW.transpose(0, 2, 1).reshape(9, 3)
"""From p ⊗ F to the moment p × F."""

FORCES: Final = np.eye(6, 3).ravel()
"""What a wrench takes of a force wherever it acts, row by row."""

MOMENTS: Final = np.concatenate([np.zeros((3, 3, 3)), SKEW], axis=1).reshape(3, -1)
"""What it takes of it per metre of the place's coordinates."""


class Roles(NamedTuple):
    """What the numbers of a plan are, by which tile is whose.

    Attributes
    ----------
    first_component : ndarray of int, shape (H,)
        Of each hand's tiles' loads.
    hand : ndarray of int, shape (n,)
        Whose each number is that `Recomputed.loads_off` speaks of.
    ends : ndarray of int
        Where each kind of them ends.
    relative : ndarray, shape (3 F + T + 2 H,)
        How far each of `Recomputed.used` may be off.
    """

    first_component: Indices
    hand: Indices
    ends: Indices
    relative: Array


@lru_cache(maxsize=KEPT)
def roles_of(places: TileIndex) -> Roles:
    """Return what the numbers of a plan are."""
    tiles, fingers, hands = places.shape
    drives, others = len(DRIVES) * fingers, tiles + 2 * hands
    each, tile = np.arange(hands), places.hand
    three, six = tile.repeat(3), each.repeat(6)
    kinds = [each.repeat(len(FINGERS)), *(tile,) * 4, three, tile, each, each, six, each]
    return Roles(
        first_component=3 * places.first,
        hand=np.concatenate(kinds),
        ends=np.cumsum([len(kind) for kind in kinds]),
        relative=np.repeat([DRIVE, UTILISATION], [drives, others]),
    )


class TileLimits(NamedTuple):
    """What the tiles of some hands hold on their surfaces.

    Attributes
    ----------
    pieces : tuple of tuple of HalfPlane
        Of each hand's tiles.
    planes : ndarray, shape (T, 2 p, 3)
        Those of each tile over their capacities, for lateral loads of either sign.
    curves : LimitCurves
    """

    pieces: tuple[tuple[HalfPlane, ...], ...]
    planes: Array
    curves: LimitCurves


def limits_of(known: HandBatch) -> TileLimits:
    """Return the limits of tiles of hands."""
    surfaces = tuple([hand.surface for hand in known.hands])
    limits = _limits_of(surfaces, known.places)
    if (known.engagement == 1.0).all():
        return limits
    shares = np.where(known.touch.away, 1.0, known.engagement)
    return limits._replace(
        planes=limits.planes * _whole_per_part(known),
        curves=LimitCurves(surfaces, known.places.hand, shares),
    )


def _whole_per_part(known: HandBatch) -> Array:
    """Return 1 / φ of each tile, zero for tiles that touch nothing, shape (T, 1, 1)."""
    shares = np.where(known.touch.away, np.inf, known.engagement)
    return np.asarray(1.0 / shares[:, None, None])


@lru_cache(maxsize=KEPT)
def _limits_of(surfaces: tuple[Surface, ...], places: TileIndex) -> TileLimits:
    """Return the limits of tiles that all touch."""
    pieces = tuple(inner_half_planes(surface) for surface in surfaces)
    return TileLimits(pieces, _planes(pieces, places), LimitCurves(surfaces, places.hand))


def planes_of(pieces: Sequence[Sequence[HalfPlane]], known: HandBatch) -> Array:
    """Return hands' half-planes over their capacities, of each tile's spines on the rock.

    Shape (T, 2 p, 3), for lateral loads of either sign. Zero for tiles that touch nothing, and
    where a hand has fewer than others. ``pieces``: of whole tiles.
    """
    return np.asarray(_planes(pieces, known.places) * _whole_per_part(known))


def _planes(pieces: Sequence[Sequence[HalfPlane]], places: TileIndex) -> Array:
    most = max(map(len, pieces))
    tables = [
        [
            (p.a_shear / p.capacity, p.a_normal / p.capacity, side * p.a_lateral / p.capacity)
            for side in (1.0, -1.0)
            for p in own
        ]
        + [(0.0, 0.0, 0.0)] * 2 * (most - len(own))
        for own in pieces
    ]
    return np.array(tables).take(places.hand, 0)


WINCH, DRIVEN, SHEAR, TIP = 2, 3, 6, 7
"""Rows of `Uses`: winch angles, the first that is a utilisation, of fingers' shears and tips."""


class Uses(NamedTuple):
    """What tensions do to tendons, motors and fingers, in rows over all fingers.

    Torque and current of the motors, angle of the winches; then utilisations of tendons, by the
    motors' torque and current, of the shears of fingers, and of their tips.

    Attributes
    ----------
    per_newton : ndarray, shape (8, F)
    at_zero : ndarray, shape (8, F)
        Of straight fingers.
    per_shear : ndarray, shape (8, 1)
        Per newton of the shears of a finger's tiles together, which pull them away from the winch.
    per_bend : ndarray, shape (3,)
        Of the winch's angle per bend of each joint.
    per_nail : float
        The same of a nail.
    per_press : float
        Of the tip's utilisation [1/N].
    hand_load : float
        What a hand holds [N].
    """

    per_newton: Array
    at_zero: Array
    per_shear: Array
    per_bend: Array
    per_nail: float
    per_press: float
    hand_load: float


@lru_cache(maxsize=KEPT)
def uses_of(places: TileIndex, hand: HandModel, strength: float) -> Uses:
    """Return what tensions do.

    Parameters
    ----------
    places : TileIndex
    hand : HandModel
        Which all hands are.
    strength : float
        What every tendon may hold [N].
    """
    drive, tendons, structure = hand.drive, tendons_of(places, hand), hand.structure
    torque = drive.winch_radius / drive.gear_ratio / drive.efficiency
    current, idle = torque / drive.torque_constant, drive.no_load_current
    driven = [torque / drive.maximum_torque, current / drive.maximum_current]
    fingers = len(tendons.pull)
    per_newton, at_zero = np.zeros((2, TIP + 1, fingers))
    per_newton[:SHEAR] = np.array([torque, current, 0.0, 1.0 / strength, *driven])[:, None]
    per_newton[WINCH] = tendons.drawn[1] / drive.winch_radius
    at_zero[1], at_zero[SHEAR - 1] = idle, idle / drive.maximum_current
    at_zero[WINCH] = hand.nail.pulley_radius * hand.nail.retraction / drive.winch_radius
    per_shear = np.zeros((TIP + 1, 1))
    per_shear[WINCH] = -tendons.travel / drive.winch_radius
    per_shear[SHEAR] = 1.0 / structure.finger_shear
    return Uses(
        per_newton,
        at_zero,
        per_shear,
        per_bend=tendons.radii / drive.winch_radius,
        per_nail=hand.nail.pulley_radius / drive.winch_radius,
        per_press=1.0 / structure.fingertip_force,
        hand_load=structure.hand_load,
    )


def arms_of(points: Array) -> Array:
    """Return what makes wrenches of forces at some places (n, 3), shape (n, 6, 3)."""
    return np.asarray((points @ MOMENTS + FORCES).reshape(-1, 6, 3))
