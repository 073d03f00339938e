"""What a reply tells of what is odd, and of what is near what."""

import copy
import json

import msgspec
import pytest

from service.answering import dispatch
from service.commands.stances import read_request
from service.replies import BodySpaceReply, PlanReply
from service.tables import console, print_plan
from tests.suite.helpers.replies import departures

LEFT = {"front_left": "front_right", "front_right": "front_left"}


@pytest.fixture(scope="module")
def sound() -> dict:
    return msgspec.to_builtins(read_request("wall-300"))


def exchanged(request: dict) -> dict:
    """The request with left and right of its front hands exchanged."""
    found = copy.deepcopy(request)
    for hand in found["stance"]["hands"]:
        hand["limb"] = LEFT.get(hand["limb"], hand["limb"])
    return found


def answered(request: dict, key: str = "plan") -> dict:
    return json.loads(
        dispatch.handle(f"crux/robosimian/{key}", json.dumps(request).encode()).payload
    )


def test_findings_have_a_field_of_the_request_and_warnings_their_words(sound):
    asked = exchanged(sound)
    reply = answered(asked)
    assert departures("PlanReply", reply) == []
    found, palms = reply["findings"]
    assert reply["warnings"][0] == found["message"]
    assert palms["kind"] == "palm_without_travel"
    assert palms["message"] in reply["warnings"]
    assert set(found) == {"kind", "field", "message", "value", "unit"}
    assert (found["kind"], found["unit"]) == ("limbs_crossed", "m")
    # the field leads to what it is about
    index = int(found["field"].split("[")[1].split("]")[0])
    assert found["field"] == f"stance.hands[{index}].limb"
    assert asked["stance"]["hands"][index]["limb"] in found["message"]
    assert [each["kind"] for each in answered(sound)["findings"]] == ["palm_without_travel"]


def test_less_detail_and_body_spaces_tell_findings_as_they_tell_warnings(sound):
    asked = exchanged(sound)
    whole = answered(asked)
    assert answered(asked | {"detail": "hands"})["findings"] == whole["findings"]
    assert "findings" not in answered(asked | {"detail": "set_points"})
    space = answered({"v": 1, "stance": asked["stance"]}, "body_space")
    assert space["findings"] == whole["findings"]
    assert departures("BodySpaceReply", space) == []
    assert {"findings", "warnings"} <= set(BodySpaceReply.__struct_fields__)


def test_what_cannot_be_is_an_error_with_its_field(sound):
    asked = copy.deepcopy(sound)
    asked["stance"]["hands"][1]["pose"] = asked["stance"]["hands"][0]["pose"]
    error = answered(asked)["error"]
    assert (error["kind"], error["field"]) == ("invalid", "stance.hands[1].pose.position")


def test_clearance_is_told_where_it_is_wanted(sound, capsys):
    assert "clearance" not in answered(sound)
    reply = answered(sound | {"want": ["clearance"]})
    assert departures("PlanReply", reply) == []
    near = reply["clearance"]
    assert near["link_rock"] is near["link_link"] is None
    assert near["hand_hand"]["distance"] == pytest.approx(0.9 - 2 * 0.0505)
    assert near["hand_hand"]["between"] == ["hand of front_right", "hand of front_left"] or near[
        "hand_hand"
    ]["between"] == ["hand of rear_left", "hand of rear_right"]
    (missing,) = near["unchecked"]
    assert missing.startswith("links: the joints are not known")
    print_plan(msgspec.convert(reply, PlanReply), console())
    shown = capsys.readouterr().out
    assert "least distances" in shown
    assert "not measured: links" in shown


@pytest.mark.parametrize(("margin", "kept"), [(2.0, True), (20.0, False)])
def test_margins_that_are_kept_in_full_are_shown(sound, capsys, margin, kept):
    limits = sound.get("limits", {}) | {"margins": "if_possible", "hold_margin": margin}
    reply = answered(sound | {"limits": limits})
    assert (reply["margin_share"] == 1.0) is kept
    print_plan(msgspec.convert(reply, PlanReply), console())
    shown = capsys.readouterr().out
    assert ("kept in full" in shown) is kept
