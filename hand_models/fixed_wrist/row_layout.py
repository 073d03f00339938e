"""Names of a hand's columns and rows (its loads and its limits), and the tile or finger of each.

A layout depends only on which tiles touch, on the names of the half-planes that limit a tile, on
the joints' stops and on the palm, so that hands share layouts; wrench spaces of fixed and of
floating wrists have the same rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger import PHALANGES
from hand_models.hand import (
    FINGERS,
    FINGERTIP_FORCE,
    HELD_DIRECTIONS,
    NAIL,
    NAIL_SHEAR,
    SettledHand,
    SettledTile,
)
from hand_models.tile import Surface, inner_half_planes
from hand_models.wrench_spaces import Row

__all__ = [
    "HAND_LOAD",
    "PALM_PRESSING",
    "PALM_SHEAR",
    "TENDON_TENSION",
    "RowLayout",
    "layout_of",
    "named_row",
    "row_layout",
]

PALM_SHEAR = "palm_shear"
PALM_PRESSING = "palm_pressing"
HAND_LOAD = "hand_load"
TENDON_TENSION = "tendon_tension"
_Name = tuple[str | None, str | None, str, str]
"""Finger, phalanx and limit of a row, and what distinguishes it from others of these names."""


@dataclass(frozen=True, eq=False)
class RowLayout:
    """Names of columns and rows, and the tile and column that each row concerns.

    Fingers are indices into `FINGERS`, tiles indices into the hand's tiles. Arrays are read-only.

    Attributes
    ----------
    columns : tuple of str, length m
        Names of the loads.
    limits, hard, rows : tuple of Row
        Limit rows, hard rows, and both one after the other.
    finger_of : ndarray of int, shape (n,)
        Finger of each of the n tiles.
    touching, bases, frames, tips, nails : ndarray of int
        Tiles on rock; those of them on rotating bases; tiles beside which the phalanx's frame rests
        on rock; distal tiles whose phalanx presses on rock; nails that hook.
    plane_tiles, plane_pieces, plane_signs : ndarray of int, shape (k,)
        Tile, half-plane, and sign of the lateral load (0 where there is none), of each of the k
        limit rows of tiles.
    engaged, reacting, drawing : tuple of int
        Fingers with a tile on rock; those of them with a lateral reaction; the engaged ones and
        those whose nail hooks.
    lateral_columns, nail_columns : tuple of int
        Columns of the lateral reactions, and of the loads along nails that hook.
    stops : tuple of (int, int)
        Finger and joint of each joint that is at its stop.
    palm : bool
        True if the palm is on rock: the last two columns are then its shear and its pressing.
    sticking : bool
        True if the tendons have friction, so that they must not be slackened.
    """

    columns: tuple[str, ...]
    limits: tuple[Row, ...]
    hard: tuple[Row, ...]
    rows: tuple[Row, ...]
    finger_of: Indices
    touching: Indices
    bases: Indices
    frames: Indices
    tips: Indices
    nails: Indices
    plane_tiles: Indices
    plane_pieces: Indices
    plane_signs: Indices
    engaged: tuple[int, ...]
    reacting: tuple[int, ...]
    drawing: tuple[int, ...]
    lateral_columns: tuple[int, ...]
    nail_columns: tuple[int, ...]
    stops: tuple[tuple[int, int], ...]
    palm: bool
    sticking: bool

    def planes(self, surfaces: Sequence[Surface]) -> Array:
        """Return the half-plane of each of the k limit rows of tiles, on each of n surfaces.

        Returns
        -------
        ndarray, shape (n, k, 4)
            Coefficients of a tile's shear, normal and lateral load, the last times the row's sign;
            then the capacity of a tile with all its spines on the rock [N].
        """
        signs = np.ones((len(self.plane_signs), 4))
        signs[:, 2] = self.plane_signs
        planes = np.array(
            [[piece[1:] for piece in inner_half_planes(surface)] for surface in surfaces]
        )
        return np.asarray(planes[:, self.plane_pieces] * signs)


def layout_of(settled: SettledHand, *, sticking: bool) -> RowLayout:
    """Return the row layout of a settled hand.

    Parameters
    ----------
    settled : SettledHand
    sticking : bool
        True if the tendons have friction, so that they must not be slackened.
    """
    # nothing depends on what of a tile touches, and of a surface only the names
    alike = [
        tile if tile.contact != "edge" else tile._replace(contact="face") for tile in settled.tiles
    ]
    return row_layout(
        tuple(alike),
        settled.grasp.lateral,
        tuple([piece.limit for piece in inner_half_planes(settled.surface)]),
        tuple([(finger, joint) for finger, joint, _ in settled.stops]),
        bool(settled.palm.engaged),
        sticking,
    )


@lru_cache(maxsize=512)  # layouts of some 30 kB each
def row_layout(
    tiles: tuple[SettledTile, ...],
    lateral: bool,
    pieces: tuple[str, ...],
    stops: tuple[tuple[int, int], ...],
    palm: bool,
    sticking: bool,
) -> RowLayout:
    """Return the row layout that hands of the same contacts share; an LRU cache keeps 512 of them.

    Parameters
    ----------
    tiles : tuple of SettledTile
    lateral : bool
        True if fingers with a tile on rock have a lateral reaction.
    pieces : tuple of str
        Names of the half-planes that limit each tile.
    stops : tuple of (int, int)
        Finger and joint of each joint that is at its stop.
    palm : bool
        True if the palm is on rock.
    sticking : bool
        True if the tendons have friction, so that they must not be slackened.
    """
    finger_of = [FINGERS.index(tile.finger) for tile in tiles]
    touching = [i for i, tile in enumerate(tiles) if tile.contact in ("face", "edge")]
    bases = [i for i in touching if tiles[i].phalanx == "base"]
    frames = [i for i, tile in enumerate(tiles) if tile.contact == "frame"]
    tips = [i for i, t in enumerate(tiles) if t.phalanx == "distal" and t.contact != "none"]
    nails = [i for i, tile in enumerate(tiles) if tile.contact == NAIL]
    holding = [finger_of[i] for i in touching]
    engaged = sorted(set(holding))
    reacting = engaged if lateral else []
    drawing = sorted({*engaged, *(finger_of[i] for i in nails)})
    columns = [f"{finger}/tension" for finger in FINGERS]
    lateral_columns = range(len(columns), len(columns) + len(reacting))
    columns += [f"{FINGERS[i]}/lateral" for i in reacting]
    nail_columns = range(len(columns), len(columns) + len(nails))
    clinging = [tiles[i].finger for i in nails]
    columns += [f"{finger}/{NAIL}" for finger in clinging]
    signs = (("+", 1), ("-", -1)) if lateral else (("", 0),)
    pulls = [pieces[: k + 1].count("pull_off") for k in range(len(pieces))]
    limits: list[_Name] = [
        (*tiles[i][:2], piece, (f"_{count}" if count > 1 else "") + sign)
        for i in touching
        for piece, count in zip(pieces, pulls, strict=True)
        for sign, _ in signs
    ]
    planes = [(i, k, sign) for i in touching for k in range(len(pieces)) for _, sign in signs]
    of_tendons = (TENDON_TENSION, "motor_torque", "motor_current")
    limits += [(finger, None, name, "") for name in of_tendons for finger in FINGERS]
    limits += [(FINGERS[i], None, "finger_shear", "") for i in engaged]
    limits += [(FINGERS[i], None, "finger_lateral", sign) for i in reacting for sign in "+-"]
    limits += [(tiles[i].finger, "distal", FINGERTIP_FORCE, "") for i in tips]
    limits += [
        (each, NAIL, name, "") for each in clinging for name in (NAIL_SHEAR, FINGERTIP_FORCE)
    ]
    hard: list[_Name] = [(finger, None, "slack_tendon", "") for finger in FINGERS]
    hard += [(*tiles[i][:2], "dragged_backwards", "") for i in touching]
    hard += [(*tiles[i][:2], "frame_pulled", "") for i in frames]
    hard += [(FINGERS[i], PHALANGES[joint], "joint_stop", "") for i, joint in stops]
    for finger in clinging:
        hard.append((finger, NAIL, "nail_lifts", ""))
        hard += [(finger, NAIL, "nail_slips", sign) for sign in "+-"]
        hard += [(finger, phalanx, "joint_stop", "") for phalanx in PHALANGES]
    if sticking:
        hard += [(FINGERS[i], None, "tendon_sticks", "") for i in drawing]
    if palm:
        columns += [PALM_SHEAR, PALM_PRESSING]
        limits += [(None, None, name, "") for name in (PALM_SHEAR, PALM_PRESSING)]
        hard += [(None, None, f"{name}_reversed", "") for name in (PALM_SHEAR, PALM_PRESSING)]
    limits += [(None, None, HAND_LOAD, f"/{k + 1}") for k in range(len(HELD_DIRECTIONS))]
    limit_rows = tuple([named_row(*each[:3], "limit", each[3]) for each in limits])
    hard_rows = tuple([named_row(*each[:3], "hard", each[3]) for each in hard])
    plane_tiles, plane_pieces, plane_signs = np.array(planes, dtype=np.intp).reshape(-1, 3).T
    return RowLayout(
        columns=tuple(columns),
        limits=limit_rows,
        hard=hard_rows,
        rows=limit_rows + hard_rows,
        finger_of=_kept(finger_of),
        touching=_kept(touching),
        bases=_kept(bases),
        frames=_kept(frames),
        tips=_kept(tips),
        nails=_kept(nails),
        plane_tiles=_kept(plane_tiles),
        plane_pieces=_kept(plane_pieces),
        plane_signs=_kept(plane_signs),
        engaged=tuple(engaged),
        reacting=tuple(reacting),
        drawing=tuple(drawing),
        lateral_columns=tuple(lateral_columns),
        nail_columns=tuple(nail_columns),
        stops=stops,
        palm=palm,
        sticking=sticking,
    )


def _kept(numbers: Sequence[int] | Indices) -> Indices:
    """Return numbers as an array that nobody changes."""
    array = np.array(numbers, dtype=np.intp)
    array.setflags(write=False)
    return array


def named_row(
    finger: str | None,
    phalanx: str | None,
    limit: str,
    kind: Literal["limit", "hard"],
    more: str = "",
) -> Row:
    """Return a `Row` whose label is its names joined by ``/``, then ``more``.

    Parameters
    ----------
    finger, phalanx : str or None
        Names of the finger and the phalanx that the row concerns; None is left out of the label.
    limit : str
        Name of the limit.
    kind : {'limit', 'hard'}
    more : str, optional
        Suffix that distinguishes rows of the same names, such as ``+``, ``-`` or ``/3``.
    """
    label = "/".join(part for part in (finger, phalanx, limit) if part is not None)
    return Row(finger, phalanx, limit, kind, label + more)
