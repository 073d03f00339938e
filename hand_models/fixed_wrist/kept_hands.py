"""Write closed hands to a file of arrays, and read them again without closing them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import numpy as np

from hand_models.base import (
    Array,
    InvalidInputError,
    Pose,
    UnsupportedError,
    reading_file,
    whole_file,
)
from hand_models.hand import (
    FINGERS,
    Grasp,
    HandPostures,
    Placement,
    Seating,
    SettledHand,
    SettledPalm,
    SettledTile,
    SpinyHand,
)
from hand_models.rock import Mesh
from hand_models.tile import Surface

__all__ = ["ClosedPlacement", "check_made_with", "input_digests", "read_hands", "write_hands"]

FILE_FORMAT: Final = "crux closed hands 2"
"""First array of a file of closed hands."""

HAND_ARRAYS: Final = (
    "positions",
    "axes",
    "loads",
    "engagement",
    "nail_angles",
    "nail_normals",
)
"""Arrays of `SettledHand` that are written as they are."""


class ClosedPlacement(NamedTuple):
    """A hand that was closed, and the placement with which it was.

    Attributes
    ----------
    placement : Placement
    hand : SettledHand
    """

    placement: Placement
    hand: SettledHand


def write_hands(closed: Sequence[ClosedPlacement], path: Path) -> None:
    """Write closed hands of one kind on one mesh to a file of arrays (NumPy's ``.npz``).

    Parameters
    ----------
    closed : sequence of ClosedPlacement
        Hands, at least one, all on the same `Mesh`, with the same surface and hand model.
    path : Path

    Raises
    ------
    InvalidInputError
        If there are none, or they differ in rock, surface or hand; the field is ``closed``.
    UnsupportedError
        If a hand clings with its nails.
    """
    if not closed:
        raise InvalidInputError("at least one hand is needed, got none", field="closed")
    hands = [each.hand for each in closed]
    first = hands[0]
    for i, each in enumerate(hands):
        same = {
            "rock": each.hold is first.hold,
            "surface": each.surface == first.surface,
            "hand": each.hand == first.hand,
        }
        if not all(same.values()):
            other = " and ".join(name for name in same if not same[name])
            raise InvalidInputError(
                f"must be on one rock, of one surface, with one hand; number {i} differs from "
                f"number 0 in {other}: write a file for each",
                field="closed",
            )
    if not isinstance(first.hold, Mesh) or any(each.grasp.fingernail for each in hands):
        raise UnsupportedError(
            "only hands on meshes, without fingernail grasps, can be written to a file"
        )
    given = [_given(each.placement) for each in closed]
    arrays: dict[str, Any] = {
        "format": FILE_FORMAT,
        "made_with": list(
            input_digests(first.hold, first.surface, first.hand.table.sections).values()
        ),
        "grasp": [msgspec.json.encode(each.grasp).decode() for each in hands],
        "closing_tension": [each.closing_tension for each in hands],
        "given": [kind for kind, _ in given],
        "given_pose": [pose for _, pose in given],
        "pose": [_matrix(each.seating.pose) for each in hands],
        "rule": [each.seating.rule for each in hands],
        "backed_off": [each.seating.backed_off for each in hands],
        "tiles": [each.tiles for each in hands],
        "palm_gaps": [each.palm.gaps for each in hands],
        "palm_engaged": [_palm_shares(each.palm) for each in hands],
        "palm_centre": [each.palm.centre for each in hands],
        "palm_limits": [each.palm[4:] for each in hands],
        "stop_of": [(h, i, j) for h, each in enumerate(hands) for i, j, _ in each.stops],
        "stop_torque": [torque for each in hands for _, _, torque in each.stops],
    }
    for name in HAND_ARRAYS:
        arrays[name] = [getattr(each, name) for each in hands]
    for name in HandPostures._fields:
        arrays[f"posture_{name}"] = [getattr(each.postures, name) for each in hands]
    with whole_file(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **{k: np.asarray(v) for k, v in arrays.items()})


def read_hands(path: Path, rock: Mesh, surface: Surface, hand: SpinyHand) -> list[ClosedPlacement]:
    """Read closed hands from a file, and put them into the cache of ``hand``.

    A stance with a hand of the same placement, on this very ``rock`` object, then takes the hand
    that was read, and does not close it again.

    Parameters
    ----------
    path : Path
        Written by `write_hands`.
    rock : Mesh
    surface : Surface
    hand : SpinyHand
        These three must be as they were when the file was written.

    Raises
    ------
    InvalidInputError
        If `write_hands` has not written the file, or rock, surface or hand differ; the field is
        ``file``.
    """
    with reading_file(path), np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
        if str(arrays.get("format")) != FILE_FORMAT:
            raise InvalidInputError(f"is not a file of closed hands: {path}", field="file")
        now = input_digests(rock, surface, hand.table.sections)
        again = f"close the hands again, and write them anew: {path}"
        check_made_with(now, arrays["made_with"].tolist(), again)
        closed = [
            _closed(arrays, i, rock, surface, hand) for i in range(len(arrays["closing_tension"]))
        ]
    hand.keep(closed)
    return closed


def _palm_shares(palm: SettledPalm) -> Array:
    """Return the spine engagement of each tile of a palm, 0 for those that are not engaged."""
    shares = np.zeros(len(palm.gaps))
    shares[list(palm.engaged)] = palm.engagement
    return shares


def _given(placement: Placement) -> tuple[str, Array]:
    """Return which pose a placement has, and this as a matrix."""
    if placement.hold_in_hand is not None:
        return "hold_in_hand", _matrix(placement.hold_in_hand)
    if placement.at is not None:
        return "at", _matrix(placement.at)
    return "none", np.zeros((3, 4))


def _matrix(pose: Pose) -> Array:
    """Return rotation and position as three rows of four numbers."""
    return np.column_stack([pose.rotation, pose.position])


def _pose(matrix: Array) -> Pose:
    rotation, position = np.ascontiguousarray(matrix[:, :3]), np.ascontiguousarray(matrix[:, 3])
    rotation.setflags(write=False)
    position.setflags(write=False)
    return Pose(position, rotation)


def input_digests(rock: Mesh, surface: Surface, sections: Any) -> dict[str, str]:
    """Return SHA-256 digests of a rock's triangles, a surface and a hand's numbers, by name."""
    triangles = sha256(rock.triangles.vertices.tobytes())
    triangles.update(np.ascontiguousarray(rock.triangles.faces).tobytes())
    numbers = sorted((key, sorted(entries.items())) for key, entries in sections.items())
    return {
        "rock": triangles.hexdigest(),
        "surface": sha256(repr(replace(surface, name=None)).encode()).hexdigest(),
        "hand": sha256(repr(numbers).encode()).hexdigest(),
    }


def check_made_with(now: Mapping[str, str], before: Iterable[str], again: str) -> None:
    """Raise if a file was made with other inputs, by their digests; ``again``: what to do then."""
    differ = [name for (name, new), old in zip(now.items(), before, strict=True) if new != old]
    if differ:
        raise InvalidInputError(
            f"was made with another {' and another '.join(differ)}: {again}", field="file"
        )


def _closed(
    arrays: dict[str, Any], i: int, rock: Mesh, surface: Surface, hand: SpinyHand
) -> ClosedPlacement:
    """Return the i-th hand of a file."""

    def own(name: str) -> Any:
        array = np.array(arrays[name][i])
        array.setflags(write=False)
        return array

    grasp = msgspec.json.decode(str(arrays["grasp"][i]), type=Grasp)
    given = str(arrays["given"][i])
    pose = _pose(arrays["given_pose"][i])
    shares = arrays["palm_engaged"][i]
    engaged = np.flatnonzero(shares)
    tiles = tuple(SettledTile(*map(str, names)) for names in arrays["tiles"][i])
    finger_of = np.array([FINGERS.index(tile.finger) for tile in tiles])
    finger_of.setflags(write=False)
    settled = SettledHand(
        hand=hand,
        hold=rock,
        grasp=grasp,
        surface=surface,
        closing_tension=float(arrays["closing_tension"][i]),
        seating=Seating(
            _pose(arrays["pose"][i]), str(arrays["rule"][i]), float(arrays["backed_off"][i])
        ),
        postures=HandPostures(*(own(f"posture_{name}") for name in HandPostures._fields)),
        tiles=tiles,
        finger_of=finger_of,
        nail_rows=(),
        stops=tuple(
            (int(finger), int(joint), torque)
            for (h, finger, joint), torque in zip(
                arrays["stop_of"].reshape(-1, 3), arrays["stop_torque"].reshape(-1, 2), strict=True
            )
            if h == i
        ),
        palm=SettledPalm(
            own("palm_gaps"),
            tuple(engaged.tolist()),
            tuple(shares[engaged].tolist()),
            own("palm_centre"),
            *arrays["palm_limits"][i].tolist(),
        ),
        **{name: own(name) for name in HAND_ARRAYS},
    )
    return ClosedPlacement(
        Placement(
            rock,
            surface,
            grasp,
            pose if given == "hold_in_hand" else None,
            pose if given == "at" else None,
        ),
        settled,
    )
