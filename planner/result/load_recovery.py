"""Compute the loads of tiles, tendons, motors and palms from the solution of a program.

Loads y of hands with fixed wrists are converted for all hands at once. For a compliant or floating
hand, the hand's model itself gives the loads at the planned wrist pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.compliance import FloatingWrist
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR, layout_of
from hand_models.hand import FINGERS, NAIL, SettledHand, SettledTile
from hand_models.tile import HalfPlane, inner_half_planes
from hand_models.wrench_spaces import WRENCH_SCALE, Row, WrenchSpace
from planner.prepare import (
    CONTACT_CODES,
    HandBatch,
    concatenated,
    contact_pattern_of,
    tile_index_of,
)
from planner.programs import LOAD_UNIT, ScaledRows, is_effort
from planner.question import LimbStiffness
from planner.result.hand_plan import HandPlan, PlanArrays, WristPlan
from planner.result.plain_parts import Palm

__all__ = ["LoadRecovery", "recover_floating_hand"]

PALM_SIGNS: Final = np.array([-1.0, 1.0])
"""Signs of a palm's force on the rock: shear along x, pressing along z."""


class _LoadLayout(NamedTuple):
    """The places of everything in the loads and in the limit rows of all hands.

    Attributes
    ----------
    columns : ndarray of int, shape (H, most m)
        Each hand's loads among all; before all of them is one that is zero.
    shape : tuple of int
        (H, 6 + most limits): so many rows of so many hands.
    limits : ndarray of int, shape (sum of nl,)
        The limit rows among all hands' rows, of which the first six of each hand are its wrench.
    least : ndarray, shape (1 + m,)
        What each load may be at least [N].
    tensions : ndarray of int, shape (F,)
    palms : ndarray of int, shape (H, 2)
    of_tile : ndarray of int, shape (T, 3)
        Loads that shear, normal and lateral load of each tile follow.
    first_row : ndarray of int, shape (H,)
        Of the limit rows, by hand.
    begins : ndarray of int
        Where the limit rows of each tile on rock begin, and where those of a hand's last one end.
    kept : ndarray of int, shape (T,)
        Which of them each tile's are; the first for those that are not on rock.
    hooked : ndarray of int
        Nails that hook.
    nail_limits : ndarray of int, shape (number of them, 2)
        Their limit rows.
    efforts : ndarray of int
        Limit rows whose utilisation counts as effort.
    """

    columns: Indices
    shape: tuple[int, int]
    limits: Indices
    least: Array
    tensions: Indices
    palms: Indices
    of_tile: Indices
    first_row: Indices
    begins: Indices
    kept: Indices
    hooked: Indices
    nail_limits: Indices
    efforts: Indices


