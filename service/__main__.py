"""Start the process of a ``crux`` command: the entry point of the installed program.

This module imports little, so that signals are handled while the commands are imported.
"""

from __future__ import annotations

import os
import sys

from hand_models.base import use_one_thread
from service.processes import interruptible

__all__ = ["main"]


def main() -> None:
    """Run the command line with this process's arguments, and exit with its status."""
    _open_what_is_closed()
    # as workers do: so answers of both are equal to the digit
    use_one_thread()
    with interruptible():
        from service.commands import run_command_line

        sys.exit(run_command_line())


def _open_what_is_closed() -> None:
    """Give standard streams that were closed (``>&-``) something to read or write all the same.

    Otherwise a file that is opened later would take their descriptors.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        if getattr(sys, name) is None:
            # the system opens the first free descriptor, which is this one
            os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(number, mode))


if __name__ == "__main__":
    main()
