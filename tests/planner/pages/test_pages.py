"""Pages for a browser: what their data say is what the plan says, and they load nothing else."""

from __future__ import annotations

import json
import re
import sys
from base64 import b64decode
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np
import pytest
import trimesh

from hand_models.base import Pose, UnsupportedError
from hand_models.wrench_spaces import Row, WrenchSpace
from planner import evaluate
from planner.advice import changed
from planner.advice.changes import pose_message
from planner.pages import (
    LivePage,
    Meshes,
    document,
    scene_data,
    scenes,
    wrench_slice,
    write_plan_page,
    write_route_page,
)
from planner.pages.plan_page import shown_plan
from planner.pictures import drawn_scene, joint_utilisations
from planner.result import Advice
from planner.robots import RobotFile, robot_of
from planner.solving import solve
from service.answering import route_of
from tests.suite.helpers.climbs import blocked
from tests.suite.helpers.pictures import answered
from tests.suite.helpers.robots import TWO_LINK, limbs_toml

MOST_BYTES = 6e6


@cache
def result():
    return evaluate(route_of(blocked()), 1)


def data_of(text):
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text)
    return json.loads(found)


@cache
def shown(name):
    """A plan by name with its question, and the data of its page."""
    question, plan = answered(name)
    with TemporaryDirectory() as folder:
        page = Path(folder) / "plan.html"
        write_plan_page(plan, question, page, name)
        return question, plan, data_of(page.read_text("utf-8"))


def unpacked(data, surface):
    """Corners of a surface's triangles, shape (n, 3, 3)."""
    corners, faces = (b64decode(data["meshes"][surface[k]]) for k in ("corners", "triangles"))
    return np.frombuffer(corners, "<f4").reshape(-1, 3)[np.frombuffer(faces, "<u4").reshape(-1, 3)]


@pytest.mark.parametrize("name", ["solved", "overloaded", "floating", "nails"])
def test_tiles_have_the_plans_numbers(name):
    _, plan, data = shown(name)
    (stage,) = data["stages"]
    touching = [
        (hand.limb, tile.finger, tile.phalanx, used, *loads)
        for hand in plan.hands
        for tile, used, loads in zip(
            hand.tiles, hand.tile_utilisations, hand.loads.tolist(), strict=True
        )
        if tile.contact != "none"
    ]
    keys = ("limb", "finger", "phalanx", "used", "shear", "normal", "lateral")
    assert [tuple(tile[k] for k in keys) for tile in stage["scene"]["tiles"]] == touching
    assert (stage["status"], stage["sentence"]) == (plan.status, plan.reason)
    assert stage["utilisation"] == plan.utilisation


@pytest.mark.parametrize("name", ["solved", "ceiling", "two hands"])
def test_drawn_forces_of_tiles_and_palm_add_up_to_the_hands(name):
    question, plan, data = shown(name)
    scene = data["stages"][0]["scene"]
    arrows = [arrow for arrow in scene["arrows"] if arrow["kind"] == "force"]
    for hand, planned, arrow in zip(question.stance.hands, plan.hands, arrows, strict=True):
        step = np.subtract(arrow["tip"], arrow["start"])
        scale = np.linalg.norm(step) / np.linalg.norm(arrow["force"])
        tiles = [t for t in scene["tiles"] if t["limb"] == planned.limb]
        forces = sum(np.subtract(t["tip"], t["start"]) for t in tiles) / scale
        palm = -hand.pose.rotation @ planned.palm.force
        # places are rounded to a tenth of a millimetre
        np.testing.assert_allclose(forces + palm, arrow["force"], atol=0.02 / scale * 0.15)
        middles = [np.mean(t["corners"], axis=0) for t in tiles]
        np.testing.assert_allclose(middles, [t["start"] for t in tiles], atol=2e-4)


