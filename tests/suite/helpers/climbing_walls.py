"""Small walls to climb, whose tables take a second or two."""

from dataclasses import replace
from functools import cache

import numpy as np

from hand_models.parameters import ParameterTable, wall_table
from hand_models.rock import Mesh
from hand_models.scans import generate_wall
from planner.robots import robosimian
from planner.walls import BodyGrid, PlaceGrid, WallSource

NUMBERS = {"height": 1.5, "width": 1.3, "spacing": 0.02, "knobs": 10.0}
TINY = {"height": 1.25, "width": 1.0}
FLAT = {"roughness": 0.0, "knobs": 0.0}


def changed_wall(**numbers):
    """The numbers of the small wall, with others in their place."""
    entries = {}
    for name, value in numbers.items():
        was = wall_table().quantity("small-wall", name)
        entries[name] = {"value": value, "unit": was.unit, "source": "assumed"}
    return wall_table().replaced(ParameterTable.of({"small-wall": entries}))


def rock_of(seed=0, lean=0.8, **numbers):
    """The mesh of a wall, and its pose."""
    wall = generate_wall("small-wall", seed, lean=lean, table=changed_wall(**NUMBERS | numbers))
    return Mesh(wall.vertices, wall.faces, anywhere=True), wall.pose


def tiny_source(**changes):
    """A wall of 20 points and a few bodies."""
    rock, pose = rock_of(**TINY)
    grids = {
        "places": PlaceGrid(spacing=0.28),
        "bodies": BodyGrid(margin=0.4, stand_offs=(0.35, 0.5)),
    }
    made = WallSource(rock=rock, rock_pose=pose, robot=robosimian(), **grids, together=6)
    return replace(made, **changes)


def arrays_of(wall):
    """All numbers of a wall, as arrays."""
    hands, screening = wall.screening.hands, wall.screening
    poses = [*(place.pose for place in wall.places), *wall.bodies]
    return {
        **vars(wall.reach),
        **{name: getattr(hands, name) for name in hands.__dataclass_fields__},
        **{name: getattr(screening, name) for name in ("wrenches", "moments", "supports")},
        "apart": wall.apart,
        "shifts": wall.shifts,
        "poses": np.array([[*pose.position, *pose.rotation.ravel()] for pose in poses]),
    }


@cache
def tiny_wall():
    """The wall of `tiny_source`, made in this process."""
    from planner.walls import wall_of

    source = tiny_source()
    return wall_of(source, source.poses())