@lru_cache(maxsize=256)  # layouts of some 5 kB each
def _layout_of(
    tiles: tuple[tuple[SettledTile, ...], ...],
    columns: tuple[tuple[str, ...], ...],
    names: tuple[tuple[Row, ...], ...],
    limits: tuple[int, ...],
) -> _LoadLayout:
    """Return the layout of all hands.

    Parameters
    ----------
    tiles : tuple of tuple of SettledTile
        By hand, and so are the others.
    columns : tuple of tuple of str
    names : tuple of tuple of Row
        Of the rows of its set.
    limits : tuple of int
        Limit rows of each tile, of which a hand has the first, tile by tile.
    """
    places = tile_index_of([len(own) for own in tiles])
    touch = contact_pattern_of(tiles, places)
    named = [(h, name) for h, own in enumerate(columns) for name in own]
    place = {name: i for i, name in enumerate(named, start=1)}
    # every column that a hand with a fixed wrist may have
    every = (
        *(f"{finger}/{kind}" for kind in ("tension", "lateral", NAIL) for finger in FINGERS),
        PALM_SHEAR,
        PALM_PRESSING,
    )
    found = np.array([[place.get((h, name), 0) for name in every] for h in range(len(limits))])
    loads = np.zeros((len(limits), max(map(len, columns))), dtype=np.intp)
    for h, own in enumerate(columns):
        loads[h, : len(own)] = [place[h, name] for name in own]
    count = len(FINGERS)
    tensions, laterals, axials = (
        found[:, i : i + count].ravel() for i in range(0, 3 * count, count)
    )
    of_tile = np.empty((len(places.hand), 3), dtype=np.intp)
    of_tile[:, :2] = tensions[places.finger, None]
    of_tile[:, 2] = laterals[places.finger]
    hooked = np.flatnonzero(touch.contacts == CONTACT_CODES[NAIL])
    of_tile[hooked, 0] = axials[places.finger[hooked]]
    rows = [(h, row) for h, own in enumerate(names) for row in own if row.kind == "limit"]
    of_row = np.array([h for h, _ in rows], dtype=np.intp)
    counts = np.bincount(of_row, minlength=len(limits))
    first_row, most = np.cumsum(counts) - counts, 6 + int(counts.max())
    touching = [
        sum(CONTACT_CODES[tile.contact] == CONTACT_CODES["face"] for tile in own) for own in tiles
    ]
    of_rock = zip(first_row, limits, touching, strict=True)
    kept = np.zeros(len(places.hand), dtype=np.intp)
    kept[touch.touching] = places.hand[touch.touching] + np.arange(len(touch.touching))
    signed = ("/lateral", f"/{NAIL}")  # may be negative
    return _LoadLayout(
        columns=loads,
        shape=(len(limits), most),
        limits=most * of_row + 6 + np.arange(len(rows)) - first_row[of_row],
        least=np.array([0.0, *(-np.inf if name.endswith(signed) else 0.0 for _, name in named)]),
        tensions=tensions,
        palms=found[:, 3 * count :],
        of_tile=of_tile,
        first_row=first_row,
        begins=np.concatenate([at + each * np.arange(n + 1) for at, each, n in of_rock]),
        kept=kept,
        hooked=hooked,
        nail_limits=np.flatnonzero([row.phalanx == NAIL for _, row in rows]).reshape(-1, 2),
        efforts=np.flatnonzero([is_effort(row) for _, row in rows]),
    )


