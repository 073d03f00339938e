"""`crux wrench-space --opening` and `"want": ["opening"]`: how a hand lets go."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from click.testing import CliRunner

import planner
from hand_models.opening import opening_path
from service import answering
from service.answering import dispatch
from service.commands.cli import crux
from service.commands.stances import read_request

LIMB = "front_left"


def answered(stance: str, limb: str) -> dict[str, Any]:
    whole = json.loads(msgspec.json.encode(read_request(stance).stance))
    request = {"v": 1, "stance": whole, "limb": limb, "want": ["opening"]}
    answer = dispatch.handle("crux/robosimian/wrench_space", json.dumps(request).encode())
    reply: dict[str, Any] = json.loads(answer.payload)
    return reply


def test_the_reply_is_the_path_of_the_hand():
    reply = answered("boulders", LIMB)
    found = reply["opening"]
    asked = answering.stance(read_request("boulders").stance)
    settled, space = planner.hand_space(asked, LIMB)
    path = opening_path(settled)
    knots = {name: np.array([knot[name] for knot in found["knots"]]) for name in found["knots"][0]}
    np.testing.assert_allclose(knots["tensions"], path.tensions)
    np.testing.assert_allclose(knots["wrench"], path.wrenches)
    np.testing.assert_allclose(knots["joints"], path.joints)
    np.testing.assert_allclose(knots["deviation"][1:], path.deviation)
    assert not knots["deviation"][0].any()
    assert knots["engagement"].shape[1] == len(reply["contacts"])
    assert [tuple(event.values()) for event in found["events"]] == list(path.events)
    tendons = [name.endswith("tension") for name in space.columns]
    start = space.origin + space.generators[:, tendons] @ knots["tensions"][0]
    np.testing.assert_allclose(knots["wrench"][0], start, atol=1e-9)
    assert found["jammed"] == found["resting"] == []
    assert reply["vertices"] is reply["half_spaces"] is None


def test_of_a_wrist_that_moves_it_is_refused():
    error = answered("wall-300-floating", "rear_left")["error"]
    assert error["field"] == "want"
    assert "'opening' requires fixed wrists" in error["message"]


def test_the_command_prints_and_draws_it(tmp_path: Path):
    picture = tmp_path / "opening.png"
    command = ["wrench-space", "wall-300", "--hand", LIMB, "--opening"]
    shown = CliRunner().invoke(crux, [*command, "--plot", str(picture)], standalone_mode=False)
    assert shown.exception is None, shown.exception
    table = shown.stdout.partition("as all tendons are lowered")[2]
    assert table.split("tiles let go")[0].count("37.00") == 1
    order = [line.split()[1] for line in table.splitlines() if line.split()[:1] == ["inner_left"]]
    assert order == ["middle", "proximal", "distal"]
    assert "straight fingers are clear of the rock" in table
    assert picture.stat().st_size > 10_000
    machine = CliRunner().invoke(crux, [*command, "--json"], standalone_mode=False)
    assert len(json.loads(machine.stdout)["opening"]["knots"]) > 3