@pytest.mark.parametrize("name", ["solved", "infeasible"])
def test_surfaces_are_those_of_the_pictures_scene(name):
    question, plan, data = shown(name)
    scene = drawn_scene(plan, question, fineness=5)
    wanted = [s for s in scene.surfaces if len(s.faces)]
    for drawn, surface in zip(wanted, data["stages"][0]["scene"]["surfaces"], strict=True):
        assert (surface["kind"], surface["limb"]) == (drawn.kind, drawn.name)
        found, triangles = unpacked(data, surface), drawn.triangles
        if drawn.kind == "rock":
            # the nearest to the hand's back first
            (hand,) = (h for h in question.stance.hands if h.limb == drawn.name)
            depth = triangles.mean(axis=1) @ hand.pose.rotation[:, 2]
            triangles = triangles[np.argsort(depth, kind="stable")]
        np.testing.assert_allclose(found, triangles, atol=6e-5)


def test_tables_have_the_plans_numbers():
    _, plan, data = shown("solved")
    tables = {table["title"].partition(":")[0]: table for table in data["stages"][0]["tables"]}
    for table in tables.values():
        assert all(len(row) == len(table["columns"].split(",")) for row in table["rows"])
    hands = [row[2:8] for row in tables["Hands"]["rows"]]
    assert hands == [hand.wrench.tolist() for hand in plan.hands]
    loads = np.array([row[-3:] for row in tables["Tiles"]["rows"]])
    np.testing.assert_array_equal(loads, np.vstack([hand.loads for hand in plan.hands]))
    tensions = [row[2] for row in tables["Tendons and their motors"]["rows"]]
    assert tensions == np.concatenate([hand.tensions for hand in plan.hands]).tolist()
    torques = [row[4] for row in tables["Joints, from the body outward"]["rows"]]
    limbs = (plan.joint_torque[limb].tolist() for limb in plan.joints)
    assert torques == [torque for limb in limbs for torque in limb]


@pytest.mark.parametrize(
    ("used", "said"),
    [
        ([0.9, 0.9, 0.9, 0.9], "all four hands"),
        ([0.8, 0.892, 0.9, 0.89], "rear right and rear left"),
        ([0.9, 0.892, 0.895, 0.8], "front right, rear right and rear left"),
        ([0.9, 0.89, 0.8, 0.8], None),
    ],
)
def test_all_hands_that_tie_for_the_largest_utilisation_are_named(used, said):
    question, plan = answered("plain")
    pairs = zip(plan.hands, used, strict=True)
    hands = tuple(replace(hand, utilisation=each) for hand, each in pairs)
    stage = shown_plan(replace(plan, hands=hands), question, Meshes(), brief=True)
    tie = " tie for the largest utilisation, within 1 %"
    assert stage["tied"] == ("" if said is None else said + tie)


def test_joints_that_tie_with_hands_are_named_too():
    question, plan = answered("solved")
    joints = {limb: max(each) for limb, each in joint_utilisations(plan, question.stance).items()}
    worst = max(joints, key=joints.__getitem__)
    hands = [replace(hand, utilisation=0.995 * joints[worst]) for hand in plan.hands]
    stage = shown_plan(replace(plan, hands=hands), question, Meshes(), brief=True)
    assert stage["tied"].startswith(f"all four hands and joints of {worst.replace('_', ' ')}")


def test_without_balance_a_page_says_what_is_in_the_way():
    _, plan, data = shown("infeasible")
    (stage,) = data["stages"]
    assert stage["scene"]["tiles"] == stage["slices"] == []
    (table,) = stage["tables"]
    names = plan.certificate.irreducible or plan.certificate.blocking
    assert [row[0] for row in table["rows"]] == [name.limb.replace("_", " ") for name in names]


