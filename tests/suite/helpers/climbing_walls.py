"""Small walls to climb, whose tables take a second or two."""

from dataclasses import replace
from functools import cache

import msgspec
import numpy as np

from hand_models.parameters import ParameterTable, wall_table
from hand_models.rock import Mesh
from hand_models.scans import generate_wall
from planner.robots import robosimian
from planner.walls import BodyGrid, PlaceGrid, WallSource, wall_of

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
def _hands_at(question):
    """The answer to a question about points on the rock of `tiny_source`."""
    return tiny_source().answer(question, None)


def asked_once(source, bodies):
    """A way to ask chunks, of which hands at points of the rock are closed once for all walls.

    The source is `tiny_source`, or has placements and bodies of its own besides.
    """

    def ask(questions):
        for question in questions:
            points = msgspec.msgpack.decode(question).get("points")
            yield _hands_at(question) if points else source.answer(question, bodies)

    return ask


def wall_besides(source, bodies):
    """The wall of `tiny_source` with placements and bodies of its own, made in this process."""
    return wall_of(source, bodies, asked_once(source, bodies))


@cache
def tiny_wall():
    """The wall of `tiny_source`, made in this process."""
    source = tiny_source()
    return wall_besides(source, source.poses())
