"""Lock the output of a command, so that two runs cannot write to the same file or folder."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from hand_models.base import InvalidInputError
from service.tables.terminal import filling_folder, remark, writing

__all__ = ["fill_alone", "write_alone"]


def write_alone(file: Path, output: Path | None = None, option: str = "-o") -> None:
    """Lock an output file against other processes until the running click command ends.

    The lock is a file ``.NAME.lock`` beside the output. Devices and pipes are not locked. On a file
    system without locks, a remark is printed instead.

    Parameters
    ----------
    file : Path
        File that the command writes.
    output : Path, optional
        Name of the output in error messages; by default ``file``.
    option : str, optional
        Option of the command that names the output.

    Raises
    ------
    InvalidInputError
        If another process has the lock, or the lock file cannot be written.
    """
    click.get_current_context().with_resource(_alone_at(file, output or file, option))


def fill_alone(folder: Path, option: str = "-o") -> None:
    """Make an output folder, and lock it against other processes until the running command ends.

    The lock is the file ``.crux.lock`` in the folder, whatever command fills it.

    Parameters
    ----------
    folder : Path
        Folder that the command fills.
    option : str, optional
        Option of the command that names the folder.

    Raises
    ------
    InvalidInputError
        If another process has the lock, or the folder or the lock file cannot be written.
    """
    with filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
    write_alone(folder / "crux", folder, option)


@contextmanager
def _alone_at(file: Path, output: Path, option: str) -> Iterator[None]:
    target = file.resolve()
    if target.exists() and not (target.is_file() or target.is_dir()):
        # a pipe or a device
        yield
        return
    path = target.with_name(f".{target.name}.lock")
    with writing(output, option):
        lock = _locked(path, output, option)
    try:
        yield
    finally:
        if lock is not None:
            with suppress(OSError):
                path.unlink()
            os.close(lock)


def _locked(path: Path, output: Path, option: str) -> int | None:
    """Lock a file and return its descriptor; None if the file system has no locks."""
    try:
        import fcntl
    except ImportError:
        remark(f"this system has no locks: no other run may write {output} now")
        return None
    while True:
        lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.lockf(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(lock)
            if error.errno in {errno.EACCES, errno.EAGAIN}:
                raise _held(path, output, option) from None
            # these say that the file system has no locks
            if error.errno not in {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}:
                raise
            remark(f"{path}: the file system has no locks; no other run may write {output} now")
            return None
        # the previous owner may have removed the file since it was opened
        if path.exists() and os.path.samestat(os.fstat(lock), path.stat()):
            os.ftruncate(lock, 0)
            os.write(lock, f"{os.getpid()}\n".encode())
            return lock
        os.close(lock)


def _held(path: Path, output: Path, option: str) -> InvalidInputError:
    """Return the error about an output that another process writes."""
    who = ""
    with suppress(OSError, ValueError):
        who = f" (process {int(path.read_text('ascii'))})"
    return InvalidInputError(
        f"{output}: another run{who} is writing there; wait until it has ended, or give another "
        "output",
        field=option,
    )
