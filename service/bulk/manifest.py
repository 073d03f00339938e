"""What is beside a table while it grows: of what it is, and which parts of it are whole."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import Any, Final

import msgspec

from hand_models.base import InvalidInputError, installed_version, whole_file
from hand_models.parameters import ParameterTable
from planner import RobotFile
from service.bulk.lines import LineDigest

__all__ = ["RESUME", "Manifest", "Part", "digest_of", "new_manifest"]

RESUME: Final = "--resume"

DIGESTS: Final = ("hand", "robot", "stance")
"""Names of what a manifest has a digest of."""


class Part(msgspec.Struct):
    """A whole part of a table: its file, its rows, and the file's bytes when it was whole."""

    file: str
    rows: int
    bytes: int


class Manifest(msgspec.Struct):
    """Of what a table is, and what of it is whole.

    ``sha256``: over the SHA-256 digests of the request lines that the parts answer, in order.
    ``statuses``, ``errors``: how many of their plans have which status, and how many errors are of
    which kind. ``hand``, ``robot``: digests of their numbers, null for the bundled ones. ``about``:
    what else the work is of, by name; of `DIGESTS` a `digest_of` it.
    """

    crux: str | None
    columns: list[str]
    explain: bool
    hand: str | None = None
    robot: str | None = None
    v: int = 1
    sha256: str = LineDigest().hex()
    complete: bool = False
    parts: list[Part] = []
    statuses: dict[str, int] = {}
    errors: dict[str, int] = {}
    about: dict[str, str] = {}

    @property
    def rows(self) -> int:
        """Rows that are whole."""
        return sum(part.rows for part in self.parts)

    @classmethod
    def read(cls, path: Path) -> Manifest | None:
        """Return what a file says; None if there is none, or it is no manifest."""
        with suppress(OSError, msgspec.DecodeError):
            return msgspec.json.decode(path.read_bytes(), type=cls)
        return None

    def write(self, path: Path) -> None:
        """Write it as a whole or not at all."""
        with whole_file(path) as part:
            part.write_bytes(msgspec.json.format(msgspec.json.encode(self)) + b"\n")

    def check(self, now: Manifest, lines: Iterable[bytes], path: Path) -> LineDigest:
        """Return the digest of the lines that are answered, if the table is of this very work.

        Raises
        ------
        InvalidInputError
            That says what has changed.
        """
        before, wanted = self._of(), now._of()
        for name in dict.fromkeys([*before, *wanted]):
            values = before.get(name), wanted.get(name)
            if values[0] != values[1]:
                told = "" if name in DIGESTS else f" ({values[0]!r}, now {values[1]!r})"
                raise InvalidInputError(
                    f"{path}: was begun with another {name}{told}; begin anew without it",
                    field=RESUME,
                )
        found, count = LineDigest(), 0
        for line in islice(lines, self.rows):
            found.add(line)
            count += 1
        if count < self.rows or found.hex() != self.sha256:
            raise InvalidInputError(
                f"{path}: its {self.rows} rows answer other requests than those given now; "
                "is it of another batch?",
                field=RESUME,
            )
        return found

    def _of(self) -> dict[str, Any]:
        """Return of what it is, by name, in the order in which that is compared."""
        named = {name: getattr(self, name) for name in ("v", "crux", "hand", "robot", "explain")}
        return named | self.about | {"columns": self.columns}


def new_manifest(
    columns: Iterable[str],
    explain: bool,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    about: dict[str, str] | None = None,
) -> Manifest:
    """Return the manifest of a table that has no rows yet."""
    own_robot = None if robot is None else digest_of((robot.toml, robot.urdf))
    own_hand = None if hand is None else digest_of(sorted(hand.sections.items()))
    return Manifest(
        installed_version(), list(columns), explain, own_hand, own_robot, about=about or {}
    )


def digest_of(value: Any) -> str:
    """Return a digest of plain values."""
    return sha256(repr(value).encode()).hexdigest()
