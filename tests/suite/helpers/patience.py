"""How long tests wait for what is sure to come."""

from __future__ import annotations

import time
from collections.abc import Callable

PATIENCE = 600.0
"""For a thread, a process or a reply: so long that only one that never comes is missed [s]."""

PAUSES = (0.01, 0.05)
"""Between two questions whether it has come, the first and the longest [s].

Who asks as fast as he can takes the processor from what he waits for.
"""


def soon(true: Callable[[], object], longest: float = PAUSES[1]) -> bool:
    """Return whether something becomes true within `PATIENCE`, asking again and again.

    ``longest``: pause between two questions, which get rarer the longer it takes [s].
    """
    until, pause = time.monotonic() + PATIENCE, PAUSES[0]
    while time.monotonic() < until:
        if true():
            return True
        time.sleep(pause)
        pause = min(1.2 * pause, longest)
    return False
