"""Keep files of others in the folder of a climb, and let all files of an earlier climb go together.

A folder has a record of the files that its climb has written. What is not in the record, or is not
as it was written, is never replaced or removed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

import msgspec

from hand_models.base import InvalidInputError, installed_version, whole_file
from service.climbs.files import SEARCH_FILES

__all__ = ["ClimbFolder"]

RECORD_NAME = "crux-climb.json"
SEARCH_NAMES = tuple(SEARCH_FILES.values())
ROUTE_NAMES = (
    "stages.csv",
    "margin.png",
    "summary.json",
    "climb.png",
    "support.png",
    "trajectory.jsonl",
    "trajectory.parquet",
)
STAGES_NAME = "stages"


class _Record(msgspec.Struct):
    """Files that a climb has written, by name.

    Each has its digest (SHA-256), or None if any content is of the climb: of what ``crux route``
    writes again, and of all while they are being written.
    """

    crux: str | None
    files: dict[str, str | None]


class ClimbFolder:
    """Folder that a climb is written into.

    Parameters
    ----------
    folder : Path
        Existing folder.
    inputs : mapping of str to str
        What the climb is made from, by option: names of files, or of what is bundled.

    Raises
    ------
    InvalidInputError
        If writing a climb would replace or remove an input, or a file that is not of an earlier
        climb.
    """

    def __init__(self, folder: Path, inputs: Mapping[str, str]) -> None:
        self._folder, self._kept = folder, _read(folder)
        there = [*self._existing()]
        for option, name in inputs.items():
            if Path(name).is_file() and any(os.path.samefile(name, folder / own) for own in there):
                raise InvalidInputError(
                    f"{name} ({option}) is a file of {folder} that the climb would replace or "
                    "remove; name another folder",
                    field="-o",
                )
        strange = [name for name in there if not self._is_own(name)]
        if strange:
            more = f" and {len(strange) - 3} more" if len(strange) > 3 else ""
            raise InvalidInputError(
                f"{folder} has {', '.join(strange[:3])}{more}, which the climb would replace or "
                "remove, and which no earlier climb has left there so; move what you need, remove "
                "the rest, or name another folder",
                field="-o",
            )

    @contextmanager
    def filling(self) -> Iterator[None]:
        """Remove the files of an earlier climb, and record those that are written, as a context.

        Raises
        ------
        OSError
            If a file cannot be removed or written.
        """
        for name in [*self._existing()]:
            if name != RECORD_NAME and self._is_own(name):
                (self._folder / name).unlink(missing_ok=True)
        with suppress(OSError):
            # other files may be there
            (self._folder / STAGES_NAME).rmdir()
        begun = dict.fromkeys((*SEARCH_NAMES, *ROUTE_NAMES, f"{STAGES_NAME}/"))
        self._write(begun)
        yield
        names = [name for name in self._existing() if name != RECORD_NAME]
        self._write({name: self._digest(name) if name in SEARCH_NAMES else None for name in names})

    def _existing(self) -> Iterator[str]:
        """Yield those names that a climb may write, and under which there is something."""
        for name in (RECORD_NAME, *SEARCH_NAMES, *ROUTE_NAMES):
            if os.path.lexists(self._folder / name):
                yield name
        stages = self._folder / STAGES_NAME
        if os.path.lexists(stages) and not stages.is_dir():
            yield STAGES_NAME
        for path in sorted(stages.glob("*.json")):
            # as those that are removed where stages are written
            if path.name.partition("-")[0].isdecimal():
                yield f"{STAGES_NAME}/{path.name}"

    def _is_own(self, name: str) -> bool:
        """Return whether what has a name is as an earlier climb has left it."""
        if name == RECORD_NAME:
            return bool(self._kept)
        if f"{STAGES_NAME}/" in self._kept and name.startswith(f"{STAGES_NAME}/"):
            return True
        if name not in self._kept or not (self._folder / name).is_file():
            return False
        return self._kept[name] in (None, self._digest(name))

    def _digest(self, name: str) -> str:
        return sha256((self._folder / name).read_bytes()).hexdigest()

    def _write(self, files: dict[str, str | None]) -> None:
        with whole_file(self._folder / RECORD_NAME) as part:
            record = _Record(installed_version(), files)
            part.write_bytes(msgspec.json.format(msgspec.json.encode(record)) + b"\n")
        self._kept = files


def _read(folder: Path) -> dict[str, str | None]:
    """Return the files of the record in a folder; none if there is no such record."""
    try:
        text = (folder / RECORD_NAME).read_bytes()
        return msgspec.json.decode(text, type=_Record).files
    except (OSError, msgspec.DecodeError, UnicodeDecodeError):
        return {}
