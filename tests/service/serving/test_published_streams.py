"""Wrenches that are published on streams, and their set-points: real zenoh sessions throughout."""

from __future__ import annotations

import itertools
import os
import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import zenoh

from hand_models.base import CruxError, InvalidInputError
from planner import LostTile
from service import CruxClient, SetPointsRequest, StreamRequest
from service.processes import Job
from service.publishing import PublishedStream
from service.replies import PublishedReply, SetPointsReply, StreamReply
from service.requests import WrenchRequest
from service.serving import PlanService, open_session, zenoh_config
from service.wire import (
    Answer,
    Format,
    ServiceError,
    ServiceName,
    decode_request,
    service_key,
    stream_key,
)
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.replies import departures
from tests.suite.helpers.requests import JSON, MSGPACK, stream_request
from tests.suite.helpers.served import Served, client_config, free_endpoint

ROBOT = "robosimian"
WRENCH = [1050.0, 10.0, -5.0, 2.0, 1.0, 0.0]
SLIP = LostTile("front_left", "outer_left", "middle")
FIRST = {
    "stream": "nobody",
    "radius": None,
    "status": "optimal",
    "reason": None,
    "body_wrench": WRENCH,
    "utilisation": 0.5,
    "gap": 0.0,
    "hands": [],
    "took": 0.0,
}
"""Reply to the declaration of a stream that no service keeps."""


def declaration() -> StreamRequest:
    return decode_request(msgspec.json.encode(stream_request()), StreamRequest)


def answer_slowly() -> Callable[[Job], Answer]:
    """Answers of a worker that keeps streams of no stance, and takes as long as the wrench says."""
    kept: list[str] = []

    def answer(job: Job) -> Answer:
        if job.name == ServiceName.STREAM:
            stream = uuid.uuid4().hex
            reply = StreamReply(**FIRST | {"stream": stream})
            if job.rehearsal:
                return Answer(Format.MSGPACK.encode(reply), Format.MSGPACK.label(reply))
            kept.append(stream)
            # two are kept
            del kept[:-2]
            return Answer(
                Format.MSGPACK.encode(reply), Format.MSGPACK.label(reply), streams=tuple(kept)
            )
        wrench = decode_request(job.payload, WrenchRequest, Format.MSGPACK)
        if wrench.body_wrench[5] == 666.0:
            os._exit(1)
        time.sleep(wrench.body_wrench[0])
        points = SetPointsReply(
            stream=job.stream or "",
            status="optimal",
            reason=None,
            body_wrench=list(wrench.body_wrench),
            utilisation=0.5,
            gap=0.0,
            hands=[],
            verified=True,
            source="solved",
            took=0.0,
        )
        return Answer(Format.MSGPACK.encode(points), Format.MSGPACK.label(points))

    return answer


@pytest.fixture(scope="module")
def serving() -> Iterator[str]:
    """A service of this process, on TCP loopback."""
    endpoint = free_endpoint()
    config = zenoh_config(mode="peer", listen=[endpoint], multicast=False)
    with open_session(config) as session, PlanService(session, workers=1):
        yield endpoint


@pytest.fixture(scope="module")
def slow() -> Iterator[str]:
    """A service whose set-points take as long as the wrench says, in seconds."""
    endpoint = free_endpoint()
    config = zenoh_config(mode="peer", listen=[endpoint], multicast=False)
    with open_session(config) as session, PlanService(session, workers=1, make=answer_slowly):
        yield endpoint


@pytest.fixture
def client(serving: str) -> Iterator[CruxClient]:
    with CruxClient(client_config(serving), timeout=PATIENCE) as opened:
        yield opened


def received(stream: PublishedStream, number: int) -> PublishedReply:
    """The answer to a wrench of a number, after those to others."""
    while True:
        reply = stream.receive(PATIENCE)
        assert reply is not None
        if reply.number == number:
            return reply


# Against the service ------------------------------------------------------------------------------


