"""A plan's scene as plain data for the script of a page: meshes, lines, dots, arrows and tiles."""

from __future__ import annotations

from base64 import b64encode
from copy import copy
from typing import Any

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, Pose
from hand_models.rock import Triangles
from planner.pictures import (
    PICTURE_SETTINGS,
    WORLD_UP,
    DrawnSurface,
    coarse,
    drawn_scene,
    view_directions,
)
from planner.question import HandOnHold, Question
from planner.result import HandPlan, Plan
from planner.robots import ROOT_JOINT, LinkMesh, Robot, joint_poses, link_meshes

__all__ = ["Meshes", "rock_stage", "scene_data"]


class Meshes:
    """Surfaces of all scenes of a page, each kept once: most of a climb's do not move.

    Attributes
    ----------
    packed : list of str
        Little-endian numbers in base64: corners in W [m] as 32-bit floats, or indices of the
        triangles' corners as 32-bit integers.
    rock : dict of str to object, or None
        Surface of `of` that all scenes show in place of the rock of their own holds, if any.
    said : list of str
        Sentences about the page, such as how the robot is drawn.
    """

    def __init__(self) -> None:
        self.packed: list[str] = []
        self.rock: dict[str, Any] | None = None
        self.said: list[str] = []
        self._known: dict[str, int] = {}
        self._links: dict[Robot, list[tuple[LinkMesh, dict[str, Any]]]] = {}

    def more(self) -> Meshes:
        """Return these meshes again, to which others can be added without adding them here."""
        found = copy(self)
        found.packed, found._known = list(self.packed), dict(self._known)
        return found

    def index_of(self, numbers: Array | Indices) -> int:
        """Return the place among ``packed`` of corners, or of triangles, shape (n, 3)."""
        whole = np.issubdtype(numbers.dtype, np.integer)
        text = b64encode(numbers.astype("<u4" if whole else "<f4").tobytes()).decode()
        if text not in self._known:
            self._known[text] = len(self.packed)
            self.packed.append(text)
        return self._known[text]

    def of(self, surface: DrawnSurface, into: Array) -> dict[str, Any]:
        """Return a surface with the places of its corners, to a tenth of a millimetre.

        Triangles of rock are ordered along ``into``, shape (3,): those before others hide these
        where the surface is seen through.
        """
        corners, triangles = surface.vertices.round(4), surface.faces
        if surface.kind == "rock":
            triangles = triangles[np.argsort(surface.triangles.mean(axis=1) @ into, kind="stable")]
        if surface.kind in ("rock", "mesh"):
            corners, inverse = np.unique(corners, axis=0, return_inverse=True)
            triangles = inverse.ravel()[triangles]
        return {
            "kind": surface.kind,
            "limb": surface.name,
            "corners": self.index_of(corners),
            "triangles": self.index_of(triangles),
        }

    def links_of(self, robot: Robot) -> list[tuple[LinkMesh, dict[str, Any]]]:
        """Return the meshes of a robot's links, each with its surface; none if none can be read.

        Many triangles are drawn coarsely, which is then said, so that the page stays small.
        """
        if robot not in self._links:
            try:
                found = link_meshes(robot)
            except InvalidInputError as error:
                self.said.append(f"Capsules stand for the links: {error}")
                found = []
            drawn = {each.file: each.triangles for each in found}
            cell, most = 0.0, PICTURE_SETTINGS.robot_triangles
            while sum(len(each.faces) for each in drawn.values()) > most:
                cell = 1.5 * cell or PICTURE_SETTINGS.link_cell
                drawn = {key: coarse(each, cell) for key, each in drawn.items()}
            if cell:
                self.said.append(f"Links are drawn coarsely, to {1e3 * cell:.0f} mm.")
            shown = (drawn[each.file] for each in found)
            surfaces = [self.of(DrawnSurface("mesh", "", *each), WORLD_UP) for each in shown]
            self._links[robot] = list(zip(found, surfaces, strict=True))
        return self._links[robot]


def rock_stage(rock: Triangles, pose: Pose, meshes: Meshes, **more: Any) -> dict[str, Any]:
    """Return a stage of a page that has rock alone, with ``more`` of its fields.

    The rock, coarsely if it has many triangles, becomes that of all scenes of the page. Its frame
    has x up the rock and z into it; ``pose`` is that frame in the frame of the page.
    """
    up, across, into = pose.rotation.T
    if len(rock.faces) > PICTURE_SETTINGS.wall_triangles:
        extent = float(np.ptp(rock.vertices, axis=0).max())
        rock = coarse(rock, extent / PICTURE_SETTINGS.wall_cells)
    meshes.rock = meshes.of(DrawnSurface("rock", "", pose.apply(rock.vertices), rock.faces), into)
    eyes = {"oblique": 0.6 * across - 0.8 * into, "facing the rock": -into}
    views = {name: {"eye": eye.tolist(), "up": up.tolist()} for name, eye in eyes.items()}
    scene: dict[str, Any] = {"lines": [], "dots": [], "arrows": [], "labels": [], "tiles": []}
    scene |= {"surfaces": [meshes.rock], "views": views}
    return {"name": "", "sentence": "", "scene": scene} | more


