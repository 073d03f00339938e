"""Where the centre of mass may be: against plans, another solver, and frames moved or mirrored."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from msgspec import UNSET, structs
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from hand_models.base import InvalidInputError, Pose, turns_about
from planner import deadline
from planner.capability import BodySpace, ComRegion, ComSolid, com_region, com_solid
from planner.pictures.com_plots import draw_com_region
from planner.question import Limits, Load, Question
from planner.robots import Payload
from planner.solving import plan
from service.answering import dispatch, planned, questions
from service.commands.cli import run_command_line
from service.commands.stances import read_request
from tests.suite.helpers import peer
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result
from tests.suite.helpers.replies import PLAN, departures, refusal
from tests.suite.helpers.requests import plan_request, wall_request
from tests.suite.helpers.stances import on_wall

KEY = "crux/robosimian/body_space"


@cache
def bundled(name: str) -> Question:
    return questions.question(read_request(name)).bare()


@cache
def region_of(name: str) -> ComRegion:
    return com_region(BodySpace(bundled(name)))


def planned_at(question: Question, point_in_world: np.ndarray) -> bool:
    """Whether a plan holds a centre of mass at a point of W."""
    com = tuple(question.stance.body.inverse().apply(point_in_world).tolist())
    moved = replace(question, load=structs.replace(question.load, com=com), explain=False)
    return plan(moved).status == "optimal"


def border_of_plans(question: Question, region: ComRegion, angle: float) -> float:
    """Farthest shift from the region's middle at which a plan holds, by halving [m]."""
    middle = region.polygon.inner.mean(axis=0)
    way = np.array([np.cos(angle), np.sin(angle)])
    held, lost = 0.0, 3.0
    while lost - held > 1e-4:
        half = 0.5 * (held + lost)
        point = (middle + half * way) @ region.axes + 0.7 * region.up
        held, lost = (half, lost) if planned_at(question, point) else (held, half)
    return 0.5 * (held + lost)


def border_of(region: ComRegion, polygon: np.ndarray, angle: float) -> float:
    """Farthest shift from the region's middle within a polygon [m]."""
    middle = region.polygon.inner.mean(axis=0)
    facets = ConvexHull(polygon).equations
    speed = facets[:, :2] @ [np.cos(angle), np.sin(angle)]
    room = -(facets[:, :2] @ middle + facets[:, 2])
    return float(np.min(room[speed > 1e-12] / speed[speed > 1e-12]))


@pytest.mark.parametrize("name", ["wall-300-joints", "boulders"])
def test_its_border_is_that_of_plans(name):
    check_border(name, np.linspace(0.1, 2.0 * np.pi + 0.1, 3, endpoint=False))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wall-300", "wall-300-joints", "slab", "overhang", "wall"])
def test_its_border_is_that_of_plans_all_around(name):
    check_border(name, np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))


def check_border(name: str, angles: np.ndarray) -> None:
    question, region = bundled(name), region_of(name)
    width = float(np.ptp(region.polygon.outer, axis=0).max())
    assert region.polygon.gap <= 0.001 * width
    for angle in angles:
        scanned = border_of_plans(question, region, angle)
        inner = border_of(region, region.polygon.inner, angle)
        outer = border_of(region, region.polygon.outer, angle)
        # a plan's utilisation may be 0.1 % above the least: half a millimetre of the border
        assert inner - 5e-4 <= scanned <= outer + 2e-4
        assert outer - inner <= 0.005 * width
        assert abs(scanned - inner) <= 0.005 * width


def test_each_corner_is_the_farthest_of_another_solver():
    question = Question(on_wall(), load=Load(80.0, (0.0, 0.0, 0.05)))
    region = com_region(BodySpace(question))
    rows = peer.rows(question)
    n = rows.L.shape[1]
    stance = question.stance
    force = 80.0 * stance.body.rotation.T @ -np.array(stance.gravity)
    at_origin = np.concatenate([force, np.zeros(3)])
    # c × F, by hand, for a shift by one metre along each axis
    columns = np.array(
        [np.concatenate([np.zeros(3), np.cross(stance.body.rotation.T @ axis, force)])
         for axis in region.axes]
    ).T  # fmt: skip
    origin = region.axes @ stance.body.position
    for angle in np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False):
        goal = np.array([np.cos(angle), np.sin(angle)])
        found = peer.solve(
            np.concatenate([np.zeros(n), -goal]),
            np.pad(np.vstack([rows.L, rows.H]), ((0, 0), (0, 2))),
            np.concatenate([rows.s - rows.l0, rows.h]),
            np.hstack([rows.B, -columns]),
            at_origin - rows.b,
        )
        reach = goal @ origin - found.fun
        inner, outer = (np.max(each @ goal) for each in _polygons(region))
        assert inner - 1e-5 <= reach <= outer + 1e-5
        assert outer - inner <= region.polygon.gap + 1e-9