def test_a_published_wrench_has_the_set_points_of_a_query(client: CruxClient) -> None:
    with client.publish_stream(declaration()) as stream:
        wrench = np.add(stream.declared.body_wrench, [5.0, -4.0, 3.0, 0.5, 0.0, 0.2])
        before = time.time()
        assert stream.publish(wrench) == 0
        reply = received(stream, 0)
        asked = SetPointsRequest(v=1, stream=reply.stream, body_wrench=tuple(wrench.tolist()))
        told = client.set_points(asked)
        told.took = reply.set_points.took
        assert reply.set_points == told
        assert reply.set_points.verified
        assert 0.0 <= reply.set_points.gap < 0.01
        assert (reply.error, reply.skipped, stream.lost) == (None, 0, 0)
        assert before <= reply.time <= time.time()
        assert reply.age > 0.0
        assert stream.publish(wrench, detail="set_points") == 1
        assert received(stream, 1).set_points.hands[0].wrench is msgspec.UNSET


def test_a_published_wrench_in_kilonewtons_is_doubted(client: CruxClient) -> None:
    with client.publish_stream(declaration()) as stream:
        assert stream.declared.findings == []
        points = received(stream, stream.publish([1.09, 0, 0, 0, -0.144, 0])).set_points
        (found,) = points.findings
        assert (found.kind, found.field, found.value) == ("unit", "body_wrench", 1.09)
        assert "or in kN?" in found.message
        points = received(stream, stream.publish([1090, 0, 0, 0, -144, 0])).set_points
        assert points.findings is msgspec.UNSET


def test_a_slip_that_is_published_is_answered_at_the_same_key(client: CruxClient) -> None:
    with client.publish_stream(declaration()) as stream:
        wrench = np.multiply(0.9, stream.declared.body_wrench)
        points = received(stream, stream.publish(wrench, [SLIP])).set_points
        assert (points.lost, points.status, points.verified) == ([SLIP], "optimal", True)
        asked = SetPointsRequest(
            v=1, stream=points.stream, body_wrench=tuple(wrench.tolist()), lost=[SLIP]
        )
        assert client.set_points(asked).hands == points.hands
        # what is not on the rock has not slipped
        nowhere = LostTile("front_left", "inner_left", "base")
        error = received(stream, stream.publish(wrench, [nowhere])).error
        assert (error.kind, error.field[:4]) == ("invalid", "lost")


def packed(**fields: object) -> bytes:
    return msgspec.msgpack.encode(
        {"v": 1, "number": 7, "time": 3.5, "body_wrench": WRENCH} | fields
    )


@pytest.mark.parametrize(
    ("payload", "encoding", "kind", "field", "number"),
    [
        (packed(body_wrench=WRENCH[:5]), MSGPACK, "invalid", "body_wrench", 7),
        (packed(body_wrench=[*WRENCH, 0.0]), MSGPACK, "invalid", "body_wrench", 7),
        (packed(body_wrench=[float("nan")] * 6), MSGPACK, "invalid", "body_wrench[0]", 7),
        (packed(body_wrench=[float("inf")] * 6), MSGPACK, "invalid", "body_wrench[0]", 7),
        (packed(time=float("nan")), MSGPACK, "invalid", "time", 7),
        (packed(number="seven"), MSGPACK, "invalid", "number", None),
        (packed(number=-7), MSGPACK, "invalid", "number", -7),
        (packed(stance={}), MSGPACK, "invalid", "stance", 7),
        (packed(detail="x" * 5000), MSGPACK, "limit", None, None),
        (b'{"v": 1, "number": 7, "time": 3.5}', JSON, "invalid", "body_wrench", 7),
        (b'{"v": 1, "number": 7, "time": 3.5', JSON, "malformed", None, None),
        (b"", MSGPACK, "malformed", None, None),
        (packed(), "application/cdr", "malformed", None, None),
    ],
)
def test_a_wrench_that_is_wrong_is_told_why(
    declared: str, serving: str, payload, encoding, kind, field, number
) -> None:
    reply = published(serving, declared, payload, encoding)
    assert reply.set_points is None
    assert (reply.error.kind, reply.error.field, reply.number) == (kind, field, number)
    assert reply.stream == declared


@pytest.fixture(scope="module")
def declared(serving: str) -> str:
    """A stream that is kept."""
    with CruxClient(client_config(serving), timeout=PATIENCE) as client:
        return client.stream(declaration()).stream


