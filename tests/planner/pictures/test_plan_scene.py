"""The body and its limbs in the picture of a plan: as triangles, outlines, and from which side."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.path import Path as MplPath

from hand_models.base import Pose
from planner.pictures import draw_plan
from planner.pictures.plan_scene import drawn_scene, view_directions
from planner.pictures.plan_views import SCENE_STYLES, silhouette
from planner.question import Question
from tests.suite.helpers.pictures import answered, drawn, panels
from tests.suite.helpers.stances import on_wall

# The body ---------------------------------------------------------------------------------------


def outlines(axes):
    """Outlines of the body's capsules in axes of two dimensions, shape (n, k, 2)."""
    (found,) = (
        each
        for each in axes.collections
        if np.allclose(each.get_facecolor()[0], SCENE_STYLES["body"]["facecolor"])
        and len(each.get_edgecolor())
    )
    return np.array([path.vertices[:-1] for path in found.get_paths()])


def triangles(scene, kind):
    """Triangles of a scene's surfaces of a kind."""
    return [surface.triangles for surface in scene.surfaces if surface.kind == kind]


@pytest.mark.parametrize("name", ["solved", "floating", "infeasible"])
def test_the_bodys_capsules_are_drawn_where_they_stand(name):
    question, _ = answered(name)
    ends, radii = question.stance.robot.body_capsules
    corners = outlines(panels(drawn(name))[1])
    # upright, to the right of B is against its y, and up is its x
    flat = ends[..., [1, 0]] * [-1.0, 1.0]
    for spots, segment, radius in zip(corners, flat, radii, strict=True):
        np.testing.assert_allclose(off_segment(spots, segment), radius, rtol=0.02)
        around = [segment.min(axis=0) - radius, segment.max(axis=0) + radius]
        seen = [spots.min(axis=0), spots.max(axis=0)]
        np.testing.assert_allclose(seen, around, atol=0.03 * radius)
    # B itself is within the body as it is drawn
    assert any(MplPath(spots).contains_point((0.0, 0.0)) for spots in corners)


def off_segment(points, segment):
    """How far points (n, d) are from a segment (2, d)."""
    step = segment[1] - segment[0]
    part = (points - segment[0]) @ step / max(float(step @ step), 1e-18)
    nearest = segment[0] + np.clip(part, 0.0, 1.0)[:, None] * step
    return np.linalg.norm(points - nearest, axis=1)


def test_a_scene_has_all_capsules_as_triangles_that_face_outward():
    question, plan = answered("solved")
    robot, body = question.stance.robot, question.stance.body
    ends, radii = robot.placed_capsules(plan.joints), robot.capsules.radii
    scene = drawn_scene(plan, question)
    drawn_capsules = [*triangles(scene, "body"), *triangles(scene, "link")]
    assert len(drawn_capsules) == len(ends)
    for found, segment, radius in zip(drawn_capsules, ends, radii, strict=True):
        corners = body.inverse().apply(found.reshape(-1, 3)).reshape(-1, 3, 3)
        np.testing.assert_allclose(off_segment(corners.reshape(-1, 3), segment), radius)
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        away = corners.mean(axis=1) - segment.mean(axis=0)
        assert ((outward * away).sum(axis=1) >= -1e-15).all()
    question, plan = answered("plain")
    assert plan.joints is None
    assert triangles(drawn_scene(plan, question), "link") == []


def test_the_outline_of_a_convex_surface_is_the_hull_of_how_it_is_seen():
    look = np.array([0.6, 0.0, -0.8])
    across = np.linalg.svd(look[None])[2][1:].T
    corners = np.random.default_rng(0).normal(size=(120, 3))
    seen, flat = silhouette(corners, look) @ across, corners @ across
    hull = MplPath(np.vstack([seen, seen[:1]]))
    assert 3 < len(seen) < 40
    assert hull.contains_points(flat, radius=1e-9).sum() + hull.contains_points(
        flat, radius=-1e-9
    ).sum() >= len(flat)
    # a square seen edge-on is a line between two of its corners
    square = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    line = silhouette(square, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(np.sort(line[:, 0]), [0.0, 1.0])


def test_a_robot_without_capsules_of_its_body_has_the_hull_of_its_shoulders():
    question, plan = answered("two limbs")
    (torso,) = triangles(drawn_scene(plan, question), "body")
    shoulders = [
        question.stance.body.apply(question.stance.robot.link_chain(plan.joints, limb)[0])
        for limb in question.stance.robot.limbs
    ]
    for place in (question.stance.body.position, *shoulders):
        assert np.linalg.norm(torso.reshape(-1, 3) - place, axis=1).min() < 1e-9


def test_a_scene_is_plain_data_of_which_matplotlib_knows_nothing():
    question, plan = answered("solved")
    code = "import sys, planner.pictures.plan_scene; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert done.stdout.strip() == "False"
    scene = drawn_scene(plan, question)
    assert {surface.kind for surface in scene.surfaces} == {"rock", "palm", "body", "link"}
    assert all(surface.triangles.shape[1:] == (3, 3) for surface in scene.surfaces)
    assert [arrow.kind for arrow in scene.arrows] == ["force"] * 4 + ["load"]
    total = sum(arrow.force for arrow in scene.arrows)
    np.testing.assert_allclose(total, 0.0, atol=1e-5 * np.linalg.norm(scene.arrows[-1].force))


# Where it is seen from --------------------------------------------------------------------------


@pytest.mark.parametrize("overhang", [-0.8, 0.0, 0.8])
def test_walls_are_seen_horizontally_toward_the_rock(overhang):
    seen = view_directions(on_wall(overhang=overhang))
    np.testing.assert_allclose(seen.ahead, [1.0, 0.0, 0.0], atol=1e-12)
    assert seen.toward
    assert not seen.steep


def test_ceilings_and_floors_are_seen_from_below_and_above():
    for overhang, height, title in ((math.pi / 2, 1.0, "below"), (-math.pi / 2, -1.0, "above")):
        stance = on_wall(overhang=overhang)
        seen = view_directions(stance)
        np.testing.assert_allclose(seen.into, [0.0, 0.0, height], atol=1e-12)
        assert seen.steep
        assert not seen.toward
        # what is ahead is x of B, and the front hands are farther along it
        np.testing.assert_allclose(seen.ahead, stance.body.rotation[:, 0], atol=1e-12)
        plan = replace(answered("ceiling")[1], hands=None, joints=None)
        facing = draw_plan(plan, Question(stance)).axes[1]
        assert facing.get_title() == f"seen from {title}"
        spots = {note.get_text(): note.xy for note in facing.texts}
        for name, place in (("front left", (-0.4, 0.5)), ("rear right", (0.4, -0.5))):
            np.testing.assert_allclose(spots[name], place, atol=1e-9)


def test_between_two_walls_ahead_is_where_the_belly_looks():
    stance = on_wall()
    turn = np.column_stack([[0.0, 0, 1], [-1.0, 0, 0], [0.0, -1, 0]])
    hands = tuple(
        replace(hand, pose=Pose(hand.pose.position, turn if i % 2 else turn * [1.0, -1.0, -1.0]))
        for i, hand in enumerate(stance.hands)
    )
    seen = view_directions(replace(stance, hands=hands))
    np.testing.assert_allclose(seen.ahead, -stance.body.rotation[:, 2], atol=1e-12)
    assert not seen.toward
    assert not seen.steep
