"""Parse a robot's file: the URDF that it names, the mounts of the hands, and the torque limits.

TOML, like ``parameters/robosimian.toml``: ``name``, ``urdf`` (a path, from the file's folder) and
``body`` (a link), then numbers with unit and source. ``[limbs.NAME]`` names the ``link`` that
carries a limb's hand; ``[every_limb]`` has defaults for all limbs; ``[locked]`` has joints that do
not move, with their positions. A bare number, or list of numbers, is in the SI unit of its entry
and counts as `assumed`.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from textwrap import shorten
from typing import Any

from hand_models.base import (
    ORIENTATION_FIELDS,
    InvalidInputError,
    Pose,
    errors_under,
    in_file,
    oriented_pose,
)
from hand_models.parameters import LONGEST_QUOTE, ParameterTable
from planner.robots.tolerances import TOLERANCES

__all__ = ["Mount", "RobotDescription", "RobotFile", "section_table"]


@dataclass(frozen=True)
class RobotFile:
    """The texts of a robot's file and of its URDF; can be compared, hashed and sent.

    Attributes
    ----------
    name : str
        Name of the robot.
    toml, urdf : str
        Texts of the robot's file and of its URDF.
    origin : str
        Name of the file in error messages.
    folder : Path, optional
        Folder of the URDF, if that names meshes.
    """

    name: str
    toml: str
    urdf: str
    origin: str = field(default="robot", compare=False)
    folder: Path = Path()

    @classmethod
    def load(cls, path: Path) -> RobotFile:
        """Read a robot's file, and the URDF that it names, from disk.

        Raises
        ------
        InvalidInputError
            If the URDF cannot be read, or an entry of the file is unknown, missing or impossible.
        """
        with in_file(str(path)):
            toml = path.read_text(encoding="utf-8")
            described = RobotDescription.read(toml)
            file = path.parent / described.urdf
            urdf = _urdf(file)
        folder = file.parent.resolve() if "<mesh" in urdf else Path()
        return cls(described.name, toml, urdf, str(path), folder)

    @classmethod
    @cache
    def bundled(cls) -> RobotFile:
        """Return the bundled file of RoboSimian; cached."""
        with resources.as_file(resources.files("planner.parameters")) as folder:
            return cls.load(folder / "robosimian.toml")

    @property
    def limbs(self) -> tuple[str, ...]:
        """Names of the robot's limbs, in the order of the file."""
        return tuple(RobotDescription.read(self.toml).mounts)


@dataclass(frozen=True, eq=False)
class Mount:
    """Mount of a hand on a link, with the torque limits of its limb.

    Attributes
    ----------
    link : str
        Name of the link that carries the hand.
    pose : Pose
        Pose of the hand frame H in the link's frame.
    hand_com : tuple of float
        Centre of mass of the hand in H [m].
    torque_limits : tuple of float or None
        Largest torques: one number for all joints of the limb, or one for each [N·m], [N] for a
        joint that slides; zero for a joint without a motor. None: the efforts of the URDF.
    radius : float, optional
        Radius of the limb's links for which the file has no capsules [m].
    """

    link: str
    pose: Pose
    hand_com: tuple[float, ...]
    torque_limits: tuple[float, ...] | None
    radius: float | None = None


