"""Every reply of real answers travels in both formats: no number of numpy's is left in it."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from service.answering import Streams, handle
from service.commands.stances import read_request
from service.wire import Format
from tests.suite.helpers.requests import request_with_joints, stream_request, wall_request

FORMS = tuple(Format)
LIMBS = ("front_right", "rear_left")
WANT = ["load_factor", "prices", "model", "robust", "spread"]


def hanging(mass: float = 50.0, limbs: tuple[str, ...] = LIMBS, **entries: object) -> dict:
    request = wall_request(mass, limbs)
    for hand in request["stance"]["hands"]:
        hand.update(entries)
    return request


STANCES = {
    "optimal": hanging(10.0, (*LIMBS, "front_left", "rear_right")),
    "overloaded": hanging(50.0, LIMBS[:1], surface={"shear_limit": 1.0}),
    # a plane cannot be pulled at
    "infeasible": hanging(50.0, LIMBS[:1], hold={"shape": "plane"}, grasp={"palm": False}),
}


def answered(key: str, request: dict, form: Format, streams: Streams | None = None) -> dict:
    """The reply to a request in a format, which must not be an error."""
    more = {} if streams is None else {"streams": streams}
    answer = handle(f"crux/robosimian/{key}", form.encode(request), form.value, **more)
    assert answer.good, answer.payload
    return form.decode(answer.payload, dict)


@pytest.mark.slow
@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("status", STANCES)
@pytest.mark.parametrize("objective", ["min_effort", "max_margin"])
def test_plans_travel(status, form, objective):
    asked = STANCES[status] | {"want": WANT, "objective": objective}
    asked["present"] = {hand["limb"]: [5.0] * 4 for hand in asked["stance"]["hands"]}
    reply = answered("plan", asked, form)
    assert reply["status"] == status


@pytest.mark.slow
@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize("form", FORMS)
def test_plans_of_stances_with_joints_and_floating_wrists_travel(form):
    assert answered("plan", request_with_joints() | {"want": WANT}, form)["joint_torque"]
    floating = hanging(10.0, wrist="floating", tendon_preload=[10.0] * 4)
    assert answered("plan", floating | {"want": WANT[:3]}, form)["status"]
    bundled = read_request("wall-300-floating")
    assert answered("plan", msgspec.to_builtins(bundled), form)["hands"]


@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("status", STANCES)
def test_spaces_travel(status, form):
    stance = STANCES[status]["stance"]
    hand = {"v": 1, "stance": stance, "limb": stance["hands"][0]["limb"], "want": ["robust"]}
    assert answered("wrench_space", hand, form)["rows"]
    asked = STANCES[status] | {"directions": [[0.0, 0.0, 1.0]]}
    assert answered("body_space", asked, form)["v"] == 1


def test_streams_travel():
    for status in STANCES:
        for form in FORMS:
            streams = Streams()
            asked = stream_request(STANCES[status])
            declared = answered("stream", asked, form, streams)
            assert declared["status"] == status
            for share in (1.0, 0.01, 3.0):
                wrench = [share * part for part in declared["body_wrench"]]
                points = {"v": 1, "stream": declared["stream"], "body_wrench": wrench}
                answered("set_points", points, form, streams)
            assert len(streams) == 1
            streams.close()


def test_a_declaration_that_cannot_be_told_takes_no_place(monkeypatch):
    streams = Streams()
    asked = msgspec.json.encode(stream_request(STANCES["optimal"]))
    name = "service.answering.streams.uuid.uuid4"
    with monkeypatch.context() as spoilt:
        spoilt.setattr(name, lambda: type("Spoilt", (), {"hex": np.float64(1.0)})())
        answer = handle("crux/robosimian/stream", asked, streams=streams)
    assert not answer.good
    assert len(streams) == 0
    assert handle("crux/robosimian/stream", asked, streams=streams).good
    assert len(streams) == 1
    streams.close()
