"""A hold that only this file knows: placed on, planned on, drawn and kept clear of."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from hand_models import Grasp
from hand_models.rock import Cylinder, Edge, Ellipsoid, Hold, Plane, Sphere
from hand_models.rock.shapes import SweptHold
from hand_models.sections import PolylineSection, Swept
from planner.pictures import draw_plan
from planner.pictures.plan_scene import drawn_scene
from planner.prepare.settled_stance import settle_stance
from planner.question import Load, Question
from planner.robots import robosimian
from planner.scene import clearance, scene_of, unit_findings
from planner.solving import plan
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.stances import on_wall
from tests.suite.helpers.stances_with_joints import at_joints

ANGLES = {
    "front_right": np.array([0.2, -0.9, 0.3, 1.2, -0.4, 0.6, 0.1]),
    "rear_left": np.array([-0.3, 0.8, 0.1, -1.1, 0.5, -0.7, 0.4]),
}


@dataclass(frozen=True)
class Ridge(Hold):
    """A rounded ridge along y: z ≥ √((slope x)² + r²) − r; slope [1], radius r of the crest [m].

    It says no more than where lines enter it.
    """

    slope: float = 1.5
    radius: float = 0.34
    shape = "ridge"

    def depth(self, points):
        return points[..., 2] + self.radius - np.hypot(self.slope * points[..., 0], self.radius)

    def section(self, origin, s_axis, t_axis):
        o, s, t = (np.asarray(v, dtype=float) for v in (origin, s_axis, t_axis))
        along = np.linspace(-0.4, 0.4, 801)
        outline = np.array([(u, self.entry(o + u * s, t)) for u in along])
        outline = outline[np.isfinite(outline[:, 1])]
        return PolylineSection([outline]) if len(outline) > 1 else None

    def entry(self, point, direction):
        p, d = np.asarray(point, dtype=float), np.asarray(direction, dtype=float)
        slope, up = self.slope**2, p[2] + self.radius
        a = slope * d[0] ** 2 - d[2] ** 2
        b = slope * p[0] * d[0] - up * d[2]
        c = slope * p[0] ** 2 + self.radius**2 - up**2
        if b * b < a * c:
            return math.inf
        # of a t² + 2 b t + c, without a difference of like numbers
        q = -(b + math.copysign(math.sqrt(b * b - a * c), b))
        roots = [top / low for top, low in ((q, a), (c, q)) if low != 0.0]
        met = [r for r in roots if up + r * d[2] > 0.0]
        entered = [r for r in met if self.depth(p + (r + 1e-6) * d) > 0.0]
        return float(min(entered, default=math.inf))


@dataclass(frozen=True)
class FlatLog(SweptHold):
    """A flattened log along y: a ball scaled along two axes; width along x, thickness [m]."""

    width: float = 0.36
    thickness: float = 0.3
    shape = "flat_log"

    @property
    def largest_sizes(self):
        return {"width": self.width, "thickness": self.thickness}

    @property
    def swept(self):
        a, c = self.width / 2.0, self.thickness / 2.0
        return Swept(1.0 / a, 0.0, 1.0 / c, depth=c, radius=1.0)

    def tangent_point(self, offset, angle):
        a, c = self.width / 2.0, self.thickness / 2.0
        x, z = a * np.sin(angle), -c * np.cos(angle)
        length = np.hypot(x, z)
        return a * x / length, c + c * z / length

    def depth(self, points):
        # to first order, the distance from the surface
        a, c = self.width / 2.0, self.thickness / 2.0
        x, z = points[..., 0] / a, (points[..., 2] - c) / c
        size = np.hypot(x, z)
        return (1.0 - size) * size / np.hypot(x / a, z / c)


HOLDS = [Ridge(), FlatLog()]

KNOWN = [Cylinder(0.3), Sphere(0.3), Ellipsoid((0.3, 0.2, 0.12)), Edge(0.08, 1.7), Plane()]


@pytest.mark.parametrize("hold", HOLDS, ids=lambda hold: hold.shape)
def test_a_hold_of_ones_own_is_placed_on_planned_on_and_drawn(hold):
    settled = HAND.settle(hold, ROCK, Grasp(0.6))
    assert settled.holding.sum() >= 4
    touched = settled.seating.pose.inverse().apply(settled.positions[settled.holding])
    assert np.abs(hold.depth(touched)).max() < 0.01
    light = Load(mass=20.0, com=(0.0, 0.0, 0.0))
    question = Question(on_wall(hold, off=0.45, outer_rotation=0.6), load=light)
    found = plan(question)
    # the outer fingers lie obliquely on the log, which holds them little
    assert found.status == ("overloaded" if isinstance(hold, FlatLog) else "optimal")
    assert found.verified
    surfaces = drawn_scene(found, question).surfaces
    rocks = [len(surface.triangles) for surface in surfaces if surface.kind == "rock"]
    assert len(rocks) == 4
    assert min(rocks) > 50
    draw_plan(found, question)


@pytest.mark.parametrize("hold", [*HOLDS, *KNOWN], ids=lambda hold: hold.shape)
def test_its_surface_is_where_its_rock_begins_and_faces_outward(hold):
    vertices, faces = hold.surface(np.array([-0.4, -0.3, -0.5]), np.array([0.4, 0.3, 0.3]))
    corners = vertices[faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(outward, axis=1)
    large = np.flatnonzero(size > 1e-6)
    assert len(large) >= 2
    for i in large[:: max(1, len(large) // 60)]:
        away, middle = outward[i] / size[i], corners[i].mean(axis=0)
        assert hold.entry(middle + 0.05 * away, -away) == pytest.approx(0.05, abs=5e-3)


@pytest.mark.parametrize("hold", HOLDS, ids=lambda hold: hold.shape)
def test_limbs_are_kept_clear_of_it(hold):
    robot = robosimian()
    stance = at_joints(robot, ANGLES, tuple(ANGLES), hold=hold, outer_rotation=0.6)
    near = clearance(scene_of(stance, settle_stance(stance)), ANGLES).link_rock
    assert np.isfinite(near.distance)
    in_rock, on_link = [], np.linspace(0.0, 1.0, 201)[:, None, None]
    moving = robot.capsules.steps > 0
    ends = robot.placed_capsules(ANGLES)[moving]
    points = ends[:, 0] * (1.0 - on_link) + ends[:, 1] * on_link
    for hand, settled in zip(stance.hands, settle_stance(stance), strict=True):
        in_hold = (hand.pose @ settled.seating.pose).inverse() @ stance.body
        there = in_hold.apply(points.reshape(-1, 3)).reshape(points.shape)
        in_rock.append((hold.depth(there) + robot.capsules.radii[moving]).max())
    # a link's surface that is deep in the rock by some millimetres touches it, and conversely
    assert (max(in_rock) > 0.0) == (near.distance < 0.0)
    if near.distance > 0.0:
        assert near.distance <= -max(in_rock) * 1.5 + 1e-3


def test_its_sizes_are_held_against_the_reach_of_the_limbs():
    question = Question(on_wall(FlatLog(360.0, 300.0), limbs=("front_left",)), load=Load())
    assert [each.field for each in unit_findings(question)] == [
        "stance.hands[0].hold.width",
        "stance.hands[0].hold.thickness",
    ]
    assert unit_findings(Question(on_wall(FlatLog(), limbs=("front_left",)), load=Load())) == ()
