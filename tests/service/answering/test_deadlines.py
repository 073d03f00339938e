"""Every key ends soon after its deadline, and says so; ids come back from all of them."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

from hand_models import Cylinder, Surface
from hand_models.base import Pose
from hand_models.hand import spiny_hand
from planner import deadline
from planner.deadline import DeadlineError
from planner.prepare import settle_each
from planner.question import HandOnHold
from planner.streaming import WrenchStream
from service.answering import Streams, handle
from tests.suite.helpers.requests import flat_request, stream_request, wall_request

LONG = 600.0


class Clock:
    """Time that ends at the so manieth look at it."""

    def __init__(self, looks: int) -> None:
        self.looks, self.left = 0, looks

    def perf_counter(self) -> float:
        self.looks += 1
        return 0.0 if self.looks <= self.left else 2.0 * LONG


def asked(key: str, **more: object) -> dict:
    """A small question for a key; streams are not there before they are declared."""
    stance = flat_request()["stance"]
    about = {"v": 1, "id": f"of {key}", "stance": stance}
    return {
        "plan": wall_request() | {"id": "of plan"},
        "wrench_space": about | {"limb": "front_left", "want": ["robust"]},
        "body_space": wall_request() | {"id": "of body_space", "directions": [[0, 0, 1]]},
        "stream": stream_request(id="of stream"),
    }[key] | more


def answered(key: str, request: dict, **more: object) -> dict:
    answer = handle(f"crux/robosimian/{key}", json.dumps(request).encode(), **more)
    return json.loads(answer.payload)


KEYS = ("plan", "wrench_space", "body_space", "stream")


@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize("key", KEYS)
def test_ids_are_echoed(key: str) -> None:
    assert answered(key, asked(key))["id"] == f"of {key}"
    assert answered(key, asked(key, deadline=LONG))["id"] == f"of {key}"
    late = answered(key, asked(key, deadline=1.0), started=time.perf_counter() - 1.0)
    assert (late["id"], late["error"]["kind"]) == (f"of {key}", "deadline")
    assert (
        late["error"]["message"]
        == "1 s expired before the answer was started; give a longer deadline"
    )


def test_no_deadline_is_longer_than_ten_minutes() -> None:
    for seconds in [601.0, 1e6]:
        for key in KEYS:
            error = answered(key, asked(key, deadline=seconds))["error"]
            assert (error["kind"], error["field"]) == ("invalid", "deadline")
            assert error["message"] == f"expected a number <= 600.0, in s, got {seconds:.0f}"


def refused(reply: dict) -> bool:
    return isinstance(reply.get("error"), dict)


@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize("key", ["wrench_space", "body_space", "stream"])
def test_a_deadline_ends_an_answer_soon_wherever_it_comes(
    key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not refused(answered(key, asked(key)))

    def late(looks: int) -> tuple[dict, int]:
        clock = Clock(looks)
        monkeypatch.setattr("planner.deadline.clock.time", clock)
        return answered(key, asked(key, deadline=LONG)), clock.looks

    reply, whole = late(10**9)
    assert not refused(reply)
    assert whole > 15
    for part in (0.0, 0.3, 0.7, 1.0):
        looks = 2 + int(part * (whole - 3))
        reply, needed = late(looks)
        assert reply["error"]["kind"] == "deadline"
        assert reply["id"] == f"of {key}"
        # each look is one more step
        assert needed - looks < 16


def test_a_stream_keeps_deadlines_and_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    streams = Streams()
    declared = answered("stream", asked("stream"), streams=streams)
    far = [1.01 * part + 0.01 for part in declared["body_wrench"]]
    request = {"v": 1, "stream": declared["stream"], "body_wrench": far, "deadline": LONG}
    with monkeypatch.context() as patched:
        patched.setattr("planner.deadline.clock.time", Clock(1))
        late = answered("set_points", request, streams=streams)
        assert late["error"]["kind"] == "deadline"
    reply = answered("set_points", request | {"id": "again"}, streams=streams)
    assert (reply["id"], reply["status"], reply["verified"]) == ("again", "optimal", True)
    with monkeypatch.context() as patched:
        patched.setattr("planner.deadline.clock.time", Clock(3))
        closed: list[WrenchStream] = []
        patched.setattr(WrenchStream, "close", lambda self: closed.append(self))
        late = answered("stream", asked("stream", deadline=LONG), streams=streams)
        assert late["error"]["kind"] == "deadline"
        assert len(closed) == 1
    streams.close()


def test_best_seats_are_looked_for_until_the_deadline(monkeypatch: pytest.MonkeyPatch) -> None:
    kind = spiny_hand()
    surface, holds = Surface.named("rock"), [Cylinder(0.31), Cylinder(0.33)]
    hands = [
        HandOnHold(limb, Pose.identity(), hold, surface, seat="best")
        for limb, hold in zip(("front_left", "front_right"), holds, strict=True)
    ]
    with monkeypatch.context() as patched:
        patched.setattr("planner.deadline.clock.time", Clock(2))
        said = "before the hands were closed on their holds"
        with deadline.within(LONG), pytest.raises(DeadlineError, match=said):
            settle_each(kind, hands)
    with deadline.within(LONG):
        in_time = settle_each(kind, hands)
    kind.seated_best.clear()
    for one, other in zip(in_time, settle_each(kind, hands), strict=True):
        ours, theirs = one.seating.pose, other.seating.pose
        np.testing.assert_allclose(ours.position, theirs.position, atol=1e-12)
        np.testing.assert_allclose(ours.rotation, theirs.rotation, atol=1e-12)