class LoadRecovery:
    """Conversion of loads y into tile, tendon, motor and palm loads, for hands with fixed wrists.

    Set up once for the rows of H hands; `read` then converts all hands at once.

    Parameters
    ----------
    known : HandBatch
        The settled hands.
    spaces : sequence of WrenchSpace
        Wrench space of each hand.
    scaled : sequence of ScaledRows, optional
        Scaled rows of the wrench spaces, if already computed.
    before : LoadRecovery, optional
        That of the same hands before tiles slipped, from which all that stays is taken over.

    Attributes
    ----------
    rows, at_rest : ndarray, shapes (H, 6 + nl, m), (H, 6 + nl)
        For loads z in `LOAD_UNIT`, ``rows z + at_rest`` are each hand's wrench on the rock [N,
        N·m], then the utilisations of its limits. Padded with zeros to the largest hand.
    least : ndarray, shape (H, m)
        Lower bound of each load [N]: 0, or −∞ for loads of either sign.
    """

    def __init__(
        self,
        known: HandBatch,
        spaces: Sequence[WrenchSpace],
        scaled: Sequence[ScaledRows] | None = None,
        before: LoadRecovery | None = None,
    ) -> None:
        self._layout: _LoadLayout
        self._pieces: tuple[tuple[HalfPlane, ...], ...]
        self._known, settled = known, known.hands
        self._scaled = tuple(map(ScaledRows.of, spaces) if scaled is None else scaled)
        if before is None:
            self._pieces = pieces = tuple([inner_half_planes(hand.surface) for hand in settled])
            signs = [2 if hand.grasp.lateral else 1 for hand in settled]
            limits = [len(own) * sign for own, sign in zip(pieces, signs, strict=True)]
            columns, rows = zip(*((space.columns, space.rows) for space in spaces), strict=True)
            closed = tuple([hand.as_closed.tiles for hand in settled])
            layout = _layout_of(closed, columns, rows, tuple(limits))
            self.least = layout.least.take(layout.columns)
            self.rows = np.zeros((*layout.shape, layout.columns.shape[1]))
            self.at_rest = np.zeros(layout.shape)
            self._drawn = _drawn_tendons(known)
        else:
            layout, self._pieces = before._layout, before._pieces
            self.least, self._drawn = before.least, before._drawn
            self.rows, self.at_rest = before.rows.copy(), before.at_rest.copy()
        self._layout = layout
        for h, own in enumerate(self._scaled):
            if before is None or own is not before._scaled[h]:
                end, count = 6 + len(own.L), own.L.shape[1]
                self.rows[h, :6, :count], self.rows[h, 6:end, :count] = own.generators, own.L
                self.at_rest[h, :6], self.at_rest[h, 6:end] = own.origin, own.l0
        laws = concatenated([hand.loads for hand in settled])
        self._at_zero, self._slope = np.zeros((len(laws), 3)), np.empty((len(laws), 3))
        self._at_zero[:, :2], self._slope[:, :2] = laws[..., 0], laws[..., 1]
        self._slope[:, 2] = known.lateral_shares
        self._slope[layout.hooked, 0] = 1.0
        slipped = np.array([[hand.closed is not None] for hand in settled])
        self._released = layout.columns[slipped & ~self.rows[:, :6].any(axis=1)]
        engaged = tuple([hand.palm.engaged for hand in settled])
        tiles, wrists = tuple([hand.tiles for hand in settled]), (None,) * len(settled)
        self._fixed = tiles, self._pieces, engaged, wrists

    def read(self, loads: Sequence[Array]) -> tuple[PlanArrays, Array, float]:
        """Convert loads y of all hands into loads of tiles, tendons, motors and palms.

        Loads that must not be negative, but are by rounding, count as zero.

        Parameters
        ----------
        loads : sequence of ndarray, shape (m,)
            Loads y of each hand [N].

        Returns
        -------
        arrays : PlanArrays
            Loads of all hands.
        used : ndarray, shape (sum of nl,)
            Utilisation of every limit row, hand by hand.
        effort : float
            Σ ‖E z + e₀‖²: the sum of squared relative tensions and joint torques.
        """
        known, layout = self._known, self._layout
        # before all others a load of zero, for hands that lack one
        y = np.concatenate([np.zeros(1), *loads])
        np.maximum(y, layout.least, out=y)
        y[self._released] = 0.0
        scaled = y.take(layout.columns)
        scaled /= LOAD_UNIT
        rows = (self.rows @ scaled[:, :, None])[:, :, 0]
        rows += self.at_rest
        wrenches, used = rows[:, :6], rows.take(layout.limits)
        efforts = used.take(layout.efforts)

        tensions, palms = y.take(layout.tensions), y.take(layout.palms)
        of_tiles = y.take(layout.of_tile)
        of_tiles *= self._slope
        of_tiles += self._at_zero
        tile_used = np.maximum.reduceat(used, layout.begins).take(layout.kept)
        tile_used *= known.touch.touches
        shears = of_tiles[:, 0]
        if len(layout.hooked):
            tile_used[layout.hooked] = used[layout.nail_limits].max(axis=1)
            shears = shears.copy()
            shears[layout.hooked] = 0.0
        drawn = np.add.reduceat(shears, known.places.first_of_finger)
        drive, (joints, losses, nails) = known.hands[0].hand.drive, self._drawn
        forces = np.zeros((len(known.points), 3))
        forces[: len(of_tiles)] = (of_tiles[:, None] @ known.axes)[:, 0]
        forces[len(of_tiles) :, ::2] = palms * PALM_SIGNS
        palm_used = palms / known.palm_limits
        arrays = PlanArrays(
            tensions,
            drive.driven(tensions, (joints, tensions, drawn, losses, nails)),
            of_tiles,
            forces,
            known.points,
            known.axes,
            np.maximum(tile_used, 0.0),
            known.engagement,
            np.zeros((len(palms), 3)),
            np.maximum(palm_used[:, 0], palm_used[:, 1]),
            wrenches,
            np.maximum(np.maximum.reduceat(used, layout.first_row), 0.0),
            *self._fixed,
        )
        return arrays, used, float(efforts.dot(efforts))


