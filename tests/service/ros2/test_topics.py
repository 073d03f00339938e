"""Wrenches of the topic that are refused by their header."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import zenoh

from service.ros2.definitions import package_folder
from service.ros2.messages import RosMessages
from service.ros2.topics import RosStream
from tests.suite.helpers.ros_peer import RosPeer

MESSAGES, PEER = RosMessages(), RosPeer(package_folder())
KIND = "geometry_msgs/msg/WrenchStamped"


def taken(sec: int, nanosec: int, frame: str) -> tuple[Mock, str]:
    """The session of a stream that has got a wrench, and what its state says."""
    session = Mock()
    stream = RosStream(session, "robot", MESSAGES, Mock(), Mock(), Mock())
    stream.follow("stream", b"{}", bytes(16))
    zero = dict.fromkeys("xyz", 0.0)
    header = {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}
    data = PEER.encode(KIND, {"header": header, "wrench": {"force": zero, "torque": zero}})
    stream.take(SimpleNamespace(payload=zenoh.ZBytes(data)))
    state = stream.state()
    assert (state.level == 2) == (not session.put.called)
    return session, state.message


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ((1, 0, "map"), "frame_id 'map'; valid: 'B', or none"),
        ((1, 0, "x" * 10**5), f"frame_id {'x' * 20!r}; valid: 'B', or none"),
        ((-1, 5, "B"), "stamp of -1 s and 5 ns"),
        # its set-points could not have the same stamp
        ((2**31 - 1, 2**32 - 1, "B"), "stamp of 2147483647 s and 4294967295 ns"),
        ((5, 10**9, ""), "stamp of 5 s and 1000000000 ns"),
    ],
)
def test_a_header_that_is_refused_is_said_in_few_words(
    header: tuple[int, int, str], words: str
) -> None:
    session, said = taken(*header)
    assert not session.put.called
    assert said.startswith(f"the newest wrench is refused: {words}")
    assert len(said) < 150


@pytest.mark.parametrize("header", [(0, 0, "B"), (2**31 - 1, 10**9 - 1, "")])
def test_other_headers_are_passed_on(header: tuple[int, int, str]) -> None:
    session, _ = taken(*header)
    (_, payload), _ = session.put.call_args
    assert payload
