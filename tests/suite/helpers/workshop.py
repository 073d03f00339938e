"""Work for processes, some of which kills them; apart, so that these import nothing else."""

from __future__ import annotations

import gc
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path


def squares(log: str) -> Callable[[int], int]:
    """Squares numbers; 13 kills its process always, 7 the first time; all are logged."""

    def square(number: int) -> int:
        with Path(log).open("a") as stream:
            stream.write(f"{number} {os.getpid()}\n")
        first = Path(log).read_text().split("\n").count(f"{number} {os.getpid()}") == 1
        seen = sum(line.startswith(f"{number} ") for line in Path(log).read_text().splitlines())
        if number == 13 or (number == 7 and seen == 1 and first):
            os.kill(os.getpid(), signal.SIGKILL)
        return number * number

    return square


def nothing(*_: object) -> Callable[[int], int]:
    """Dies before it can do anything."""
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def fails() -> Callable[[int], int]:
    """Cannot be made ready."""
    raise ValueError("spoilt")


def exits(*_: object) -> None:
    """Ends as a program does that starts processes while it is imported by one."""
    raise SystemExit(1)


def naps() -> Callable[[float], int]:
    """Sleeps as long as it is told [s], and says in which process."""

    def nap(seconds: float) -> int:
        time.sleep(seconds)
        return os.getpid()

    return nap


def threads() -> Callable[[str], str | None]:
    """Looks up what its environment says."""
    return os.environ.get


def forked_from() -> Callable[[object], tuple[int, int, bool]]:
    """Tells its own process and the one that it is from, and whether what plans need is loaded."""
    return lambda _: (os.getpid(), os.getppid(), "service.processes.loaded" in sys.modules)


def looked_through() -> Callable[[object], bool]:
    """Tells whether what was made before the first question is looked through for garbage."""
    made = [[]]
    return lambda _: any(each is made for each in gc.get_objects())


def reversers() -> Callable[[bytes], bytes]:
    """Turns bytes around."""
    return lambda item: item[::-1]


def letters(log: str) -> Callable[[list[bytes]], list]:
    """Answers chunks of bulk work with their own letters.

    ``!`` kills its process whenever it comes, ``?`` the first time that it does; ``~`` takes a
    while. All are logged.
    """
    from service.wire import Answer

    def answer(payload: bytes) -> Answer:
        before = Path(log).read_bytes() if Path(log).exists() else b""
        with Path(log).open("ab") as stream:
            stream.write(payload + b" %d\n" % os.getpid())
        if payload.endswith(b"!") or (payload.endswith(b"?") and payload + b" " not in before):
            os.kill(os.getpid(), signal.SIGKILL)
        if payload.endswith(b"~"):
            time.sleep(0.2)
        return Answer(payload.upper(), "", seconds=1e-4)

    return lambda chunk: [answer(each) for each in chunk]