def test_a_page_of_a_climb_has_all_stages_and_the_margin_along_them(tmp_path):
    found, file = result(), tmp_path / "route.html"
    write_route_page(found, file)
    data = data_of(file.read_text("utf-8"))
    assert file.stat().st_size < MOST_BYTES
    assert len(data["stages"]) == len(found.stages)
    assert data["crux"] == found.crux
    for stage, plan in zip(data["stages"], found.plans, strict=True):
        assert stage["utilisation"] == plan.utilisation
        assert len(stage["slices"]) == len(plan.hands)
    margins = [stage["limit"] - stage["utilisation"] for stage in data["stages"]]
    assert np.argmin(margins) == data["crux"]
    # what does not move is there once
    first, second = (
        {s["corners"] for s in stage["scene"]["surfaces"] if s["kind"] == "body"}
        for stage in data["stages"][:2]
    )
    assert first == second


def test_a_plan_that_replaces_another_brings_the_meshes_that_it_has():
    question, plan = answered("solved")
    moved = replace(question.stance, body=Pose(question.stance.body.position + 0.01, np.eye(3)))
    moved = replace(question, stance=replace(moved, joints=None))
    page = LivePage("a wall")
    first = data_of(page.document(plan, question, {"handles": {}}))
    kept, scene = first["meshes"][: first["live"]["kept"]], drawn_scene(plan, moved, 5)
    for brief in (True, False):
        update = page.update(plan, moved, brief=brief)
        assert ("slices" in update["stage"]) is not brief
        now = {"meshes": [*kept, *update["meshes"]]}
        bodies = (s for s in update["stage"]["scene"]["surfaces"] if s["kind"] == "body")
        drawn = (s for s in scene.surfaces if s.kind == "body")
        for body, surface in zip(bodies, drawn, strict=True):
            np.testing.assert_allclose(unpacked(now, body), surface.triangles, atol=6e-5)


def test_a_page_loads_nothing_and_ends_no_script_by_its_words(tmp_path):
    question, plan = answered("solved")
    title = "</script><script src='http://example.org/x.js'></script>"
    write_plan_page(plan, question, tmp_path / "plan.html", title)
    text = (tmp_path / "plan.html").read_text("utf-8")
    assert len(text.encode()) < MOST_BYTES
    assert data_of(text)["title"] == title
    assert text.count("<script") == text.count("</script>") == 3
    tags = re.findall(r"<(?:script|link|img|iframe)\b[^>]*>", text)
    assert [tag for tag in tags if re.search(r"src=|href=(?!\"data:)", tag)] == []
    own = re.sub(r"(?s:<script type.*?</script>)|<title>.*?</title>", "", text)
    assert not re.search(r"@import|url\(|https?://", own)


def test_without_the_library_a_page_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly", None)
    monkeypatch.delitem(sys.modules, "plotly.offline", raising=False)
    with pytest.raises(UnsupportedError, match=r"needs plotly.*\[view\]"):
        document("plan", {"stages": [], "meshes": []})