def _polygons(region: ComRegion) -> tuple[np.ndarray, np.ndarray]:
    return region.polygon.inner, region.polygon.outer


def width_in(region: ComRegion, way: np.ndarray) -> np.ndarray:
    """Extent along a direction of W, least and largest."""
    along = region.polygon.inner @ (region.axes @ way)
    return np.array([along.min(), along.max()])


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_it_moves_with_the_world(seed):
    rng = np.random.default_rng(seed)
    question, region = bundled("slab"), region_of("slab")
    by = Pose(rng.uniform(-5.0, 5.0, 3), turns_about(rng.normal(size=3)))
    stance = question.stance
    moved = replace(
        stance,
        gravity=by.rotation @ stance.gravity,
        body=by @ stance.body,
        hands=tuple(replace(hand, pose=by @ hand.pose) for hand in stance.hands),
    )
    found = com_region(BodySpace(replace(question, stance=moved)))
    np.testing.assert_allclose(found.up, by.rotation @ region.up, atol=1e-9)
    np.testing.assert_allclose(found.com, by.apply(region.com), atol=1e-9)
    np.testing.assert_allclose(found.margin, region.margin, atol=1e-3)
    # the same points: those of one are within the other, but for the gaps
    way = region.axes[0] * 0.6 + region.axes[1] * 0.8
    offset = (by.rotation @ way) @ by.position
    np.testing.assert_allclose(
        width_in(found, by.rotation @ way), width_in(region, way) + offset, atol=1e-3
    )


def test_a_mirrored_stance_has_a_mirrored_region_and_the_order_of_hands_does_not_matter():
    # four pinches of a wall, alike on both sides of its plane x-z
    question = bundled("wall-300")
    low, high = width_in(region_of("wall-300"), np.array([0.0, 1.0, 0.0]))
    assert low == pytest.approx(-high, abs=1e-3)
    stance = question.stance
    turned = replace(question, stance=replace(stance, hands=stance.hands[::-1]))
    found = com_region(BodySpace(turned))
    for way in (*np.eye(3)[:2], np.array([0.6, -0.8, 0.0])):
        np.testing.assert_allclose(
            width_in(found, way), width_in(region_of("wall-300"), way), atol=1e-3
        )


def test_limits_shrink_it_and_a_lighter_body_widens_it():
    question = bundled("wall-300")
    area = {
        name: ConvexHull(com_region(BodySpace(each)).polygon.inner).volume
        for name, each in {
            "whole": question,
            "capped": replace(question, limits=Limits(utilisation=0.98)),
            "light": replace(question, load=Load(mass=60.0)),
            "laden": replace(question, load=Load(payloads=(Payload(10.0, link="torso"),))),
        }.items()
    }
    assert area["capped"] < area["whole"] < area["light"]
    assert area["laden"] < area["whole"]


def test_acceleration_tilts_the_prism():
    question = replace(bundled("slab"), load=Load(acceleration=(1.0, 0.0, 0.0)))
    region = com_region(BodySpace(question))
    expected = np.array([1.0, 0.0, 9.81])
    np.testing.assert_allclose(region.up, expected / np.linalg.norm(expected), atol=1e-6)
    corner = region.polygon.inner[0] @ region.axes
    inside = 0.99 * corner + 0.01 * (region.polygon.inner.mean(axis=0) @ region.axes)
    beyond = 1.01 * corner - 0.01 * (region.polygon.inner.mean(axis=0) @ region.axes)
    for height in (-0.5, 0.0, 0.8):
        assert planned_at(question, inside + height * region.up)
        assert not planned_at(question, beyond + height * region.up)


