"""Write a service's log in a separate thread, so that a reader that is slow blocks nothing else."""

from __future__ import annotations

import json
import logging
import os
import threading
from contextlib import suppress
from queue import Full, Queue

__all__ = ["JsonLines", "LogThread"]


class LogThread(logging.Handler):
    """Logging handler that writes lines to standard error in a background thread.

    A stopped terminal, or a pipe that nobody reads, blocks that thread alone. At most 10,000 lines
    wait; further lines are dropped, and their number is logged.
    """

    def __init__(self) -> None:
        super().__init__()
        # further lines that wait to be written are left out, and counted
        self._lines: Queue[str | None] = Queue(10_000)
        self._left_out = 0
        self._thread = threading.Thread(target=self._run, name="crux-log", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        try:
            self._lines.put_nowait(self.format(record))
        except Full:
            self._left_out += 1

    def close(self) -> None:
        """Stop the thread; wait up to half a second until the lines that are left are written."""
        with suppress(Full):
            self._lines.put_nowait(None)
        self._thread.join(timeout=0.5)
        super().close()

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            self._write(line)
            if self._left_out and self._lines.empty():
                left_out, self._left_out = self._left_out, 0
                log = logging.getLogger(__name__)
                log.warning("%d lines of this log are left out: they were not read", left_out)

    def _write(self, line: str) -> None:
        data = line.encode(errors="replace") + b"\n"
        # not sys.stderr: the interpreter cannot end while a thread is at work on that
        with suppress(OSError):
            while data:
                data = data[os.write(2, data) :]


class JsonLines(logging.Formatter):
    """Logging formatter that turns each record into one line of JSON.

    A line has ``time`` (Unix time [s]) and ``level``; then ``message``, or for an answered question
    its fields (key, id, client, times [s], status); and ``traceback`` where there is an exception.
    """

    def format(self, record: logging.LogRecord) -> str:
        line: dict[str, object] = {"time": record.created, "level": record.levelname.lower()}
        question = getattr(record, "question", None)
        line |= {"message": record.getMessage()} if question is None else question
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line)