@dataclass(frozen=True, eq=False)
class RobotDescription:
    """Parsed content of a robot's file.

    Attributes
    ----------
    name : str
        Name of the robot.
    urdf : str
        Path of the URDF, from the file's folder.
    body : str
        Name of the link whose frame is B.
    com : tuple of float, optional
        Centre of mass in B that is used while no joint angles are given [m].
    mounts : mapping of str to Mount
        Mounts of the hands, by limb.
    locked : mapping of str to object
        Positions of the joints that do not move, by joint name, unparsed: whether a position is in
        [rad] or [m] is known from the URDF only.
    capsules : mapping of str to tuple
        Capsules of links, by a pattern of link names. A capsule has seven numbers [m]: both ends of
        its segment in the link's frame, and its radius.
    back : tuple of float, optional
        Unit vector out of the robot's back, in B.
    """

    name: str
    urdf: str
    body: str
    com: tuple[float, ...] | None
    mounts: Mapping[str, Mount]
    locked: Mapping[str, Any] = field(default_factory=dict)
    capsules: Mapping[str, tuple[tuple[float, ...], ...]] = field(default_factory=dict)
    back: tuple[float, ...] | None = None

    @classmethod
    def read(cls, toml: str) -> RobotDescription:
        """Parse the text of a robot's file.

        Raises
        ------
        InvalidInputError
            If an entry is unknown, missing or impossible; the error's field is the entry.
        """
        try:
            raw = tomllib.loads(toml)
        except tomllib.TOMLDecodeError as error:
            raise InvalidInputError(f"is not valid TOML: {error}; correct the file there") from None
        texts = ("name", "urdf", "body")  # entries that are plain text
        called, urdf, body = (_string(raw.get(name), name) for name in texts)
        _named(called, "name")
        for name in raw:
            known = (*texts, "robot", "locked", "every_limb", "limbs", "capsules")
            if name not in known:
                raise InvalidInputError(f"unknown; known are {', '.join(known)}", field=name)
        whole = section_table(raw.get("robot", {}), "robot", {"com": "m", "back": "1"})
        locked = _mapping(raw.get("locked", {}), "locked")
        every = _mapping(raw.get("every_limb", {}), "every_limb")
        # entries of a limb, by name, with their units
        limb_units = {
            "position": "m",
            "orientation": "1",
            "rpy": "rad",
            "x_axis": "1",
            "z_axis": "1",
            "hand_com": "m",
            "torque_limit": "N·m",
            "radius": "m",
        }
        section_table(every, "every_limb", limb_units)
        limbs = _mapping(raw.get("limbs", {}), "limbs")
        most = 16  # no program was tried with more
        if not 1 <= len(limbs) <= most:
            raise InvalidInputError(
                f"from 1 to {most} limbs are needed, as [limbs.NAME], got {len(limbs)}",
                field="limbs",
            )
        mounts: dict[str, Mount] = {}
        for limb, entries in limbs.items():
            section = f"limbs.{limb}"
            _named(limb, "limbs")
            entries = dict(_mapping(entries, section))
            link = _string(entries.pop("link", None), f"{section}.link")
            # a limb's own form of orientation replaces that of every limb
            turned = any(name in entries for name in ORIENTATION_FIELDS)
            kept = [name for name in every if not (turned and name in ORIENTATION_FIELDS)]
            both = {**{name: every[name] for name in kept}, **entries}
            mounts[limb] = _mount(link, section_table(both, section, limb_units), section)
        com = _triple(whole, "robot", "com") if "com" in whole.sections["robot"] else None
        capsules = _capsules(raw.get("capsules", {}))
        back = _direction(whole, "robot", "back")
        return cls(called, urdf, body, com, mounts, locked, capsules, back)


def _urdf(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        reason = f"{path}: {error.strerror or error}"
        raise InvalidInputError(reason, field="urdf") from None
    except ValueError:
        raise InvalidInputError(
            f"{path}: must be a URDF in UTF-8; save it so", field="urdf"
        ) from None


def _string(value: Any, field: str) -> str:
    if not isinstance(value, str) or not value:
        got = "nothing" if value is None else shorten(repr(value), LONGEST_QUOTE, placeholder=" …")
        raise InvalidInputError(f"must be text, got {got}", field=field)
    return value


def _named(name: str, field: str) -> None:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,63}", name):  # names are part of keys
        raise InvalidInputError(
            "a name must begin with a letter and go on with at most 63 letters, digits, _ or -, "
            f"got {shorten(repr(name), LONGEST_QUOTE, placeholder=' …')}",
            field=field,
        )


