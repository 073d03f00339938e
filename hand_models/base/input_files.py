"""Files that are read: plain ones, which end."""

from __future__ import annotations

from pathlib import Path

from hand_models.base.errors import InvalidInputError

__all__ = ["check_file"]


def check_file(path: Path) -> None:
    """Refuse what is not there, and what may never end: a folder, a pipe, a socket or a device.

    Raises
    ------
    InvalidInputError
        The field is ``file``.
    """
    try:
        if path.is_file():
            return
        path.stat()
    except OSError as error:
        what = "no such file" if isinstance(error, FileNotFoundError) else error.strerror
        raise InvalidInputError(f"{what}: {path}", field="file") from None
    kind = "a folder" if path.is_dir() else "a pipe or a device; write what comes from it to a file"
    raise InvalidInputError(f"{path} is {kind}", field="file")
