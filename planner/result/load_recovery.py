"""From loads y of hands with fixed wrists to what each tile, tendon, motor and palm carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.finger import PHALANGES
from hand_models.tile import inner_half_planes
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import HandBatch, concatenated
from planner.programs import LOAD_UNIT, ScaledRows
from planner.result.hand_plan import PlanArrays
from planner.result.load_layout import WRENCH, ZERO, layout_of

__all__ = ["LoadRecovery", "drawn_tendons"]

PALM_SIGNS: Final = np.array([-1.0, 1.0])
"""Which way a palm shears and presses along x and z."""


class LoadRecovery:
    """Reads loads of hands with fixed wrists, all hands at once; made once for their rows.

    Parameters
    ----------
    known : HandBatch
    spaces : sequence of WrenchSpace
        Their sets.
    scaled : sequence of ScaledRows, optional
        Their rows, if these are known.

    Attributes
    ----------
    rows, at_rest : ndarray, shapes (H, 6 + nl, m), (H, 6 + nl)
        Of loads in `LOAD_UNIT`, each hand's filled up with zeros to the most that one has: its
        wrench on the rock [N, N·m], then the utilisations of its limits.
    least : ndarray, shape (H, m)
        What each load may be at least [N].
    """

    def __init__(
        self,
        known: HandBatch,
        spaces: Sequence[WrenchSpace],
        scaled: Sequence[ScaledRows] | None = None,
    ) -> None:
        self._known, settled = known, known.hands
        pieces = tuple([inner_half_planes(hand.surface) for hand in settled])
        signs = [2 if hand.grasp.lateral else 1 for hand in settled]
        limits = [len(own) * sign for own, sign in zip(pieces, signs, strict=True)]
        tiles = tuple([hand.tiles for hand in settled])
        self._layout = layout = layout_of(
            tiles,
            tuple([space.columns for space in spaces]),
            tuple([space.rows for space in spaces]),
            tuple(limits),
        )

        laws = concatenated([hand.loads for hand in settled])
        self._at_zero, self._slope = np.zeros((len(laws), 3)), np.empty((len(laws), 3))
        self._at_zero[:, :2], self._slope[:, :2] = laws[..., 0], laws[..., 1]
        self._slope[:, 2] = known.lateral_shares
        if len(layout.hooked):
            self._slope[layout.hooked, 0] = 1.0
        self.least = layout.least.take(layout.columns)
        self.rows = np.zeros((*layout.shape, layout.columns.shape[1]))
        self.at_rest = np.zeros(layout.shape)
        of_sets = [ScaledRows.of(space) for space in spaces] if scaled is None else scaled
        for mine, rest, own in zip(self.rows, self.at_rest, of_sets, strict=True):
            end, columns = WRENCH + len(own.L), own.L.shape[1]
            mine[:WRENCH, :columns], mine[WRENCH:end, :columns] = own.generators, own.L
            rest[:WRENCH], rest[WRENCH:end] = own.origin, own.l0
        self._drawn = drawn_tendons(known)
        self._fixed = (
            tiles,
            pieces,
            tuple([hand.palm.engaged for hand in settled]),
            (None,) * len(settled),
        )

    def read(self, loads: Sequence[Array]) -> tuple[PlanArrays, Array, float]:
        """Return what loads y of all hands say [N].

        What may not be negative and is, by rounding, counts as zero.

        Returns
        -------
        arrays : PlanArrays
        used : ndarray, shape (sum of nl,)
            Utilisation of every limit row, hand by hand.
        effort : float
            Σ ‖E z + e₀‖²: the sum of squared relative tensions and joint torques.
        """
        known, layout = self._known, self._layout
        y = np.concatenate([ZERO, *loads])
        np.maximum(y, layout.least, out=y)
        scaled = y.take(layout.columns)
        scaled /= LOAD_UNIT
        rows = (self.rows @ scaled[:, :, None])[:, :, 0]
        rows += self.at_rest
        wrenches, used = rows[:, :WRENCH], rows.take(layout.limits)
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


def drawn_tendons(known: HandBatch) -> tuple[Array, Array, Array]:
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
