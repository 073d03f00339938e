"""How long tests wait for what is sure to come."""

from __future__ import annotations

import time
from collections.abc import Callable

PATIENCE = 600.0
"""For a thread, a process or a reply: so long that only one that never comes is missed [s]."""


def soon(true: Callable[[], object]) -> bool:
    """Return whether something becomes true within `PATIENCE`, asking again and again."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        if true():
            return True
        time.sleep(0.01)
    return False
