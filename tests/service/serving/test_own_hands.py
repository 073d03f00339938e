"""Hands of callers over zenoh: two at one service, a service's own, and spoilt ones."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import msgspec
import pytest
import zenoh

from service.answering import dispatch, with_hand
from service.answering.own_models import over_default
from service.commands.cli import run_command_line
from service.requests import PlanRequest
from service.serving import CruxClient, PlanService
from service.wire import ServiceError
from tests.suite.helpers.commands import result
from tests.suite.helpers.hands import entry_toml
from tests.suite.helpers.own_hands import THICK, WEAK, own, request_for, untimed
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.requests import HEAVY, full_request, put, wall_request
from tests.suite.helpers.served import Served, client_config, free_endpoint


@pytest.mark.slow
def test_two_hands_ask_one_service_and_do_not_disturb_each_other(alone: zenoh.Session) -> None:
    asked = [request_for(), request_for(THICK), request_for(WEAK), request_for(THICK, WEAK)]
    want = [untimed(dispatch.answer_plan(request)) for request in asked]
    assert len({reply["utilisation"] for reply in want}) >= 2
    order = [i for _ in range(5) for i in (0, 1, 2, 3, 1, 0)]
    with PlanService(alone, workers=1), ThreadPoolExecutor(4) as pool:
        client = CruxClient(alone, timeout=PATIENCE)
        got = list(pool.map(lambda i: untimed(client.plan(asked[i])), order))
        bad = put(
            msgspec.to_builtins(asked[1]),
            ("stance", "hand", "finger", "joint_spacing"),
            {"value": -0.04, "unit": "m", "source": "assumed"},
        )
        with pytest.raises(ServiceError, match="must be from 0 to 1 m") as caught:
            client.plan(msgspec.convert(bad, PlanRequest))
        assert (caught.value.kind, caught.value.field) == (
            "invalid",
            "stance.hand.finger.joint_spacing",
        )
        assert untimed(client.plan(asked[0])) == want[0]
    assert got == [want[i] for i in order]


@pytest.mark.slow
def test_a_service_has_a_hand_of_its_own_and_a_request_the_last_word(
    stance_file: Callable[..., str], capfd: pytest.CaptureFixture[str]
) -> None:
    plain = request_for(mass=HEAVY)
    heavy = own("hand", "mass", 12.6)
    hand = stance_file(entry_toml("structure", "held_mass", 20.0), "own.toml")
    served = Served(free_endpoint(), "--workers", "1", "--hand", hand)
    default = own("structure", "held_mass", 20.0)
    try:
        with zenoh.open(client_config(served.endpoint)) as session:
            client = CruxClient(session, timeout=PATIENCE)
            for request in (plain, with_hand(plain, THICK), with_hand(plain, heavy)):
                want = dispatch.answer_plan(over_default(request, default))
                assert untimed(client.plan(request)) == untimed(want)
            back = own("structure", "held_mass", 50.0)
            assert untimed(client.plan(with_hand(plain, back))) == untimed(
                dispatch.answer_plan(plain)
            )
        flags = ["-m", "client", "-e", served.endpoint, "--no-multicast-scouting"]
        flags += ["--timeout", str(PATIENCE)]
        hand = stance_file(entry_toml("structure", "held_mass", 45.0), "mine.toml")
        asked = ["query", stance_file(wall_request(HEAVY)), *flags, "--json", "--hand", hand]
        assert run_command_line(asked) in (0, 3)
        want = dispatch.answer_plan(with_hand(plain, own("structure", "held_mass", 45.0)))
        assert result(capfd)["utilisation"] == pytest.approx(want.utilisation, rel=1e-9)
    finally:
        served.stop(signal.SIGTERM)


SPOILT = [
    ({"finger": 1}, "stance.hand.finger", "a section of entries is needed"),
    ({"colour": {}}, "stance.hand.colour", "unknown section; known are"),
    ({"finger": {"colour": 1}}, "stance.hand.finger.colour", "expected object, got int"),
    ({"x" * 65: {}}, "stance.hand", "64"),
    ({"finger": {"tile_height": {"value": 1e-3}}}, "stance.hand.finger.tile_height", "unit"),
    (
        {"finger": {"pulley_radii": {"value": [0.01] * 10**5, "unit": "m", "source": "paper"}}},
        "stance.hand.finger.pulley_radii",
        "a list of 3 numbers is needed, got a list of 100000",
    ),
    (
        {"hand": {"mass": {"value": 1.0, "unit": "kg" * 10**5, "source": "paper"}}},
        "stance.hand.hand.mass",
        "must be in 'kg'",
    ),
    (
        {"hand": {"mass": {"value": 1.0, "unit": "kg", "source": "x" * 10**5}}},
        "stance.hand.hand.mass.source",
        "must be one of paper, measured, calibrated, assumed",
    ),
    (
        {"hand": {"mass": {"value": 10**400, "unit": "kg", "source": "paper"}}},
        None,
        "",
    ),
]


@pytest.mark.parametrize(("hand", "field", "words"), SPOILT)
def test_a_spoilt_hand_costs_its_sender_one_short_error(
    hand: dict, field: str | None, words: str
) -> None:
    request = json.dumps(put(full_request(), ("stance", "hand"), hand)).encode()
    answer = dispatch.handle("crux/robosimian/plan", request)
    assert not answer.good
    assert len(answer.payload) < 1000
    error = json.loads(answer.payload)["error"]
    assert error["kind"] in ("invalid", "malformed")
    assert words in error["message"]
    if field is not None:
        assert error["field"] == field


@pytest.mark.parametrize("depth", [100, 900, 100_000])
def test_a_deep_hand_is_no_trouble(depth: int) -> None:
    text = json.dumps(put(wall_request(), ("stance", "hand"), {"finger": {"tile_height": 0.5}}))
    answer = dispatch.handle(
        "crux/robosimian/plan", text.replace("0.5", "[" * depth + "]" * depth, 1).encode()
    )
    assert not answer.good
    assert json.loads(answer.payload)["error"]["kind"] in ("invalid", "malformed")