def published(endpoint: str, stream: str, payload: bytes, encoding: str) -> PublishedReply:
    """Publish by zenoh alone, and take the answer."""
    points_key = stream_key(ROBOT, stream, ServiceName.SET_POINTS)
    with (
        zenoh.open(client_config(endpoint)) as session,
        session.declare_subscriber(points_key) as points,
    ):
        publisher = session.declare_publisher(stream_key(ROBOT, stream, ServiceName.WRENCH))
        assert soon(lambda: publisher.matching_status.matching)
        # the service has to know of the subscriber, too
        next(iter(session.get(service_key(ROBOT, ServiceName.HEALTH))))
        publisher.put(payload, encoding=encoding)
        sample = points.recv()
    form = Format.named(str(sample.encoding))
    assert str(sample.encoding) == f"{form.value};crux.PublishedReply@1"
    assert encoding not in (JSON, MSGPACK) or form.value == encoding
    plain = form.decode(sample.payload.to_bytes(), dict)
    assert departures("PublishedReply", plain) == []
    return form.decode(sample.payload.to_bytes(), PublishedReply)


def test_json_is_answered_in_json(declared: str, serving: str) -> None:
    wrench = {"v": 1, "number": 3, "time": 1.5, "body_wrench": WRENCH}
    assert departures("WrenchRequest", wrench) == []
    reply = published(serving, declared, msgspec.json.encode(wrench), JSON)
    assert (reply.number, reply.time, reply.set_points.body_wrench) == (3, 1.5, WRENCH)


def test_an_unknown_stream_is_told_at_its_key(serving: str) -> None:
    reply = published(serving, "nobody", packed(), MSGPACK)
    assert (reply.error.kind, reply.error.field) == ("invalid", "stream")
    assert "no stream 'nobody'" in reply.error.message


# Whose turn it is ---------------------------------------------------------------------------------


@dataclass
class Listener:
    """All answers at the keys of the streams of a service."""

    session: zenoh.Session
    replies: list[PublishedReply] = field(default_factory=list)

    def listen(self) -> None:
        key = stream_key(ROBOT, "*", ServiceName.SET_POINTS)
        self.session.declare_subscriber(key, self._take)
        next(iter(self.session.get(service_key(ROBOT, ServiceName.HEALTH))))

    def _take(self, sample: zenoh.Sample) -> None:
        self.replies.append(Format.MSGPACK.decode(sample.payload.to_bytes(), PublishedReply))

    def numbers(self, stream: str) -> list[int]:
        return [each.number for each in self.replies if each.stream == stream]


@pytest.fixture
def listener(slow: str) -> Iterator[Listener]:
    with zenoh.open(client_config(slow)) as session:
        found = Listener(session)
        found.listen()
        yield found


def test_of_more_wrenches_than_can_be_answered_the_newest_is_and_the_others_are_counted(
    slow: str, listener: Listener
) -> None:
    with CruxClient(client_config(slow)) as client, client.publish_stream(declaration()) as stream:
        count = 300
        for _ in range(count):
            # each takes longer than it is until the next comes
            stream.publish([0.03, 0.0, 0.0, 0.0, 0.0, 0.0])
            time.sleep(0.001)
        name = stream.declared.stream
        assert soon(lambda: listener.numbers(name)[-1:] == [count - 1])
        answers = [each for each in listener.replies if each.stream == name]
        numbers = listener.numbers(name)
        assert numbers == sorted(set(numbers))
        assert len(answers) < count
        # nothing is lost unseen
        skipped = np.diff([-1, *numbers]) - 1
        assert [each.skipped for each in answers] == skipped.tolist()
        assert sum(each.skipped for each in answers) + len(answers) == count
        # the client has received none of them but the last
        received: list[PublishedReply] = []

        def last_came() -> bool:
            found = stream.receive(0.0)
            received.extend([] if found is None else [found])
            return bool(received) and received[-1].number == count - 1

        assert soon(last_came)
        assert len(received) + sum(each.skipped for each in received) + stream.replaced == count
        assert stream.replaced > 0
        assert stream.receive(0.0) is None
        assert stream.lost == 0