def _mapping(value: Any, field: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        got = type(value).__name__
        raise InvalidInputError(
            f"a section of entries is needed, got {got}; write them under [{field}]", field=field
        )
    return value


def section_table(entries: Any, section: str, units: Mapping[str, str]) -> ParameterTable:
    """Return the quantities of a section of a robot's file.

    Parameters
    ----------
    entries : mapping of str to object
        Parsed TOML: quantities, or bare numbers and lists of numbers, which are in the entry's unit
        and count as `assumed`.
    section : str
        Name of the section, for error messages.
    units : mapping of str to str
        Units of all valid entries, by name.

    Raises
    ------
    InvalidInputError
        If an entry is unknown, not a quantity, or in another unit.
    """
    entries = _mapping(entries, section)
    for name in entries:
        if name not in units:
            link = "link, " if section.startswith("limbs.") else ""
            known = shorten(f"{link}{', '.join(units)}", LONGEST_QUOTE, placeholder=" …")
            raise InvalidInputError(f"unknown entry; known are {known}", field=f"{section}.{name}")
    table = ParameterTable.of({section: entries}, {section: units})
    for _, name, quantity in table:
        if quantity.unit != units[name]:
            unit = shorten(quantity.unit, LONGEST_QUOTE, placeholder=" …")
            raise InvalidInputError(
                f"must be in {units[name]!r}, got {unit!r}", field=f"{section}.{name}.unit"
            )
    return table


def _triple(table: ParameterTable, section: str, name: str) -> tuple[float, ...]:
    """Return a place, three coordinates of a possible size."""
    values = table.vector(section, name)
    if len(values) != 3 or not all(abs(value) <= TOLERANCES.mount_distance for value in values):
        raise InvalidInputError(
            f"must be 3 numbers within ±{TOLERANCES.mount_distance:g} m, got {_quoted(values)}",
            field=f"{section}.{name}",
        )
    return values


def _capsules(entries: Any) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Return the capsules of links, by a pattern of their names."""
    names = _mapping(entries, "capsules")
    table = section_table(names, "capsules", dict.fromkeys(names, "m"))
    found = {}
    size = 7  # numbers: both ends of its segment, and its radius
    for _, name, _ in table:
        values = table.vector("capsules", name)
        rows = tuple(values[i : i + size] for i in range(0, len(values), size))
        sound = [
            len(row) == size
            and all(abs(value) <= TOLERANCES.mount_distance for value in row)
            and 0.0 < row[-1] <= TOLERANCES.link_radius
            for row in rows
        ]
        if not (rows and all(sound)):
            raise InvalidInputError(
                f"must be {size} numbers a capsule, the ends of its segment within "
                f"±{TOLERANCES.mount_distance:g} m and a radius up to "
                f"{TOLERANCES.link_radius:g} m, got {_quoted(values)}",
                field=f"capsules.{name}",
            )
        found[name] = rows
    return found


def _direction(table: ParameterTable, section: str, name: str) -> tuple[float, ...] | None:
    """Return a direction of unit length; None where there is none."""
    if name not in table.sections[section]:
        return None
    values = _triple(table, section, name)
    length = math.hypot(*values)
    if not length > 0.0:
        raise InvalidInputError("must be a direction, not zero", field=f"{section}.{name}")
    return tuple(value / length for value in values)


def _mount(link: str, table: ParameterTable, section: str) -> Mount:
    position = _triple(table, section, "position")
    turned = [name for name in ORIENTATION_FIELDS if name in table.sections[section]]
    orientation = {name: table.vector(section, name) for name in turned}
    with errors_under(section):
        pose = oriented_pose(position, **orientation)
    given = "hand_com" in table.sections[section]
    hand_com = _triple(table, section, "hand_com") if given else (0.0, 0.0, 0.0)
    limits = _torque_limits(table, section)
    radius = table.positive(section, "radius") if "radius" in table.sections[section] else None
    if radius is not None and radius > TOLERANCES.link_radius:
        raise InvalidInputError(
            f"must be at most {TOLERANCES.link_radius:g} m, got {radius:g} m",
            field=f"{section}.radius",
        )
    return Mount(link, pose, hand_com, limits, radius)


def _torque_limits(table: ParameterTable, section: str) -> tuple[float, ...] | None:
    """Return what the joints of a limb bear; None where that is left to the URDF."""
    if "torque_limit" not in table.sections[section]:
        return None
    value = table.quantity(section, "torque_limit").value
    limits = tuple(map(float, value)) if isinstance(value, list) else (float(value),)
    weakest = 1e-3  # [N·m]: less is no rating
    sound = [limit == 0.0 or weakest <= limit <= TOLERANCES.joint_torque for limit in limits]
    if not any(limits) or not all(sound):
        raise InvalidInputError(
            f"must be {weakest:g} to {TOLERANCES.joint_torque:g} N·m, or in a list 0 for a joint "
            f"without a motor (not for all joints of a limb), got {_quoted(limits)}; leave it out "
            "to use the efforts of the URDF",
            field=f"{section}.torque_limit",
        )
    return limits


def _quoted(values: tuple[float, ...]) -> str:
    return shorten(", ".join(f"{value:g}" for value in values), LONGEST_QUOTE, placeholder=" …")
