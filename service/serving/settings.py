"""Define times, counts and sizes by which a service shares its workers among many clients."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["SERVING_SETTINGS", "ServingSettings"]


@dataclass(frozen=True, slots=True)
class ServingSettings:
    """Times [s], counts and sizes [bytes] by which a service shares its workers among clients."""

    client_timeout: float = 10.0
    """Least timeout of a client, by default [s]."""
    search_timeout: float = 1.0
    """Timeout of the search for other sessions of the same robot [s]."""

    failed_starts: int = 3
    """Workers in a row that fail to start, after which a service gives up its start."""
    first_rest: float = 1.0
    """Pause after a worker that failed to start, before the next start; doubled each time [s]."""
    longest_rest: float = 30.0
    """Longest pause before the next start of a worker [s]."""
    quiet_time: float = 0.2
    """Time without a new question before the service ends, so that late ones get a reply [s]."""

    large_payload: int = 2**18
    """Payload size above which a question counts as long, and counts in the sums below [bytes]."""
    most_attached: int = 2**12
    """Largest attachment of a query, which is kept as long as the query [bytes]."""
    waiting_of_client: int = 32
    """Most questions of one client in a queue; further ones are refused as busy."""
    waiting_in_queue: int = 256
    """Most questions in a queue; beyond, the last one of the place with most is refused as busy."""
    waiting_bytes: int = 2**28
    """Largest sum of the payloads of all large questions that wait [bytes]."""
    waiting_bytes_of_place: int = 2**26
    """Largest sum for one place [bytes]; a single question may be larger."""

    ros_callers: int = 32
    """Most callers by ROS 2 that have a place of their own: a caller can make up identifiers."""
    ros_caller_time: float = 60.0
    """Time after its last call for which a caller by ROS 2 keeps its place [s]."""

    remembered: int = 4096
    """Size of the LRU caches of client identifiers, places and stances."""
    remembered_costs: int = 20
    """Number of costs that are kept of each place and stance."""
    dear_cost: float = 0.1
    """Median processor time above which a place's questions count as long [s]."""
    starts_waited: float = 4.0
    """Wait of a place that has ended a worker, over the time that a worker takes to start; starts
    then take no more than a fifth of a core from the others."""
    active_time: float = 10.0
    """Time after its last question for which a place counts as active [s]."""


SERVING_SETTINGS: Final = ServingSettings()