def _drawn_tendons(known: HandBatch) -> tuple[Array, Array, Array]:
    """Return what winches draw in besides travel of the tiles, of each finger.

    Returns
    -------
    joints : ndarray, shape (F,)
        [m]
    losses : ndarray, shape (F,)
        Sum of the diagonal of M (Eq. 8).
    nails : ndarray, shape (F,)
        [m]
    """
    hand, places = known.hands[0].hand, known.places
    sums = np.add.accumulate((1.0 - hand.finger.friction) ** np.arange(len(PHALANGES) + 1.0))
    losses = np.full(len(places.phalanges), sums[-2])
    losses[places.base_fingers] = sums[-1]
    nails = hand.nail.pulley_radius * concatenated([each.nail_angles for each in known.hands])
    return known.bends @ np.array(hand.finger.pulley_radii), losses, nails


def recover_floating_hand(
    limb: str,
    settled: SettledHand,
    wrist: FloatingWrist,
    space: WrenchSpace,
    y: Array,
    pose: WristPlan,
    stiffness: LimbStiffness | None = None,
) -> HandPlan:
    """Compute the loads of a compliant or floating hand at a wrist pose, by the hand's model.

    Parameters
    ----------
    limb : str
    settled : SettledHand
        The hand at rest on its hold.
    wrist : FloatingWrist
        Model of its wrist.
    space : WrenchSpace
        Set of the hand, linearised at the pose.
    y : ndarray, shape (m,)
        The set's loads y: twist of the wrist from rest [m, rad]; for a compliant hand, tensions
        [N] and then the twist.
    pose : WristPlan
        Planned wrist pose. The returned plan has a copy with all else of `WristPlan` filled in.
    stiffness : LimbStiffness, optional
        Stiffness of the limb.

    Returns
    -------
    HandPlan
    """
    closed = wrist.closed_at(y)
    found = wrist.loads_of(y)
    wrench = found.wrenches[0]
    loads, positions, axes = found.tile_loads[0], found.positions[0], found.axes[0]
    mode, stretches = wrist.palm_mode(y), wrist.stretches(loads[:, 0])
    pose = replace(pose, palm=mode, driven=wrist.driven, stretches=stretches)
    tensions = found.tensions[0]
    rows, of_tiles = space.utilisations(y), layout_of(settled, sticking=False).plane_tiles
    used = np.zeros(len(loads))
    np.maximum.at(used, of_tiles, rows[: len(of_tiles)])
    known, drive = HandBatch.of((settled,)), settled.hand.drive
    # the winch stands still from there on
    at_rest = settled.loads[:, 0, 0] + settled.loads[:, 0, 1] * closed[settled.finger_of]
    drawn = np.add.reduceat(at_rest, known.places.first_of_finger)
    joints, losses, nails = _drawn_tendons(known)
    shear, pressing = found.palm[0]
    palm = Palm(
        position=settled.palm.centre,
        force=np.array([-shear, 0.0, pressing]),
        moment=np.zeros(3),
        engaged=settled.palm.engaged,
        utilisation=float((found.palm[0] / known.palm_limits[0]).max()),
    )
    return HandPlan(
        limb=limb,
        wrench=wrench,
        tensions=tensions,
        drives=drive.driven(tensions, (joints, closed, drawn, losses, nails)),
        loads=loads,
        forces=np.einsum("tk,tkx->tx", loads, axes),
        positions=positions,
        axes=axes,
        engagement=settled.engagement,
        limit_shares=settled.limit_shares,
        tile_utilisations=used,
        tiles=settled.tiles,
        half_planes=inner_half_planes(settled.surface),
        palm=palm,
        utilisation=max(0.0, float(rows.max())),
        seating=settled.seating,
        closures=settled.closures,
        space=space,
        wrist=_aimed(pose, wrench, space, stiffness),
    )


def _aimed(
    pose: WristPlan, wrench: Array, space: WrenchSpace, stiffness: LimbStiffness | None
) -> WristPlan:
    """Return a wrist's pose with where its limb is to aim, and how stiff both are together."""
    if stiffness is None:
        return pose
    limb, count = np.array(stiffness.each), len(pose.twist)
    # of turns over 0.1 m, so that all are in newtons per metre
    whole = space.generators[:, -count:] + np.diag(limb)
    both = WRENCH_SCALE[:, None] * whole * WRENCH_SCALE
    least = float(np.linalg.eigvalsh(0.5 * (both + both.T))[0])
    return replace(pose, pose_target=pose.twist + wrench / limb, least_stiffness=least)