def test_two_clients_take_turns(slow: str, listener: Listener) -> None:
    with (
        CruxClient(client_config(slow)) as one,
        CruxClient(client_config(slow)) as two,
        one.publish_stream(declaration()) as first,
        two.publish_stream(declaration()) as second,
    ):
        names = first.declared.stream, second.declared.stream
        assert len(set(names)) == 2
        for _ in range(200):
            first.publish([0.005, 0.0, 0.0, 0.0, 0.0, 0.0])
            second.publish([0.005, 1.0, 0.0, 0.0, 0.0, 0.0])
            time.sleep(0.002)
        for name in names:
            assert soon(lambda name=name: listener.numbers(name)[-1:] == [199])
        answers = [each for each in listener.replies if each.stream in names]
        for side, name in enumerate(names):
            mine = [each.set_points for each in answers if each.stream == name]
            assert {points.body_wrench[1] for points in mine} == {float(side)}
        few, many = sorted(len(listener.numbers(name)) for name in names)
        assert few > many / 2


def test_tokens_say_which_streams_are_kept_and_who_lost_one_takes_up_again(slow: str) -> None:
    with (
        CruxClient(client_config(slow)) as client,
        zenoh.open(client_config(slow)) as session,
        client.publish_stream(declaration()) as stream,
    ):
        name = stream.declared.stream
        assert soon(lambda: name in tokens(session))
        received(stream, stream.publish([0.0] * 6))
        # two more put it out
        others = [client.stream(declaration()).stream for _ in range(2)]
        assert soon(lambda: stream.declarations == 2)
        assert stream.declared.stream not in (name, *others)
        assert soon(lambda: tokens(session) == {others[1], stream.declared.stream})
        assert received(stream, stream.publish([0.0] * 6)).stream == stream.declared.stream


def tokens(session: zenoh.Session) -> set[str]:
    """Streams whose tokens are there."""
    replies = session.liveliness().get(stream_key(ROBOT, "*"), timeout=PATIENCE)
    return {str(reply.ok.key_expr).rpartition("/")[2] for reply in replies}


def test_a_client_knows_that_its_service_is_away_and_when_it_is_back() -> None:
    endpoint = free_endpoint()
    config = zenoh_config(mode="router", listen=[endpoint], multicast=False)
    with open_session(config) as router, CruxClient(client_config(endpoint)) as client:
        with PlanService(router, workers=1, make=answer_slowly):
            opened = client.publish_stream(declaration())
            assert not opened.away
            received(opened, opened.publish([0.0] * 6))
            # there is a service, and no news
            assert (opened.receive(0), opened.away) == (None, False)
        with opened as stream:
            assert soon(lambda: stream.away)
            assert stream.receive(0) is None
            with PlanService(router, workers=1, make=answer_slowly):
                assert soon(lambda: not stream.away)
                assert stream.declarations == 2


def test_who_lost_its_worker_takes_up_again(slow: str) -> None:
    with (
        CruxClient(client_config(slow), timeout=PATIENCE) as client,
        client.publish_stream(declaration()) as stream,
    ):
        lost = received(stream, stream.publish([0.0] * 5 + [666.0]))
        assert lost.error.kind == "lost"
        assert soon(lambda: stream.declarations == 2)
        # what has ended the worker is not published again
        reply = received(stream, stream.publish([0.0] * 6))
        assert (reply.error, reply.skipped, stream.lost) == (None, 0, 0)
        assert reply.stream != lost.stream


def test_a_message_that_is_no_set_points_is_said_once_and_ends_nothing(slow: str) -> None:
    with (
        CruxClient(client_config(slow)) as client,
        client.publish_stream(declaration()) as stream,
        zenoh.open(client_config(slow)) as other,
    ):
        other.put(stream_key(ROBOT, stream.declared.stream, ServiceName.SET_POINTS), b"junk")
        with pytest.raises(CruxError):
            stream.receive(PATIENCE)
        number = stream.publish([0.001, 0.0, 0.0, 0.0, 0.0, 0.0])
        reply = stream.receive(PATIENCE)
        assert reply is not None
        assert (reply.number, reply.error) == (number, None)


def test_a_declaration_that_is_refused_raises(serving: str) -> None:
    wrong = decode_request(
        msgspec.json.encode(stream_request(limits={"tension_change": 5.0})), StreamRequest
    )
    with (
        CruxClient(client_config(serving), timeout=PATIENCE) as client,
        pytest.raises(ServiceError, match="tension_change"),
    ):
        client.publish_stream(wrong)


