"""Header of a table in progress; it identifies the run, and only that run may resume the table."""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from hand_models.base import InvalidInputError, installed_version
from hand_models.parameters import ParameterTable
from planner import RobotFile
from service.bulk.columns import Column

__all__ = ["Header", "digest_of", "new_header"]


class Header(msgspec.Struct):
    """First line of a table in progress: everything that determines the rows of the run.

    Attributes
    ----------
    crux : str or None
        Version of crux that began the table.
    columns : list of str
        Names of the table's columns.
    explain : bool
        Whether infeasible stances are explained.
    hand : str or None
        Digest of hand parameters; None for the bundled hand.
    robot : str or None
        Digest of the robot file; None for the bundled robots.
    v : int
        Version of this format.
    about : dict of str to str
        Other inputs of the run, by name; a stance as its `digest_of`.
    """

    crux: str | None
    columns: list[str]
    explain: bool
    hand: str | None = None
    robot: str | None = None
    v: int = 2
    about: dict[str, str] = {}

    def check(self, before: bytes, path: Path) -> None:
        """Check that a table in progress belongs to the same run as this header.

        Parameters
        ----------
        before : bytes
            First line of the table.
        path : Path
            File of the table, for the error message.

        Raises
        ------
        InvalidInputError
            If the line is no header, or differs from this one; the message names the changed input.
        """
        try:
            there = msgspec.json.decode(before, type=Header)
        except (msgspec.DecodeError, UnicodeDecodeError):
            raise InvalidInputError(
                f"{path}: not a table of crux batch or crux sweep; give another output",
                field="--resume",
            ) from None
        known, wanted = there._compared(), self._compared()
        for name in dict.fromkeys([*known, *wanted]):
            values = known.get(name), wanted.get(name)
            if values[0] != values[1]:
                # of a few inputs, there is only a digest
                digest = name in {"hand", "robot", "stance"}
                which = "" if digest else f" ({values[0]!r}, now {values[1]!r})"
                raise InvalidInputError(
                    f"{path}: was started with another {name}{which}; give that again, or "
                    "start again without --resume",
                    field="--resume",
                )

    def _compared(self) -> dict[str, Any]:
        """Return what it says by name, in the order in which that is compared."""
        named = {name: getattr(self, name) for name in ("v", "crux", "hand", "robot", "explain")}
        return named | self.about | {"columns": self.columns}


def new_header(
    columns: Iterable[Column],
    explain: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    about: dict[str, str] | None = None,
) -> Header:
    """Return the header of a table that is begun or resumed.

    Parameters
    ----------
    columns : iterable of Column
        Columns of the table.
    explain : bool
        Whether infeasible stances are explained.
    hand : ParameterTable or None
        Hand parameters that differ from the bundled hand.
    robot : RobotFile or None
        The only robot that is planned for; None for the bundled robots.
    about : dict of str to str, optional
        Other inputs that the rows depend on, by name.

    Returns
    -------
    Header
        Header with this version of crux, and with digests of hand and robot.
    """
    own_robot = None if robot is None else digest_of((robot.toml, robot.urdf))
    own_hand = None if hand is None else digest_of(sorted(hand.sections.items()))
    names = [each.name for each in columns]
    return Header(installed_version(), names, explain, own_hand, own_robot, about=about or {})


def digest_of(value: Any) -> str:
    """Return a SHA-256 digest of a plain value, as hexadecimal text."""
    return sha256(repr(value).encode()).hexdigest()
