"""The newest set-points that a service publishes on its streams, for a page that waits for them."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import msgspec

from hand_models.base import CruxError
from service.replies import PublishedReply
from service.wire import ServiceName, read_reply, stream_key

if TYPE_CHECKING:
    import zenoh

__all__ = ["FollowedStreams"]


class FollowedStreams:
    """Set-points of all streams of a robot's services: the newest, whatever its stream.

    Parameters
    ----------
    session : zenoh.Session
        Closing it ends the subscription.
    robot : str
        Name of the robot.
    """

    def __init__(self, session: zenoh.Session, robot: str) -> None:
        from zenoh.handlers import Callback

        self._news, self._count = threading.Condition(), 0
        self._newest: PublishedReply | None = None
        key = stream_key(robot, "*", ServiceName.SET_POINTS)
        self._subscriber = session.declare_subscriber(key, Callback(self._came, indirect=False))

    def after(self, count: int, seconds: float) -> dict[str, Any]:
        """Return the newest set-points once there are more than ``count`` were seen.

        Parameters
        ----------
        count : int
            What the last call returned; 0 at first.
        seconds : float
            Longest wait [s].

        Returns
        -------
        dict of str to object
            ``count`` for the next call; ``reply``: the `PublishedReply`, None without a new one.
        """
        with self._news:
            came = self._news.wait_for(lambda: self._count > count, seconds)
            reply = msgspec.to_builtins(self._newest) if came else None
            return {"count": self._count, "reply": reply}

    def _came(self, sample: zenoh.Sample) -> None:
        try:
            reply = read_reply(sample, PublishedReply)
        except (CruxError, msgspec.MsgspecError):  # not of a service's
            return
        with self._news:
            self._newest, self._count = reply, self._count + 1
            self._news.notify_all()