def test_under_several_accelerations_it_is_a_solid_that_plans_confirm():
    question = bundled("slab")
    shakes = np.vstack([1.5 * np.eye(3), -1.5 * np.eye(3)])
    solid = com_solid(question, shakes)
    np.testing.assert_array_equal(solid.accelerations, [[0.0, 0.0, 0.0], *shakes])
    width = np.ptp(solid.inner[:, :2], axis=0).max()
    assert solid.gap <= 0.01 * width
    middle = solid.inner.mean(axis=0)

    def held(point: np.ndarray) -> list[bool]:
        return [
            planned_at(replace(question, load=Load(acceleration=tuple(each.tolist()))), point)
            for each in solid.accelerations
        ]

    rng = np.random.default_rng(3)
    for _ in range(2):
        inside = rng.dirichlet(np.full(len(solid.inner), 0.05)) @ solid.inner
        assert all(held(middle + 0.995 * (inside - middle)))
    # through the middle of a facet, and beyond
    facets = ConvexHull(solid.outer).equations
    for way in facets[:: len(facets) // 3, :3]:
        speed = facets[:, :3] @ way
        room = -(facets[:, :3] @ middle + facets[:, 3])
        reach = np.min(room[speed > 1e-9] / speed[speed > 1e-9])
        assert not all(held(middle + (reach + 0.005 * width) * way))


@cache
def shaken(by: float) -> tuple[ComRegion, ComSolid | None]:
    """Region of ``wall-300``, and its solid under shaking [m/s²]."""
    return region_of("wall-300"), com_solid(
        bundled("wall-300"), np.vstack([by * np.eye(3), -by * np.eye(3)])
    )


@pytest.mark.parametrize(
    ("by", "inside"), [(0.2, True), pytest.param(0.5, False, marks=pytest.mark.slow)]
)
def test_the_solids_margin_is_the_distance_to_its_surface(by, inside):
    region, solid = shaken(by)
    facets = ConvexHull(solid.inner).equations
    farthest = np.max(facets[:, :3] @ region.com + facets[:, 3])
    assert (farthest < 0.0) == inside
    # the nearest mixture of the vertices, its weights of sum 1
    many = np.full((1, len(solid.inner)), 1e3)
    distance = nnls(
        np.vstack([(solid.inner - region.com).T, many]), [0, 0, 0, 1e3], maxiter=10_000
    )[1]
    assert solid.margin == pytest.approx(-farthest if inside else -distance, abs=1e-6)


def test_the_section_is_the_solid_at_the_height_of_the_centre_of_mass():
    region, solid = shaken(0.5)
    section = solid.section(region)
    facets = ConvexHull(solid.inner).equations
    there = section @ region.axes + (region.com @ region.up) * region.up
    # each corner is on the surface, and between two of them is inside
    reach = np.max(there @ facets[:, :3].T + facets[:, 3], axis=1)
    np.testing.assert_allclose(reach, 0.0, atol=1e-6)
    rim = ConvexHull(region.polygon.inner).equations
    assert np.max(section @ rim[:, :2].T + rim[:, 2]) < 1e-6
    above = replace(region, com=region.com + 100.0 * region.up)
    assert solid.section(above) is None


def test_the_picture_has_the_section_beside_the_region():
    region, solid = shaken(0.5)
    space = BodySpace(bundled("wall-300"))

    def drawn(*solids: object) -> tuple[list[str], str]:
        figure = draw_com_region(space, region, "wall-300", *solids)
        return figure.axes[0].get_legend_handles_labels()[1], figure.get_suptitle()

    label = "held under 7 accelerations, at its height"
    names, title = drawn(solid, 7)
    assert label in names
    assert f"{-1e3 * solid.margin:.0f} mm outside the solid" in title
    names, title = drawn(None, 7)
    assert label not in names
    assert "nothing is held under these 7 accelerations" in title
    assert "accelerations" not in drawn()[1]


@pytest.mark.parametrize("shift", [-0.06, -0.04, -0.02, 0.02, 0.04, 0.06])
def test_no_label_lies_on_the_centre_of_mass_and_axes_have_their_names(shift):
    space, region = BodySpace(bundled("slab")), region_of("slab")
    hand = space.question.stance.hands[0].pose.position
    beside = replace(region, com=hand + shift * region.axes[1])
    figure = draw_com_region(space, beside, "slab")
    figure.draw_without_rendering()
    (axes,) = figure.axes
    at = axes.transData.transform(region.axes @ beside.com)
    boxes = [label.get_window_extent() for label in axes.texts]
    assert len(boxes) == 4
    assert not any(box.padded(3.0).contains(*at) for box in boxes)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("+x of W [m]", "+y of W [m]")


def test_other_directions_are_written_out():
    question = replace(bundled("slab"), load=Load(acceleration=(0.0, 1.0, 0.0)))
    space = BodySpace(question)
    (axes,) = draw_com_region(space, com_region(space), "slab").axes
    assert axes.get_xlabel() == "+x of W [m]"
    assert re.fullmatch(r"along \(0, 0\.99\d*, -0\.1\d*\) of W \[m\]", axes.get_ylabel())


@pytest.mark.parametrize(
    ("shake", "told"),
    [
        ("0.5", r"shaken: \d+ mm outside the solid that is held under these 7 accelerations"),
        ("50", "shaken: nothing is held under these 7 accelerations"),
    ],
)
def test_a_stance_that_falls_when_shaken_ends_with_3(shake, told, capfd, tmp_path):
    arguments = ["body-space", "wall-300", "--com", "--shake", shake]
    assert run_command_line([*arguments, "--plot", str(tmp_path / "com.svg")]) == OVERLOADED
    assert re.search(told, " ".join(capfd.readouterr().out.split()))


def test_a_solid_needs_accelerations_across_gravity_and_room():
    with pytest.raises(InvalidInputError, match="no end in height") as caught:
        com_solid(bundled("slab"), [[0.0, 0.0, 1.0]])
    assert caught.value.field == "com_accelerations"
    assert com_solid(bundled("wall-300"), [[40.0, 0.0, 0.0], [-40.0, 0.0, 0.0]]) is None
    request = {"v": 1, "stance": wall_request()["stance"], "com_accelerations": [[1, 0, 0]]}
    assert refusal(request, KEY)[:2] == ("invalid", "com_accelerations")


def test_the_margin_is_the_distance_to_the_border():
    region = region_of("slab")
    point = region.axes @ region.com
    facets = ConvexHull(region.polygon.inner).equations
    distance = -np.max(facets[:, :2] @ point + facets[:, 2])
    assert region.margin == pytest.approx(distance, abs=1e-9)
    assert region_of("boulders").margin < 0.0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"body_wrench": [0.0] * 6, "load": None}, "body_wrench"),
        ({"load": {"acceleration": [0.0, 0.0, -9.81]}}, "load.acceleration"),
    ],
)
def test_without_weight_there_is_none(change, field):
    request = wall_request() | change | {"want": ["com_region"]}
    if request["load"] is None:
        del request["load"]
    else:
        request["stance"]["gravity"] = [0.0, 0.0, -9.81]
    assert refusal(request)[:2] == ("invalid", field)


