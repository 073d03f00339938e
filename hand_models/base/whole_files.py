"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["whole_file"]


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield where to write what is to be a file, which it becomes at the end.

    What is not a plain file, such as a device, is written itself.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        That names the path, whatever did not work; nothing is left of what was written then.
    """
    if path.exists() and not path.is_file():
        part = target = path
    else:
        target = path.resolve()
        # with the ending, which tells what kind of picture it is to be
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
