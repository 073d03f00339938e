"""Names and constant coefficients of a hand's rows: what its limits are, whatever loads it.

They only depend on which tiles touch, on the surface and on the joints' stops; wrench spaces of
fixed and of floating wrists have the same.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from hand_models.finger import PHALANGES
from hand_models.frames import Array, Indices
from hand_models.hand import FINGERS, FINGERTIP_FORCE, NAIL, NAIL_SHEAR, Tile
from hand_models.limit_pieces import HalfPlane
from hand_models.structure import HELD
from hand_models.wrench_space import Row

__all__ = [
    "HAND_LOAD",
    "PALM_PRESSING",
    "PALM_SHEAR",
    "TENDON_TENSION",
    "RowLayout",
    "named_row",
    "row_layout",
]

PALM_SHEAR = "palm_shear"
PALM_PRESSING = "palm_pressing"
HAND_LOAD = "hand_load"
TENDON_TENSION = "tendon_tension"
TENDON_LIMITS = (TENDON_TENSION, "motor_torque", "motor_current")
"""Limits of each tendon, in the order of their rows."""


class RowLayout(NamedTuple):
    """Names and constant coefficients, which only depend on what touches.

    Attributes
    ----------
    columns : tuple of str
    limits, hard : tuple of Row
    planes : tuple of ndarray
        Tile, a_shear, a_normal, a_lateral (with its sign) and capacity of each tile's limit rows.
    engaged : tuple of int
        Fingers with a tile on rock.
    drawing : tuple of int
        Those and the fingers whose nail hooks.
    tips, frames : tuple of int
        Distal tiles whose phalanx presses on rock; tiles whose phalanx does so beside them.
    nail_columns : tuple of int
        Of the loads along the nails that hook.
    sticking : bool
        Whether the tendons have friction, so that they must not be slackened.
    """

    columns: tuple[str, ...]
    limits: tuple[Row, ...]
    hard: tuple[Row, ...]
    planes: tuple[Indices, Array, Array, Array, Array]
    engaged: tuple[int, ...]
    drawing: tuple[int, ...]
    tips: tuple[int, ...]
    frames: tuple[int, ...]
    nail_columns: tuple[int, ...]
    sticking: bool


@lru_cache(maxsize=512)
def row_layout(
    tiles: tuple[Tile, ...],
    engaged: tuple[int, ...],
    reacting: tuple[int, ...],
    pieces: tuple[HalfPlane, ...],
    stops: tuple[tuple[int, int], ...],
    palm: bool,
    sticking: bool,
) -> RowLayout:
    """Return the rows of a settled hand.

    Parameters
    ----------
    tiles : tuple of Tile
    engaged, reacting : tuple of int
        Fingers with a tile on rock; those of them that resist sideways.
    pieces : tuple of HalfPlane
        Limits of each tile.
    stops : tuple of (int, int)
        Finger and joint of those at a limit.
    palm : bool
        Whether it is on rock.
    sticking : bool
        Whether tendons must not be slackened.
    """
    columns = [f"{finger}/tension" for finger in FINGERS]
    columns += [f"{FINGERS[i]}/lateral" for i in reacting]
    nails = [tile.finger for tile in tiles if tile.contact == NAIL]
    nail_columns = range(len(columns), len(columns) + len(nails))
    columns += [f"{finger}/{NAIL}" for finger in nails]
    drawing = sorted({*engaged, *(FINGERS.index(finger) for finger in nails)})
    limits, hard = [], []
    planes: list[tuple[int, float, float, float, float]] = []
    touching = [i for i, tile in enumerate(tiles) if tile.contact in ("face", "edge")]
    frames = [i for i, tile in enumerate(tiles) if tile.contact == "frame"]
    tips = [i for i, t in enumerate(tiles) if t.phalanx == "distal" and t.contact != "none"]
    for i in touching:
        finger, phalanx = tiles[i].finger, tiles[i].phalanx
        pulls = 0
        for piece in pieces:
            pulls += piece.limit == "pull_off"
            label = f"{finger}/{phalanx}/{piece.limit}" + (f"_{pulls}" if pulls > 1 else "")
            signs = (("+", 1.0), ("-", -1.0)) if FINGERS.index(finger) in reacting else (("", 0.0),)
            for sign, factor in signs:
                limits.append(Row(finger, phalanx, piece.limit, "limit", label + sign))
                planes.append(
                    (i, piece.a_shear, piece.a_normal, factor * piece.a_lateral, piece.capacity)
                )
    for name in TENDON_LIMITS:
        limits += [named_row(finger, None, name, "limit") for finger in FINGERS]
    limits += [named_row(FINGERS[i], None, "finger_shear", "limit") for i in engaged]
    limits += [named_row(tiles[i].finger, "distal", FINGERTIP_FORCE, "limit") for i in tips]
    for finger in nails:
        limits += [named_row(finger, NAIL, name, "limit") for name in (NAIL_SHEAR, FINGERTIP_FORCE)]
    hard += [named_row(finger, None, "slack_tendon", "hard") for finger in FINGERS]
    for name, those in (("dragged_backwards", touching), ("frame_pulled", frames)):
        hard += [named_row(tiles[i].finger, tiles[i].phalanx, name, "hard") for i in those]
    for finger_index, joint in stops:
        hard.append(named_row(FINGERS[finger_index], PHALANGES[joint], "joint_stop", "hard"))
    for finger in nails:
        for name, label in (("nail_lifts", ""), ("nail_slips", "+"), ("nail_slips", "-")):
            hard.append(Row(finger, NAIL, name, "hard", f"{finger}/{NAIL}/{name}{label}"))
        hard += [named_row(finger, phalanx, "joint_stop", "hard") for phalanx in PHALANGES]
    if sticking:
        hard += [named_row(FINGERS[i], None, "tendon_sticks", "hard") for i in drawing]
    if palm:
        columns += [PALM_SHEAR, PALM_PRESSING]
        limits += [Row(None, None, name, "limit", name) for name in (PALM_SHEAR, PALM_PRESSING)]
        hard += [
            Row(None, None, f"{name}_reversed", "hard", f"{name}_reversed")
            for name in (PALM_SHEAR, PALM_PRESSING)
        ]
    limits += [
        Row(None, None, HAND_LOAD, "limit", f"{HAND_LOAD}/{k + 1}") for k in range(len(HELD))
    ]
    table = np.array(planes).reshape(-1, 5)
    return RowLayout(
        tuple(columns),
        tuple(limits),
        tuple(hard),
        (table[:, 0].astype(np.intp), table[:, 1], table[:, 2], table[:, 3], table[:, 4]),
        engaged,
        tuple(drawing),
        tuple(tips),
        tuple(frames),
        tuple(nail_columns),
        sticking,
    )


def named_row(finger: str, phalanx: str | None, limit: str, kind: Literal["limit", "hard"]) -> Row:
    """Return a row of a finger, labelled by its names."""
    label = "/".join(part for part in (finger, phalanx, limit) if part is not None)
    return Row(finger, phalanx, limit, kind, label)