def test_an_advice_is_drawn_from_where_things_are_to_where_they_would_be(tmp_path):
    question, plan = answered("plain")
    stance, hand = question.stance, question.stance.hands[0]
    shift, step = np.array([0.0, 0.05, 0.0]), np.array([0.0, 0.0, 0.02])
    body, palm = Pose(shift, np.eye(3)) @ stance.body, Pose(step, np.eye(3)) @ hand.pose
    changes = {"stance.body": pose_message(body), "stance.hands[0].pose": pose_message(palm)}
    advice = Advice("pair", [hand.limb], "<b>move</b>", changes, 1.0, "optimal", 0.5, None, True)
    advised = replace(plan, advice=(advice,))
    write_plan_page(advised, question, tmp_path / "plan.html", "a wall")
    ((found,),) = (s["advice"] for s in data_of((tmp_path / "plan.html").read_text())["stages"])
    assert (found["sentence"], found["utilisation"], found["holds"]) == ("<b>move</b>", 0.5, True)
    palm, *others, body = found["moves"]
    assert all(each["from"] == each["to"] for each in others)
    assert len(others) == len(plan.hands) - 1
    np.testing.assert_allclose(np.subtract(palm["to"], palm["from"]), [step] * 4, atol=2e-4)
    np.testing.assert_allclose(np.mean(palm["from"], axis=0), hand.pose.position, atol=2e-4)
    np.testing.assert_allclose(body["from"], [stance.body.position], atol=2e-4)
    np.testing.assert_allclose(np.subtract(body["to"], body["from"]), [shift], atol=2e-4)
    after = solve.plan(changed(question, changes))
    used = [f"{each.hands[0].utilisation:.2f}" for each in (plan, after)]
    assert palm["text"] == f"{hand.limb.replace('_', ' ')} {used[0]} → {used[1]}"
    rows = found["table"]["rows"]
    tensions = [np.concatenate([h.tensions for h in each.hands]) for each in (plan, after)]
    np.testing.assert_allclose([row[2:4] for row in rows], np.transpose(tensions))
    assert abs(np.subtract(*tensions)).max() > 1.0
    # a change that has no stance is said, and not drawn
    nowhere = msgspec.structs.replace(advice, changes={"stance.hands[0].seat": "nowhere"})
    write_plan_page(replace(plan, advice=(nowhere,)), question, tmp_path / "plan.html", "a wall")
    ((found,),) = (s["advice"] for s in data_of((tmp_path / "plan.html").read_text())["stages"])
    assert sorted(found) == ["holds", "sentence", "utilisation"]


def meshed(folder, name="part.stl"):
    """A plan of a robot whose foot's mesh is a box 0.3 m from the knee, and its question."""
    shape = f'<origin xyz="-0.1 0 0" rpy="0 0 0"/><geometry><mesh filename="{name}"/></geometry>'
    foot = f'<link name="foot"><visual>{shape}</visual></link>'
    urdf = TWO_LINK.replace('<link name="foot"/>', foot)
    toml = limbs_toml("leg", {"leg": "foot"})
    (folder / "leg.toml").write_text(toml, "utf-8")
    (folder / "leg.urdf").write_text(urdf, "utf-8")
    trimesh.creation.box((0.1, 0.2, 0.4)).export(folder / "part.stl")
    robot = robot_of(RobotFile.load(folder / "leg.toml"))
    question, plan = answered("one limb")
    stance = replace(question.stance, robot=robot)
    return replace(plan, joints={"leg": [0.2, 0.6]}), replace(question, stance=stance)


def test_links_are_drawn_as_the_meshes_of_the_robots_file(tmp_path):
    plan, question = meshed(tmp_path)
    meshes = Meshes()
    scene = scene_data(plan, question, meshes)
    (link,) = (each for each in scene["surfaces"] if each["kind"] == "mesh")
    frame = np.reshape(link["pose"], (3, 4))
    corners = unpacked({"meshes": meshes.packed}, link).reshape(-1, 3) @ frame[:, :3].T
    middle = (corners + frame[:, 3]).mean(axis=0)
    # along the shank, which goes on to the hand
    chain = question.stance.body.apply(question.stance.robot.link_chain(plan.joints, "leg"))
    along = (chain[2] - chain[1]) / np.linalg.norm(chain[2] - chain[1])
    np.testing.assert_allclose(middle, chain[1] + 0.3 * along, atol=1e-3)
    assert [each["kind"] for each in scene["surfaces"]].count("link") == 1
    assert meshes.said == []
    # a page whose plans replace each other keeps the links' meshes
    page = LivePage("a leg")
    brought = page.update(plan, question, brief=True)
    first = data_of(page.document(plan, question, {}))
    (again,) = (s for s in brought["stage"]["scene"]["surfaces"] if s["kind"] == "mesh")
    assert max(again["corners"], again["triangles"]) < first["live"]["kept"]
    kept = first["meshes"][: first["live"]["kept"]]
    found = unpacked({"meshes": [*kept, *brought["meshes"]]}, again)
    np.testing.assert_array_equal(found.reshape(-1, 3) @ frame[:, :3].T, corners)


