"""Read plain files with errors that name the file, and write files atomically."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hand_models.base.errors import CruxError, InvalidInputError

__all__ = ["reading_file", "whole_file"]


@contextmanager
def reading_file(path: Path) -> Iterator[None]:
    """Context manager that turns any error of a file reader into one that names the file.

    Parameters
    ----------
    path : Path
        Must be a plain file: a folder, pipe, socket or device is refused before reading.

    Raises
    ------
    InvalidInputError
        In place of every error of the reader that is not a `CruxError`. The field is ``file``
        unless the reader named another.
    """
    _check_plain(path)
    try:
        yield
    except CruxError as error:
        error.field = error.field or "file"
        raise
    except UnicodeDecodeError:
        raise InvalidInputError(
            f"not a text in UTF-8: {path}; save it as UTF-8", field="file"
        ) from None
    except OSError as error:
        raise InvalidInputError(f"{error.strerror or error}: {path}", field="file") from None
    except Exception as error:
        # every reader fails in its own way on what is none of its files
        said = " ".join(str(error).split())
        reader = f"{type(error).__name__}: {said}" if said else type(error).__name__
        raise InvalidInputError(
            f"cannot read {path}: it may be broken, cut short, or no {path.suffix} file; export "
            f"it again (its reader said {reader})",
            field="file",
        ) from None


def _check_plain(path: Path) -> None:
    """Refuse what is not there, and what may never end: a folder, a pipe, a socket or a device."""
    try:
        if path.is_file():
            return
        path.stat()
    except OSError as error:
        what = "no such file" if isinstance(error, FileNotFoundError) else error.strerror
        raise InvalidInputError(f"{what}: {path}", field="file") from None
    kind = (
        "a folder; give a file"
        if path.is_dir()
        else "a pipe or a device; write what comes from it to a file"
    )
    raise InvalidInputError(f"{path} is {kind}", field="file")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Context manager for an atomic write: yields a temporary path, renamed to ``path`` on success.

    On an error the temporary file is deleted and ``path`` stays as it was. A ``path`` that exists
    and is not a plain file, such as a device, is yielded itself.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        If writing or renaming fails; the error names ``path``.
    """
    if path.exists() and not path.is_file():
        part = target = path
    else:
        target = path.resolve()
        # with the ending, which determines the picture's format
        part = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        try:
            yield part
            if part != target:
                part.replace(target)
        except BaseException:
            if part != target:
                with suppress(OSError):
                    part.unlink()
            raise
    except OSError as error:
        raise OSError(error.errno or errno.EIO, error.strerror or str(error), str(path)) from None
