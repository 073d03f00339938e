"""Numbers of the live page and its server."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["VIEWING_SETTINGS", "ViewingSettings"]


@dataclass(frozen=True, slots=True)
class ViewingSettings:
    """Numbers of the live page and its server, with the reasons for them."""

    palm_half: float = 0.03  # [m] rock so far about a point gives the normal there: a palm's size
    advice_timeout: float = 10.0  # [s] a person has moved on by then
    most_bytes: int = 2**14  # of a question: 16 hands take some 1,500
    socket_timeout: float = 30.0  # [s] that a connection may be silent
    first_timeout: float = 5.0  # [s] likewise before it has shown the token
    most_connections: int = 32  # at once, a thread each: a browser has six for each site
    most_waiting: int = 128  # connections not accepted yet; beyond, browsers wait 1 s and try again
    longest_wait: float = 10.0  # [s] for something new of a stream, before the page asks again


VIEWING_SETTINGS: Final = ViewingSettings()
