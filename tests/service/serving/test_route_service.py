"""A climb is asked for over zenoh, with its trajectory or without."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import pytest

from service import CruxClient
from service.replies import ClimbFailureReply, KnotReply, PartReply
from service.requests import RouteRequest
from service.serving import PlanService, open_session, zenoh_config
from service.wire import ServiceError, decode_request
from tests.suite.helpers.climbs import blocked, climbed, failed, two_moves
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.replies import departures
from tests.suite.helpers.served import client_config, free_endpoint


@pytest.fixture(scope="module")
def client() -> Iterator[CruxClient]:
    endpoint = free_endpoint()
    config = zenoh_config(mode="peer", listen=[endpoint], multicast=False)
    with (
        open_session(config) as session,
        PlanService(session, workers=1),
        CruxClient(client_config(endpoint), timeout=PATIENCE) as opened,
    ):
        yield opened


def asked(route: RouteRequest, *want: str, **more: object) -> RouteRequest:
    """Return a request that is checked as the service checks it."""
    changed = msgspec.structs.replace(route, want=list(want), **more)
    return decode_request(msgspec.json.encode(changed), RouteRequest)


def test_the_trajectory_of_a_reply_is_that_of_the_planner(client):
    reply = client.route(asked(two_moves(), "trajectory", id="mine"))
    assert (reply.id, reply.status, reply.failure) == ("mine", "optimal", None)
    assert reply.trajectory == [KnotReply.of(knot) for knot in climbed().climb.knots]
    plans = climbed().result.plans
    assert [stage.utilisation for stage in reply.stages] == [each.utilisation for each in plans]
    assert departures("RouteReply", msgspec.to_builtins(reply)) == []
    # as large as it is, a client that takes little is told what would fit
    with pytest.raises(ServiceError, match=r"\d+ without trajectory in want"):
        client.route(asked(two_moves(), "trajectory", max_reply_bytes=20_000))


def test_a_reply_says_where_a_climb_fails(client):
    reply = client.route(asked(blocked(), "trajectory"))
    assert reply.failure == ClimbFailureReply.of(failed().climb.failure)
    assert (reply.failure.move, reply.trajectory[-1].stage) == (2, 2)


def test_knots_come_move_by_move_before_the_last_reply(client):
    parts: list[PartReply] = []
    reply = client.route(asked(two_moves(), "trajectory", id="mine"), parts.append)
    assert (reply.id, reply.status, reply.failure) == ("mine", "optimal", None)
    assert reply.trajectory is msgspec.UNSET
    knots = [knot for part in parts for knot in part.knots]
    assert knots == [KnotReply.of(knot) for knot in climbed().climb.knots]
    assert [{knot.move for knot in part.knots} for part in parts] == [{0, 1}, {2}]
    assert {part.id for part in parts} == {"mine"}
    assert departures("PartReply", msgspec.to_builtins(parts[0])) == []


def test_knots_come_in_replies_that_a_small_client_takes(client):
    parts: list[PartReply] = []
    small = asked(two_moves(), "trajectory", max_reply_bytes=4096)
    reply = client.route(small, parts.append)
    assert reply.status == "optimal"
    assert all(len(msgspec.msgpack.encode(part)) <= 4096 for part in parts)
    knots = [knot for part in parts for knot in part.knots]
    assert knots == [KnotReply.of(knot) for knot in climbed().climb.knots]
    # one knot takes more than a reply may have: the climb is not planned in vain
    with pytest.raises(ServiceError, match="and no more than 1000 are allowed") as caught:
        client.route(asked(two_moves(), "trajectory", max_reply_bytes=1000), parts.append)
    assert (caught.value.kind, caught.value.field) == ("limit", "max_reply_bytes")


@pytest.mark.slow
def test_a_program_that_gets_one_reply_only_gets_it_whole(client):
    """In parts, whoever lets zenoh consolidate replies has the last one."""
    request = msgspec.json.encode(asked(two_moves(), "trajectory", parts=True))
    (reply,) = client._session.get("crux/robosimian/route", payload=request, timeout=PATIENCE)
    assert b'"status":"optimal"' in reply.ok.payload.to_bytes()


@pytest.mark.slow
def test_parts_end_with_what_a_failing_move_still_has(client):
    parts: list[PartReply] = []
    reply = client.route(asked(blocked(), "trajectory"), parts.append)
    assert reply.failure == ClimbFailureReply.of(failed().climb.failure)
    knots = [knot for part in parts for knot in part.knots]
    assert knots == [KnotReply.of(knot) for knot in failed().climb.knots]


def test_without_a_trajectory_stages_alone_are_planned(client):
    reply = client.route(asked(two_moves()))
    assert reply.trajectory is msgspec.UNSET
    assert reply.failure is msgspec.UNSET
    assert len(reply.stages) == 6
