"""Define times, counts and sizes by which a service shares its workers among many clients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["SERVING_SETTINGS", "ServingSettings"]


@dataclass(frozen=True, slots=True)
class ServingSettings:
    """Times [s], counts and sizes [bytes] by which a service shares its workers among clients."""

    client_timeout: float = 10.0
    """How long a client waits at least by default [s]."""
    search_timeout: float = 1.0
    """How long other sessions of the same robot are looked for at most [s]."""

    failed_starts: int = 3
    """Processes in a row that may die before they are ready, when a service starts."""
    first_rest: float = 1.0
    """Pause after a process that did not become ready, until another is started; doubled each time
    [s]."""
    longest_rest: float = 30.0
    """Longest such pause [s]."""
    quiet_time: float = 0.2
    """Time without a new question before the service ends: those on their way get a reply [s]."""

    large_payload: int = 2**18
    """Bytes beyond which a question may take long, and its bytes count while it waits."""
    most_attached: int = 2**12
    """Most bytes of a query's attachment, which is held as long as the query."""
    waiting_of_client: int = 32
    """Questions of one client that wait in a queue; further ones are refused as busy."""
    waiting_in_queue: int = 256
    """Questions in a queue; beyond it the place that has most loses its last one."""
    waiting_bytes: int = 2**28
    """Bytes of all large questions that wait."""
    waiting_bytes_of_place: int = 2**26
    """Bytes of those of one place, unless it is one question."""

    remembered: int = 4096
    """Names, places and stances that are remembered, those that were asked about last."""
    remembered_costs: int = 20
    """Costs that are remembered of each."""
    dear_cost: float = 0.1
    """A place whose questions cost more leaves the last process to others [s]."""
    starts_waited: float = 4.0
    """A place that has ended a process waits for so many times what it takes to start one: starting
    takes no more than a fifth of a core from the others."""
    active_time: float = 10.0
    """Time after its last question in which others are to leave a place time [s]."""


SERVING_SETTINGS: Final = ServingSettings()
