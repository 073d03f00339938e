"""Walls as files of plain arrays: a search can be repeated without making the tables anew."""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

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
from hand_models.fixed_wrist import check_made_with, input_digests
from hand_models.hand import Grasp
from hand_models.rock import Mesh
from hand_models.tile import Surface
from planner.question import HandOnHold
from planner.reach import ReachTable
from planner.robots import Robot
from planner.screening import ScreeningTable, WorldHands
from planner.search import Wall

__all__ = ["read_wall", "robot_digest", "wall_digest", "write_wall"]

FILE_FORMAT: Final = "crux wall 1"
"""First array of a file of a wall."""


def write_wall(wall: Wall, path: Path, about: str = "") -> str:
    """Write a wall to a file of arrays (NumPy's ``.npz``), and return its digest.

    Parameters
    ----------
    wall : Wall
        All placements on one `Mesh` of one surface, with fixed wrists.
    path : Path
    about : str, optional
        What the wall is of, in words, such as the name of the rock's file.

    Returns
    -------
    str
        `wall_digest` of the wall.

    Raises
    ------
    UnsupportedError
        If the placements are on several rocks or surfaces, or not on a mesh, or a wrist is not
        fixed, or a hand is still to be seated.
    """
    arrays = _arrays(wall)
    digest = _digest(arrays)
    texts = {"format": FILE_FORMAT, "about": about, "digest": digest}
    with whole_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **{**_texts(texts), **arrays})
    return digest


def read_wall(path: Path, robot: Robot, rock: Mesh, surface: Surface) -> Wall:
    """Read a wall from a file.

    Parameters
    ----------
    path : Path
        Written by `write_wall`.
    robot : Robot
    rock : Mesh
    surface : Surface
        These three must be as they were when the wall was made.

    Raises
    ------
    InvalidInputError
        If `write_wall` has not written the file, it is damaged, or robot, rock or surface differ;
        the field is ``file``.
    """
    with reading_file(path), np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
        texts = {name: str(arrays.pop(name, "")) for name in ("format", "about", "digest")}
        if texts["format"] != FILE_FORMAT:
            raise InvalidInputError(f"is not a file of a wall: {path}", field="file")
        now, again = _inputs(robot, rock, surface), f"make the wall again: {path}"
        check_made_with(now, arrays["made_with"].tolist(), again)
        if _digest(arrays) != texts["digest"]:
            raise InvalidInputError(f"is damaged: {again}", field="file")
        return _wall(arrays, robot, rock, surface)


def wall_digest(wall: Wall) -> str:
    """Return a SHA-256 digest of all arrays of a wall, and of what it was made with.

    Raises
    ------
    UnsupportedError
        As `write_wall` does.
    """
    return _digest(_arrays(wall))


def _arrays(wall: Wall) -> dict[str, Array]:
    """Return all that a wall consists of as arrays, by name."""
    first = wall.places[0]
    same = all(
        each.hold is first.hold
        and each.surface == first.surface
        and each.wrist == "fixed"
        and each.hold_in_hand is not None
        for each in wall.places
    )
    if not (same and isinstance(first.hold, Mesh)):
        raise UnsupportedError(
            "only walls with all placements on one mesh of one surface, with fixed wrists and the "
            "rock's pose in H, can be written to a file",
            field="places",
        )
    reach, screening, hands = wall.reach, wall.screening, wall.screening.hands
    arrays: dict[str, Any] = {
        "made_with": list(_inputs(wall.robot, first.hold, first.surface).values()),
        "place_limb": [each.limb for each in wall.places],
        "place_grasp": [msgspec.json.encode(each.grasp).decode() for each in wall.places],
        "place_pose": [_matrix(each.pose) for each in wall.places],
        "place_rock": [_matrix(each.hold_in_hand) for each in wall.places],
        "body_pose": [_matrix(each) for each in wall.bodies],
        "shifts": wall.shifts,
        "apart": wall.apart,
        **{f"reach_{name}": value for name, value in vars(reach).items()},
        **{f"hands_{name}": getattr(hands, name) for name in WorldHands.__dataclass_fields__},
        **{
            f"screening_{name}": getattr(screening, name)
            for name in ScreeningTable.__dataclass_fields__
            if name != "hands"
        },
    }
    return {name: np.asarray(value) for name, value in arrays.items()}


def _wall(arrays: Mapping[str, Any], robot: Robot, rock: Mesh, surface: Surface) -> Wall:
    """Return the wall of a file."""

    def part(name: str) -> dict[str, Any]:
        return {
            key.removeprefix(f"{name}_"): value
            for key, value in arrays.items()
            if key.startswith(f"{name}_")
        }

    places = tuple(
        HandOnHold(
            limb=str(limb),
            pose=_pose(pose),
            hold=rock,
            surface=surface,
            hold_in_hand=_pose(at),
            grasp=msgspec.json.decode(str(grasp), type=Grasp),
        )
        for limb, grasp, pose, at in zip(
            *(arrays[f"place_{name}"] for name in ("limb", "grasp", "pose", "rock")), strict=True
        )
    )
    return Wall(
        robot=robot,
        places=places,
        bodies=tuple(map(_pose, arrays["body_pose"])),
        shifts=arrays["shifts"],
        reach=ReachTable(**part("reach")),
        screening=ScreeningTable(hands=WorldHands(**part("hands")), **part("screening")),
        apart=arrays["apart"],
    )


def _inputs(robot: Robot, rock: Mesh, surface: Surface) -> dict[str, str]:
    """Return digests of what a wall is made with, by name."""
    rest = input_digests(rock, surface, robot.hand.table.sections)
    return {"robot": robot_digest(robot), **rest}


def robot_digest(robot: Robot) -> str:
    """Return a SHA-256 digest of a robot's file and of its URDF, without the hand."""
    with np.printoptions(floatmode="unique"):
        own = f"{robot.description}{robot.urdf}"
    return sha256(own.encode()).hexdigest()


def _digest(arrays: Mapping[str, Array]) -> str:
    """Return a digest of arrays, with their names, types and shapes."""
    found = sha256()
    for name, value in sorted(arrays.items()):
        found.update(f"{name} {value.dtype.str} {value.shape}\n".encode())
        found.update(np.ascontiguousarray(value).tobytes())
    return found.hexdigest()


def _texts(texts: Mapping[str, str]) -> dict[str, Array]:
    return {name: np.asarray(text) for name, text in texts.items()}


def _matrix(pose: Pose | None) -> Array:
    """Return rotation and position as three rows of four numbers."""
    assert pose is not None
    return np.column_stack([pose.rotation, pose.position])


def _pose(matrix: Array) -> Pose:
    return Pose(np.ascontiguousarray(matrix[:, 3]), np.ascontiguousarray(matrix[:, :3]))
