"""A robot that only listens: it keeps the set-points of a climb that are published, and when."""

from __future__ import annotations

import threading
import time

import msgspec
import zenoh
from zenoh.handlers import Callback

from service.replies import ClimbSetPoints
from service.wire import ServiceName, service_key
from tests.suite.helpers.patience import PATIENCE


class DryRobot:
    """Subscriber to the set-points of a climb, as a robot's controller is.

    Attributes
    ----------
    taken : list of ClimbSetPoints
        In the order in which they came.
    arrivals : list of float
        When they came, on the monotonic clock [s].
    ended : Event
        Set by set-points with the state ``done`` or ``stopped``.
    """

    def __init__(self, session: zenoh.Session, robot: str = "robosimian") -> None:
        self.taken: list[ClimbSetPoints] = []
        self.arrivals: list[float] = []
        self.ended = threading.Event()
        key = service_key(robot, ServiceName.PLAY)
        self._subscriber = session.declare_subscriber(key, Callback(self._take, indirect=False))

    def _take(self, sample: zenoh.Sample) -> None:
        assert str(sample.encoding) == "application/json;crux.ClimbSetPoints@1"
        self.arrivals.append(time.monotonic())
        points = msgspec.json.decode(sample.payload.to_bytes(), type=ClimbSetPoints)
        self.taken.append(points)
        if points.state != "playing":
            self.ended.set()

    def wait(self) -> None:
        """Wait for the end of the climb."""
        assert self.ended.wait(PATIENCE)
