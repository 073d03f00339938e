"""Body spaces as requests ask for them: replies, errors, the command and its picture."""

import json
import random
from pathlib import Path

import msgspec
import numpy as np
import pytest

from planner.capability import WRENCH_COMPONENTS, BodySpace
from service.answering import dispatch, questions
from service.commands.cli import run_command_line
from service.replies import BodySpaceReply, ErrorReply
from service.requests import PlanRequest
from service.wire import Format, decode_request
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result
from tests.suite.helpers.replies import ERROR_KINDS
from tests.suite.helpers.requests import (
    HEAVY,
    flat_request,
    put,
    request_with_joints,
    spoil,
    wall_request,
)

KEY = "crux/robosimian/body_space"

# Messages -----------------------------------------------------------------------------------------


def space_request(request: dict | None = None, **more) -> dict:
    """A body-space request with a plan request's stance and load."""
    request = wall_request() if request is None else request
    keys = ("v", "id", "stance", "load", "body_wrench", "limits", "present")
    return {key: request[key] for key in keys if key in request} | more


def reply_to(request: dict, form: Format = Format.JSON) -> BodySpaceReply:
    encode = msgspec.json.encode if form is Format.JSON else msgspec.msgpack.encode
    answer = dispatch.handle(KEY, encode(request), form.value)
    assert answer.good, answer.payload
    assert answer.encoding == f"{form.value};crux.BodySpaceReply@1"
    return form.decode(answer.payload, BodySpaceReply)


def test_a_reply_says_what_the_planner_says():
    diagonal = [0.0, 3.0, 4.0]
    request = space_request(axes=["fy", "mz"], others="free", directions=[diagonal])
    reply = reply_to(request)
    space = BodySpace(
        questions.question(decode_request(json.dumps(wall_request()).encode(), PlanRequest))
    )
    assert (reply.id, reply.robot, reply.status) == ("wall", "robosimian", "optimal")
    assert (reply.exact, reply.linearisation_error) == (True, 0.0)
    assert reply.warnings == list(space.plan.warnings)
    assert reply.error == reply.linearisation_error
    np.testing.assert_allclose(reply.body_wrench, space.needed)
    assert set(reply.capability) == {sign + axis for axis in WRENCH_COMPONENTS for sign in "+-"}
    for name, end in reply.capability.items():
        way = float(name[0] + "1") * np.eye(6)[WRENCH_COMPONENTS.index(name[1:])]
        assert end.extent == pytest.approx(space.support(way).reach)
        assert end.more == pytest.approx(space.more(way).reach)
        pure = space.pure(way)
        assert end.pure == (None if pure is None else pytest.approx(pure.reach))
    assert (reply.section.axes, reply.section.others) == (["fy", "mz"], "free")
    inner = np.array(reply.section.inner)
    assert inner[:, 0].max() == pytest.approx(reply.capability["+fy"].extent, rel=1e-6)
    assert inner[:, 1].min() == pytest.approx(-reply.capability["-mz"].extent, rel=1e-6)
    assert len(reply.section.limiting) == len(inner)
    assert reply.acceleration["-z"].direction == [0.0, 0.0, -1.0]
    most = space.acceleration([0.0, 0.0, -1.0])
    assert reply.acceleration["-z"].acceleration == pytest.approx(most.reach)
    assert reply.acceleration["-z"].limiting.limb == most.limiting.limb
    (one,) = reply.along
    np.testing.assert_allclose(one.direction, [0.0, 0.6, 0.8])
    assert one.acceleration == pytest.approx(space.acceleration([0.0, 0.6, 0.8]).reach)
    assert reply.angular_acceleration is None


def test_messagepack_says_the_same():
    request = space_request(flat_request())
    one, other = (reply_to(request, form) for form in Format)
    assert msgspec.structs.replace(one, time=None) == msgspec.structs.replace(other, time=None)


def test_spoilt_requests_get_a_reply_or_an_error():
    chance = random.Random(5)
    seen = {}
    for i in range(48):
        asked = (request_with_joints, flat_request, flat_request, flat_request)[i % 4]()
        request = space_request(asked, axes=["fx", "mz"], others="free", directions=[[1, 2, 3]])
        payload, encoding = spoil(request, chance)
        answer = dispatch.handle(KEY, payload, encoding)
        form = Format.named(answer.encoding)
        if answer.good:
            outcome = form.decode(answer.payload, BodySpaceReply).status
        else:
            outcome = form.decode(answer.payload, ErrorReply).error.kind
        seen[outcome] = seen.get(outcome, 0) + 1
    assert set(seen) <= {*ERROR_KINDS, "optimal", "overloaded", "infeasible"}
    assert seen["invalid"] > 12
    assert seen["overloaded"] > 1


