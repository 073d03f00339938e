"""Where the process of a ``crux`` command begins.

Apart from the commands, with little to import, so that signals are answered while they are.
"""

from __future__ import annotations

import os
import sys

from service.processes import interruptible

__all__ = ["main"]


def main() -> None:
    """Run the command line of this process, and exit."""
    _open_what_is_closed()
    with interruptible():
        from service.commands.cli import run

        sys.exit(run())


def _open_what_is_closed() -> None:
    """Give standard streams that were closed (``>&-``) something to read or write all the same.

    What is opened later would take their places.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is None:
            # the first that is free, which is this one
            os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(number, mode))
