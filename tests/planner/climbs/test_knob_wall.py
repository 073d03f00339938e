"""A climb of several moves on the bundled wall of large knobs, from one stance to another."""

from __future__ import annotations

import numpy as np
import pytest

from hand_models.rock import Mesh
from hand_models.scans import generate_wall
from planner import BodyGrid, PlaceGrid, WallSource, find_climb, plan_climb, robosimian, wall_of
from planner.search import Ends


@pytest.mark.slow
def test_all_limbs_move_on_the_wall_of_large_knobs_and_every_knot_is_verified():
    rock = generate_wall("knob-wall")
    source = WallSource(
        rock=Mesh(rock.vertices, rock.faces, anywhere=True),
        rock_pose=rock.pose,
        robot=robosimian(),
        places=PlaceGrid(spacing=0.2),
        bodies=BodyGrid(spacing=0.2, margin=0.65, stand_offs=(0.6, 0.7)),
    )
    wall = wall_of(source, source.poses()).wall
    origins = np.array([body.position for body in wall.bodies])

    def end(near, members):
        away = np.linalg.norm(origins - near, axis=1)
        return Ends(bodies=np.arange(len(away)) == away.argmin(), members=members)

    start = end((0.597, 0.22, 0.85), (70, 37, 34, 66))
    goal = end((1.288, 0.02, 1.27), (75, 54, 44, 68))
    found = find_climb(wall, start, goal, within=0.3)
    assert found.status == "found"
    limbs = [move.hand.limb for move in found.route.moves]
    assert len(limbs) >= 6
    assert set(limbs) == set(wall.robot.limbs)
    assert all(knot.verified for knot in found.climb.knots)
    assert 1.0 <= found.least <= found.bound
    again = plan_climb(found.route)
    assert (again.failure, len(again.knots)) == (None, len(found.climb.knots))
