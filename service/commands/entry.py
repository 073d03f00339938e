"""Where the process of a ``crux`` command begins.

Apart from the commands, with little to import, so that signals are answered while they are.
"""

from __future__ import annotations

import sys

from service.commands.interruption import interruptible

__all__ = ["main"]


def main() -> None:
    """Run the command line of this process, and exit."""
    with interruptible():
        from service.commands.cli import run

        sys.exit(run())