def test_a_stream_that_cannot_be_declared_again_raises(serving: str) -> None:
    refusal = ServiceError("invalid", "no such rock", field="stance")
    replies = iter([StreamReply(**FIRST)])
    known = SimpleNamespace(secret=b"", source=lambda: None)
    with zenoh.open(client_config(serving)) as session:
        (service,) = session.get(service_key(ROBOT, ServiceName.HEALTH))

        def declare() -> tuple[StreamReply, str]:
            for reply in replies:
                return reply, str(service.replier_id.zid)
            raise refusal

        with PublishedStream(session, ROBOT, declare, Format.MSGPACK, known) as stream:
            with pytest.raises(ServiceError, match="no such rock"):
                # what is published before the service knows of the subscriber has no answer
                soon(lambda: stream.publish(WRENCH) < 0)
            with pytest.raises(ServiceError, match="no such rock"):
                stream.receive(PATIENCE)


def test_a_client_takes_nothing_for_another_ones_wrenches(slow: str, listener: Listener) -> None:
    with CruxClient(client_config(slow), timeout=PATIENCE) as client:
        with client.publish_stream(declaration()) as stream:
            key = stream_key(ROBOT, stream.declared.stream, ServiceName.WRENCH)
            other = packed(number=10**6, body_wrench=[0.0] * 6)
            listener.session.put(key, other, encoding=MSGPACK)
            name = stream.declared.stream
            assert soon(lambda: listener.numbers(name) == [10**6])
            assert received(stream, stream.publish([0.0] * 6)).number == 0
            # one with a number of this client's, too
            assert received(stream, stream.publish([0.0] * 6)).number == 1
            listener.session.put(
                key, packed(number=1, time=0.0, body_wrench=[0.0] * 6), encoding=MSGPACK
            )
            assert soon(lambda: listener.numbers(name) == [10**6, 0, 1, 1])
            assert stream.receive(0.2) is None
        with pytest.raises(InvalidInputError, match="closed"):
            stream.publish(WRENCH)
        assert stream.receive() is None


# Servers and clients that come and go -------------------------------------------------------------


@pytest.mark.slow
def test_a_server_that_is_killed_and_started_again_is_taken_up_again() -> None:
    endpoint = free_endpoint()
    first = Served(endpoint, "--workers", "1")
    second: list[Served] = []
    try:
        with CruxClient(client_config(endpoint), timeout=PATIENCE) as client:
            with client.publish_stream(declaration()) as stream:
                name = stream.declared.stream
                received(stream, stream.publish(WRENCH))
                first.stop(signal.SIGKILL)
                number = stream.publish(WRENCH)
                assert stream.receive(0.2) is None
                second.append(Served(endpoint, "--workers", "1"))
                reply = received(stream, number)
                assert reply.set_points.status == "optimal"
                assert reply.stream == stream.declared.stream != name
                received(stream, stream.publish(WRENCH))
            # a client that starts again has a stream of its own at once
            with client.publish_stream(declaration()) as again:
                assert again.declared.stream != stream.declared.stream
                assert received(again, again.publish(WRENCH)).set_points.verified
        assert second[0].stop(signal.SIGTERM) is not None
        assert second[0].process.returncode == 0
    finally:
        for each in (first, *second):
            each.process.kill()


@pytest.mark.slow
def test_a_service_that_ends_while_wrenches_come_ends_well() -> None:
    endpoint = free_endpoint()
    server = Served(endpoint, "--workers", "1")
    ended = threading.Event()
    try:
        with (
            CruxClient(client_config(endpoint), timeout=PATIENCE) as client,
            client.publish_stream(declaration()) as stream,
        ):

            def publish() -> None:
                for _ in itertools.takewhile(lambda _: not ended.is_set(), itertools.count()):
                    stream.publish(WRENCH)
                    time.sleep(0.001)

            publishing = threading.Thread(target=publish)
            publishing.start()
            stream.receive(PATIENCE)
            _, err = server.stop(signal.SIGTERM)
            ended.set()
            publishing.join()
        assert server.process.returncode == 0
        assert "Traceback" not in err
    finally:
        ended.set()
        server.process.kill()
