"""Header of a table's rows: the work that they belong to, so that no other work resumes them."""

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
    """First line of a table: the work that its rows belong to.

    ``hand``, ``robot``: digests of their numbers, null for the bundled ones. ``about``: other
    inputs of the work, by name; of a stance a `digest_of`.
    """

    crux: str | None
    columns: list[str]
    explain: bool
    hand: str | None = None
    robot: str | None = None
    v: int = 2
    about: dict[str, str] = {}

    def check(self, before: bytes, path: Path) -> None:
        """Refuse a line that is the header of other work, and say what has changed."""
        try:
            there = msgspec.json.decode(before, type=Header)
        except (msgspec.DecodeError, UnicodeDecodeError):
            raise InvalidInputError(
                f"{path}: not a table of crux batch or crux sweep", field="--resume"
            ) from None
        known, wanted = there._compared(), self._compared()
        for name in dict.fromkeys([*known, *wanted]):
            values = known.get(name), wanted.get(name)
            if values[0] != values[1]:
                # of a few inputs, there is only a digest
                digest = name in {"hand", "robot", "stance"}
                which = "" if digest else f" ({values[0]!r}, now {values[1]!r})"
                raise InvalidInputError(
                    f"{path}: was started with another {name}{which}; start again without --resume",
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
    """Return the header of a table that is to be begun, or gone on with."""
    own_robot = None if robot is None else digest_of((robot.toml, robot.urdf))
    own_hand = None if hand is None else digest_of(sorted(hand.sections.items()))
    names = [each.name for each in columns]
    return Header(installed_version(), names, explain, own_hand, own_robot, about=about or {})


def digest_of(value: Any) -> str:
    """Return a digest of plain values."""
    return sha256(repr(value).encode()).hexdigest()