def test_meshes_of_many_triangles_are_drawn_coarsely_which_is_said(tmp_path, monkeypatch):
    plan, question = meshed(tmp_path)
    settings = replace(scenes.PICTURE_SETTINGS, robot_triangles=8)
    monkeypatch.setattr(scenes, "PICTURE_SETTINGS", settings)
    meshes = Meshes()
    surfaces = scene_data(plan, question, meshes)["surfaces"]
    (link,) = (each for each in surfaces if each["kind"] == "mesh")
    assert len(unpacked({"meshes": meshes.packed}, link)) <= 8
    assert re.fullmatch(r"Links are drawn coarsely, to \d+ mm.", meshes.said[0])


def test_capsules_stand_for_links_whose_meshes_are_not_there(tmp_path):
    plan, question = meshed(tmp_path, "package://elsewhere/part.dae")
    meshes = Meshes()
    kinds = [each["kind"] for each in scene_data(plan, question, meshes)["surfaces"]]
    assert "mesh" not in kinds
    assert kinds.count("link") == 2
    assert "part.dae" in meshes.said[0]


# Slices -------------------------------------------------------------------------------------------


def space(L, s):
    """A wrench space whose loads are the wrench, within L w ≤ s and w ≥ −s of the first rows."""
    rows = tuple(Row(None, None, "shear", "limit", f"{i}") for i in range(len(s)))
    names = tuple(f"{i}" for i in range(6))
    hard = np.zeros((0, 6)), np.zeros(0)
    return WrenchSpace(np.zeros(6), np.eye(6), names, rows, L, np.zeros(len(s)), s, *hard)


def test_a_slice_holds_the_other_components_and_a_projection_frees_them():
    # |w| ≤ 2 each, and fx + my ≤ 2
    L = np.vstack([np.eye(6), -np.eye(6), [[1, 0, 0, 0, 1, 0]]]).astype(float)
    found = wrench_slice(space(L, np.full(13, 2.0)), np.array([0.0, 0.0, 1.0, 0.0, 0.5, 0.0]))
    assert sorted(map(tuple, found.held.round(6))) == [(-2, -2), (-2, 2), (1.5, -2), (1.5, 2)]
    assert sorted(map(tuple, found.whole.round(6))) == [(-2, -2), (-2, 2), (2, -2), (2, 2)]
    assert found.used.tolist() == [0.0, 1.0]


def test_beyond_the_limits_there_is_no_slice():
    L = np.vstack([np.eye(6), -np.eye(6)])
    found = wrench_slice(space(L, np.full(12, 2.0)), np.array([0.0, 0.0, 0.0, 0.0, 3.0, 0.0]))
    assert found.held is None
    assert len(found.whole) == 4


def test_a_hand_that_can_exert_nothing_is_shown_without_outlines(tmp_path):
    question, plan = answered("plain")
    nothing = space(np.vstack([np.eye(6), -np.eye(6)]), np.full(12, 2.0))
    nothing = replace(nothing, l0=np.full(12, 3.0))
    hands = (replace(plan.hands[0], space=nothing), *plan.hands[1:])
    write_plan_page(replace(plan, hands=hands), question, tmp_path / "plan.html", "a wall")
    (stage,) = data_of((tmp_path / "plan.html").read_text("utf-8"))["stages"]
    assert (stage["slices"][0]["held"], stage["slices"][0]["whole"]) == (None, [])
    assert all(len(each["whole"]) > 2 for each in stage["slices"][1:])


def test_corners_of_a_plans_slices_are_wrenches_that_the_hand_can_exert():
    _, plan = answered("plain")
    for hand in plan.hands:
        found = wrench_slice(hand.space, hand.wrench)
        for corner in found.held:
            wrench = hand.wrench.copy()
            wrench[[0, 2]] = corner
            assert hand.space.contains(wrench, tolerance=1e-4)
            beyond = wrench + 1.01 * (wrench - hand.wrench)
            assert not hand.space.contains(beyond, tolerance=1e-4)