def test_a_reply_with_joints_tells_of_turning():
    request = request_with_joints()
    reply = reply_to(space_request(request))
    assert set(reply.angular_acceleration) == {s + a for a in "xyz" for s in "+-"}
    assert all(one.acceleration > 0.0 for one in reply.angular_acceleration.values())


def test_what_cannot_be_told_is_null_and_a_warning_says_why():
    given = space_request(wall_request(mass=None), body_wrench=[0.0, 0.0, 10.0, 0.0, 0.0, 0.0])
    reply = reply_to(given)
    assert reply.acceleration is None
    assert reply.along is None
    assert reply.warnings == [
        "no accelerations: a body wrench does not determine the mass; give a load instead"
    ]
    reply = reply_to(space_request(wall_request(HEAVY)))
    assert reply.status == "overloaded"
    assert reply.acceleration is None
    assert reply.warnings[-1] == "no accelerations: the body cannot be held at rest"
    assert all(end.more is None and end.extent > 0.0 for end in reply.capability.values())
    nothing = put(wall_request(), ("limits",), {"utilisation": 0.05})
    reply = reply_to(space_request(nothing))
    assert all(end.extent is None for end in reply.capability.values())
    assert (reply.section.inner, reply.section.gap) == ([], None)


@pytest.mark.parametrize(
    ("more", "field", "text"),
    [
        ({"axes": ["fx", "fq"]}, "axes[1]", "'fq' is not known; valid: fx, fy, fz, mx, my, mz"),
        ({"axes": ["fx", "fx"]}, "axes", "fx is given twice"),
        ({"axes": ["fx"]}, "axes", "length >= 2"),
        ({"axes": "fx,fz"}, "axes", "expected a list"),
        ({"others": "some"}, "others", "valid: free, needed, zero"),
        ({"directions": [[0.0, 0.0, 0.0]]}, "directions[0]", "not zero"),
        ({"directions": [[1.0, 0.0]]}, "directions[0]", "length 3"),
        ({"draws": []}, "draws", "unknown field"),
        ({"want": ["advice"]}, "want[0]", "valid: com_region"),
        ({"body_wrench": [0.0] * 6}, "body_wrench", "not both"),
        ({"limits": {"utilisation": 2.0}}, "limits.utilisation", "<= 1.0"),
        ({"stance": None}, "stance", "expected an object"),
    ],
)
def test_requests_are_strict(more, field, text):
    answer = dispatch.handle(KEY, msgspec.json.encode(space_request(**more)))
    assert not answer.good
    error = msgspec.json.decode(answer.payload, type=ErrorReply).error
    assert (error.kind, error.field) == ("invalid", field)
    assert text in error.message
    assert "\n" not in error.message


# The command --------------------------------------------------------------------------------------


def test_the_command_prints_what_the_reply_says(stance_file, capfd):
    path = stance_file(wall_request())
    assert (
        run_command_line(["body-space", path, "--axes", "fy,fz", "--projection", "--json"]) == DONE
    )
    reply = msgspec.convert(result(capfd), BodySpaceReply)
    assert (reply.section.axes, reply.section.others) == (["fy", "fz"], "free")
    assert run_command_line(["body-space", path, "--axes", "fy,fz", "--projection"]) == DONE
    out, err = capfd.readouterr()
    assert err == ""
    assert max(len(line) for line in out.splitlines()) <= 80
    for end in (*reply.capability.values(),):
        for value in (end.more, end.pure, end.extent):
            assert value is None or f"{value:.1f}" in out
    for one in reply.acceleration.values():
        assert f"{one.acceleration:.2f}" in out
    assert "plane of fy and fz, whatever the others" in out
    assert f"{len(reply.section.inner)} corners" in out


def test_the_command_draws(stance_file, tmp_path: Path, capfd):
    pair = wall_request(limbs=("front_left", "front_right"))
    pair["load"] = {"mass": 15.0, "com": [0.5, 0.0, -0.3]}
    for name, request, status in (
        ("flat.png", flat_request(), OVERLOADED),
        ("pair.png", pair, DONE),
    ):
        picture = tmp_path / name
        arguments = ["body-space", stance_file(request), "--pure", "--json", "--plot", str(picture)]
        assert run_command_line(arguments) == status
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert result(capfd)["section"]["others"] == "zero"


def test_an_overloaded_body_ends_with_three(stance_file, capfd):
    assert run_command_line(["body-space", stance_file(wall_request(HEAVY))]) == OVERLOADED
    out, _ = capfd.readouterr()
    assert "OVERLOADED" in out
    assert "cannot be held at rest" in out


@pytest.mark.parametrize("axes", ["fx", "fx,fx", "fx,fq", "fx,fy,fz", ""])
def test_wrong_axes_are_one_line(stance_file, axes, capfd):
    assert (
        run_command_line(["body-space", stance_file(wall_request()), "--axes", axes]) == BAD_INPUT
    )
    assert "two different ones of fx, fy, fz, mx, my, mz" in complaint(capfd)