def scene_data(
    plan: Plan, question: Question, meshes: Meshes, *, rock: bool = True
) -> dict[str, Any]:
    """Return the scene of a plan, with its tiles, as plain data in W.

    Parameters
    ----------
    plan : Plan
        Any status; without loads there are no tiles and no forces of hands.
    question : Question
        Question that the plan answers.
    meshes : Meshes
        Meshes of the page, to which those of the scene are added.
    rock : bool, optional
        False to leave out the rock of the hands.

    Returns
    -------
    dict of str to object
        ``surfaces``, ``lines``, ``dots``, ``arrows`` and ``labels`` of the `DrawnScene`; ``tiles``
        of the plan; ``views``: unit vectors from the scene to the eye and upward, in W, by name.
    """
    stance = question.stance
    links = meshes.links_of(stance.robot)
    own_rock = rock and meshes.rock is None
    scene = drawn_scene(plan, question, 5, {link.joint for link, _ in links}, rock=own_rock)
    seen = view_directions(stance)
    aside = np.cross(seen.ahead, WORLD_UP)
    eyes = {
        "oblique": -seen.into - 0.3 * seen.ahead * seen.steep + 0.6 * aside,
        "facing the rock": -seen.into,
        "from the side": aside,
    }
    hands = {hand.limb: hand for hand in stance.hands}
    joints = joint_poses(stance.robot, plan.joints or {})
    surfaces = [
        meshes.of(each, hands[each.name].pose.rotation[:, 2] if each.name else seen.into)
        for each in scene.surfaces
        if len(each.faces)
    ]
    for link, surface in links:
        # where the joints are not known, only what none moves
        if plan.joints is not None or link.joint == ROOT_JOINT:
            pose = stance.body @ joints[link.joint] @ link.pose
            moved = np.column_stack([pose.rotation, pose.position]).round(5)
            surfaces.append(surface | {"pose": moved.ravel().tolist()})
    return {
        "surfaces": surfaces if meshes.rock is None else [*surfaces, meshes.rock],
        "lines": [{"kind": line.kind, "points": _places(line.points)} for line in scene.lines],
        "dots": [
            {"kind": dots.kind, "points": _places(dots.points), "used": _used(dots.utilisations)}
            for dots in scene.dots
        ],
        "arrows": [
            {
                "kind": arrow.kind,
                "start": _places(arrow.start),
                "tip": _places(arrow.start + scene.scale * arrow.force),
                "force": arrow.force.round(1).tolist(),
                "text": arrow.text,
                "used": arrow.utilisation,
            }
            for arrow in scene.arrows
        ],
        "labels": [{"place": _places(each.place), "text": each.text} for each in scene.labels],
        "tiles": [
            tile
            for planned in plan.hands or ()
            for tile in _tiles(planned, hands[planned.limb], question, scene.scale)
        ],
        "views": {
            name: {
                "eye": _places(eye / np.linalg.norm(eye)),
                "up": _places(seen.ahead if seen.steep and eye is not aside else WORLD_UP),
            }
            for name, eye in eyes.items()
        },
    }


def _tiles(
    planned: HandPlan, hand: HandOnHold, question: Question, scale: float
) -> list[dict[str, Any]]:
    """Return the tiles of a hand that touch rock: corners, forces of the rock on them, words."""
    turn, size = hand.pose.rotation, question.stance.robot.hand.finger
    half = 0.5 * np.array([size.tile_length, size.tile_width])
    found = []
    for t, tile in enumerate(planned.tiles):
        if tile.contact == "none":
            continue
        shear, normal, lateral = planned.loads[t].tolist()
        along, across = planned.axes[t, [0, 2]] * half[:, None]
        middle, force = planned.positions[t], -turn @ planned.forces[t]
        corners = middle + np.array([along + across, along - across, -along - across])
        corners = np.vstack([corners, middle - along + across])
        start = hand.pose.apply(middle)
        found.append(
            {
                "limb": planned.limb,
                "finger": tile.finger,
                "phalanx": tile.phalanx,
                "corners": _places(hand.pose.apply(corners)),
                "start": _places(start),
                "tip": _places(start + scale * force),
                "used": float(planned.tile_utilisations[t]),
                "shear": shear,
                "normal": normal,
                "lateral": lateral,
            }
        )
    return found


def _places(points: Array) -> Any:
    """Return points as lists, to a tenth of a millimetre."""
    return np.asarray(points).round(4).tolist()


def _used(utilisations: Array | None) -> list[float] | None:
    return None if utilisations is None else utilisations.round(4).tolist()