def test_an_angular_acceleration_is_refused():
    question = replace(bundled("wall-300-joints"), load=Load(angular_acceleration=(0.1, 0.0, 0.0)))
    with pytest.raises(InvalidInputError) as caught:
        com_region(BodySpace(question))
    assert caught.value.field == "load.angular_acceleration"


def test_a_plan_and_the_command_tell_it(capfd, tmp_path):
    request = wall_request(50.0) | {"want": ["com_region"]}
    answer = dispatch.handle(PLAN, json.dumps(request).encode())
    told = json.loads(answer.payload)
    assert departures("PlanReply", told) == []
    region = told["com_region"]
    path = tmp_path / "stance.json"
    path.write_text(json.dumps(request))
    picture = tmp_path / "com.png"
    arguments = ["body-space", str(path), "--com", "--json", "--plot", str(picture)]
    assert run_command_line(arguments) == DONE
    again = result(capfd)
    assert departures("BodySpaceReply", again) == []
    assert again["com_region"] == region
    assert region["exact"]
    assert region["margin"] > 0.0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run_command_line(["body-space", str(path), "--com"]) == DONE
    printed = " ".join(capfd.readouterr().out.split())
    assert f"{1e3 * region['margin']:.0f} mm within its border" in printed
    assert run_command_line(["body-space", str(path), "--com", "--shake", "0.3", "--json"]) == DONE
    solid = result(capfd)["com_region"]["solid"]
    assert len(solid["accelerations"]) == 7
    assert solid["margin"] > 0.0
    assert solid["gap"] < 0.02
    assert run_command_line(["body-space", str(path), "--shake", "0.3"]) == BAD_INPUT
    assert "--shake requires --com" in complaint(capfd)


@pytest.mark.parametrize(
    "given", [["--axes", "fx,fy"], ["--axes", "fx,fz"], ["--projection"], ["--pure"]]
)
def test_what_chooses_a_plane_of_wrenches_is_refused(given, capfd):
    assert run_command_line(["body-space", "slab", "--com", *given]) == BAD_INPUT
    assert f"{given[0]} is of a plane of body wrenches: not with --com" in complaint(capfd)


def test_a_deadline_leaves_it_out(monkeypatch):
    answer = planned(plan_request())
    with deadline.within(1e-9):
        monkeypatch.setattr("service.answering.dispatch.planner.plan", lambda _: answer.plan)
        found = planned(plan_request(wall_request() | {"want": ["com_region"]}))
    assert found.reply.unfinished == ["com_region"]
    assert found.reply.com_region is UNSET
    late = "the deadline of 1e-09 s expired before it was found where the centre of mass may be"
    assert found.reply.warnings[-1] == late
    wrenches = [[hand.wrench for hand in each.reply.hands] for each in (found, answer)]
    assert wrenches[0] == wrenches[1]
