"""How long set-points for a changing wrench take, what they are made of, and their declaration.

``pytest benchmarks --benchmark-enable -m slow`` measures; else each runs once, as a test.
"""

from itertools import cycle

import msgspec
import numpy as np
import pytest

from planner.question import Load
from planner.streaming import WrenchStream
from planner.streaming.interpolation import Interpolation
from planner.streaming.stream_stance import StreamStance
from service.answering import Streams, dispatch
from service.replies import SetPointsReply, StreamReply
from service.requests import SetPointsRequest
from service.wire import ServiceName
from tests.suite.helpers.requests import stream_request
from tests.suite.helpers.stances import ask, complying, on_wall

pytestmark = pytest.mark.slow

QUESTION = ask(on_wall(), load=Load(mass=80.0, com=(0.0, 0.0, 0.0)))
"""Held with room, so that no cap on the utilisation makes the radius less."""

CENTRE = QUESTION.needed_wrench()

STEP = np.array([0.6, -0.3, 0.2, 0.02, 0.01, -0.03])
WRENCHES = [CENTRE + k * STEP for k in (-8, -5, -2, 1, 4, 7)]
"""Within the radius about the centre, so that none drifts."""


@pytest.mark.benchmark(group="another wrench on a known stance of four hands")
def test_set_points_as_messages(benchmark):
    """Without the way over zenoh."""
    known = Streams()
    declared = dispatch.handle(
        ServiceName.STREAM, msgspec.json.encode(stream_request()), streams=known
    )
    reply = msgspec.json.decode(declared.payload, type=StreamReply)
    centre = np.array(reply.body_wrench)
    payloads = cycle(
        msgspec.json.encode(
            SetPointsRequest(v=1, stream=reply.stream, body_wrench=tuple((centre + k).tolist()))
        )
        for k in (-0.3, -0.1, 0.1, 0.3)
    )
    payloads = cycle([next(payloads) for _ in range(4)])
    answer = benchmark(
        lambda: dispatch.handle(ServiceName.SET_POINTS, next(payloads), streams=known)
    )
    known.close()
    assert msgspec.json.decode(answer.payload, type=SetPointsReply).source == "interpolated"


@pytest.mark.benchmark(group="another wrench on a known stance of four hands")
def test_solved_set_points(benchmark):
    wrenches, stance = cycle(WRENCHES), StreamStance(QUESTION)
    assert benchmark(lambda: stance.solve(next(wrenches))).outcome.solved


@pytest.mark.benchmark(group="parts of a set-point")
def test_interpolated_loads(benchmark):
    wrenches = cycle(WRENCHES)
    found = Interpolation.about(StreamStance(QUESTION), CENTRE, 30.0)
    distance, _ = benchmark(lambda: found.at(next(wrenches)))
    assert distance < 1.0


@pytest.mark.benchmark(group="parts of a set-point")
def test_check_of_loads(benchmark):
    stance = StreamStance(QUESTION)
    loads = stance.solve(CENTRE).loads
    wrenches, used = stance.read(loads)
    assert benchmark(stance.check.fault, loads, wrenches, used, CENTRE) is None


@pytest.mark.benchmark(group="before the first set-point")
def test_declaration(benchmark):
    def declared():
        with WrenchStream(QUESTION) as stream:
            return stream.interpolates

    assert benchmark(declared) == 30.0


@pytest.mark.benchmark(group="before the first set-point")
def test_thirteen_plans_and_their_proofs(benchmark):
    stance = StreamStance(QUESTION)
    found = benchmark(Interpolation.about, stance, CENTRE, 30.0)
    assert len(found.constants) == 13


@pytest.mark.benchmark(group="another wrench on a known stance of four hands")
def test_set_points_of_compliant_wrists(benchmark):
    wrenches = cycle(WRENCHES)
    with WrenchStream(complying(QUESTION)) as stream:
        stream.set_points(CENTRE)
        points = benchmark(lambda: stream.set_points(next(wrenches)))
    assert (points.status, points.verified) == ("optimal", True)
