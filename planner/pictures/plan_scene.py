"""Visible parts of a plan as plain data in W: surfaces, lines, dots, arrows and labels.

Each part has a kind, from which a renderer chooses the style. No renderer is imported here.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import SettledHand
from hand_models.rock import Triangles, grid
from planner.pictures.rock_patches import rock_patch
from planner.prepare import settle_hand
from planner.question import HandOnHold, Question, Stance
from planner.result import HandPlan, Plan

__all__ = [
    "WORLD_UP",
    "Arrow",
    "Dots",
    "DrawnScene",
    "DrawnSurface",
    "Label",
    "Line",
    "ViewDirections",
    "drawn_scene",
    "joint_utilisations",
    "view_directions",
]

WORLD_UP: Final = np.array([0.0, 0.0, 1.0])
"""Unit vector up in W; also the z axis of a hand in H."""


class DrawnSurface(NamedTuple):
    """Triangles of one object in world frame W.

    Attributes
    ----------
    kind : {'rock', 'palm', 'body', 'link'}
        All but rock are convex.
    name : str
        Limb whose rock or palm is drawn; empty for the body and links.
    vertices : ndarray, shape (n, 3)
        Corners, in W [m].
    faces : ndarray of int, shape (m, 3)
        Vertex indices of each triangle.
    """

    kind: str
    name: str
    vertices: Array
    faces: Indices

    @property
    def triangles(self) -> Array:
        """Corners of the triangles in world frame W, shape (m, 3, 3) [m]."""
        return np.asarray(self.vertices[self.faces])


class Line(NamedTuple):
    """Polyline in world frame W.

    Attributes
    ----------
    kind : {'finger', 'limb'}
        What the line is: the joints of a finger, or those of a limb.
    points : ndarray, shape (n, 3)
        [m]
    """

    kind: str
    points: Array


class Dots(NamedTuple):
    """Marked points in world frame W.

    Attributes
    ----------
    kind : {'contact', 'joint', 'load', 'origin'}
        Contacts of tiles, joints of a limb, the point where the load acts, or the origin of B.
    points : ndarray, shape (n, 3)
        Marked points, in W [m].
    utilisations : ndarray, shape (n,), or None
        Utilisation of each joint; None for other kinds, and for joints without known torques.
    """

    kind: str
    points: Array
    utilisations: Array | None = None


class Arrow(NamedTuple):
    """Force drawn at a point, with a text at the arrow's tip.

    Attributes
    ----------
    kind : {'force', 'load'}
        ``force``: of the rock on a hand; ``load``: weight or other load that the hands hold.
    start : ndarray, shape (3,)
        Start of the arrow, in world frame W [m].
    force : ndarray, shape (3,)
        The force, in W [N].
    text : str
        Text at the tip, such as the size of the force.
    utilisation : float or None
        Utilisation of the hand; None for the load.
    """

    kind: str
    start: Array
    force: Array
    text: str
    utilisation: float | None = None


class Label(NamedTuple):
    """Text at a point in world frame W.

    Attributes
    ----------
    kind : {'limb', 'origin'}
        Name of a limb at its hand, or of the body frame at its origin.
    place : ndarray, shape (3,)
        The point, in W [m].
    text : str
        Text at the point.
    """

    kind: str
    place: Array
    text: str


@dataclass(frozen=True, eq=False)
class DrawnScene:
    """All visible parts of a plan.

    Attributes
    ----------
    origin : ndarray, shape (3,)
        Origin of body frame B in world frame W [m].
    surfaces : tuple of DrawnSurface
        Rock, palms, body and links.
    lines : tuple of Line
        Fingers and limbs.
    dots : tuple of Dots
        Contacts, joints, and the points of load and origin.
    arrows : tuple of Arrow
        Those of the hands in their order, then that of the load.
    labels : tuple of Label
        Names of the limbs and of the origin.
    """

    origin: Array
    surfaces: tuple[DrawnSurface, ...]
    lines: tuple[Line, ...]
    dots: tuple[Dots, ...]
    arrows: tuple[Arrow, ...]
    labels: tuple[Label, ...]

    @property
    def points(self) -> Array:
        """All points of the scene, with the arrows' tips, in W, shape (n, 3) [m]."""
        parts = [self.origin, *(arrow.start + self.scale * arrow.force for arrow in self.arrows)]
        parts += [surface.vertices for surface in self.surfaces]
        parts += [line.points for line in self.lines] + [dots.points for dots in self.dots]
        return np.vstack([np.reshape(part, (-1, 3)) for part in parts])

    @property
    def scale(self) -> float:
        """Length of an arrow per newton [m/N]; the longest arrow has 0.5 m at most."""
        return 0.5 / max(1.0, *(float(np.linalg.norm(arrow.force)) for arrow in self.arrows))


class ViewDirections(NamedTuple):
    """Directions in which a stance is viewed.

    Attributes
    ----------
    ahead : ndarray, shape (3,)
        Horizontal unit vector in world frame W, toward the rock if ``toward``.
    into : ndarray, shape (3,)
        Unit vector in W into the rock: the mean of the hands' z axes; ``ahead`` where these cancel.
    toward : bool
        Whether the rock is ahead. If not (under a ceiling, on a floor, between walls), ``ahead`` is
        the horizontal part of −z or x of body frame B, or x of W.
    steep : bool
        Whether the rock is a ceiling or a floor.
    """

    ahead: Array
    into: Array
    toward: bool
    steep: bool


def view_directions(stance: Stance) -> ViewDirections:
    """Return the directions in which a stance is viewed: ahead, and into the rock."""
    into = np.mean([hand.pose.rotation[:, 2] for hand in stance.hands], axis=0)
    x, _, z = stance.body.rotation.T
    level = [
        direction - (direction @ WORLD_UP) * WORLD_UP
        for direction in (into, -z, x, np.array([1.0, 0.0, 0.0]))
    ]
    # horizontal part from which on a direction says where ahead is
    enough = 0.3
    chosen = next(i for i, v in enumerate(level) if np.linalg.norm(v) >= enough)
    ahead = level[chosen] / np.linalg.norm(level[chosen])
    length = float(np.linalg.norm(into))
    into = into / length if length >= enough else ahead
    return ViewDirections(ahead, into, chosen == 0, bool(abs(into @ WORLD_UP) >= 0.9))


def drawn_scene(
    plan: Plan,
    question: Question,
    fineness: int = 10,
    without: Collection[int] = (),
    *,
    rock: bool = True,
) -> DrawnScene:
    """Return all visible parts of a plan, in W.

    Parameters
    ----------
    plan : Plan
        Any status; without loads there are no arrows of hands.
    question : Question
        Question that the plan answers.
    fineness : int, optional
        Number of points in half the outline of a capsule's end.
    without : collection of int, optional
        Joints of Pinocchio's model that no capsule is drawn of.
    rock : bool, optional
        False to leave out the rock around the hands.
    """
    stance = question.stance
    settled = [settle_hand(hand, stance) for hand in stance.hands]
    surfaces = _body(plan, stance, fineness, without)
    if rock:
        surfaces += _rocks(stance.hands, settled)
    lines: list[Line] = []
    dots: list[Dots] = []
    labels: list[Label] = []
    for hand, known in zip(stance.hands, settled, strict=True):
        kind, into_world = known.hand, hand.pose.apply
        x, y = np.abs(kind.palm_tiles[:, :2]).max(axis=0) + kind.palm_tile_size / 2.0
        palm = into_world([(x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0), (-x, y, 0.0)])
        surfaces.append(DrawnSurface("palm", hand.limb, palm, np.array([(0, 1, 2), (0, 2, 3)])))
        frames = kind.frames(known.grasp.outer_rotation)
        lines += [
            Line("finger", into_world(frame.joint + finger.chain @ [frame.along, WORLD_UP]))
            for frame, finger in zip(frames, known.fingers, strict=True)
        ]
        dots.append(Dots("contact", into_world(known.positions[known.holding])))
        floats = " (floats)" * (hand.wrist == "floating")
        labels.append(Label("limb", hand.pose.position, hand.limb.replace("_", " ") + floats))
    if plan.joints is not None:
        used, held = joint_utilisations(plan, stance), {hand.limb for hand in stance.hands}
        for limb in stance.robot.limbs:
            chain = stance.body.apply(stance.robot.link_chain(plan.joints, limb))
            lines.append(Line("limb", chain))
            dots.append(Dots("joint", chain[:-1], used.get(limb)))
            if limb not in held:
                labels.append(Label("limb", chain[-1], f"{limb.replace('_', ' ')} (free)"))
    plans = {hand.limb: hand for hand in plan.hands or ()}
    arrows = [_force(hand, plans[hand.limb]) for hand in stance.hands if hand.limb in plans]
    load, origin = _load(plan, question), stance.body.position
    return DrawnScene(
        origin=origin,
        surfaces=tuple(surfaces),
        lines=tuple(lines),
        dots=(*dots, Dots("load", load.start[None]), Dots("origin", origin[None])),
        arrows=(*arrows, load),
        labels=(*labels, Label("origin", origin, "B")),
    )


def joint_utilisations(plan: Plan, stance: Stance) -> dict[str, Array]:
    """Return the utilisation of each joint of a plan, by limb.

    Parameters
    ----------
    plan : Plan
        Plan with or without joint torques.
    stance : Stance
        Stance of the plan.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        The n joints of a limb, from the body outward. Empty for a plan without joint torques.
    """
    shares = plan.joint_shares
    if plan.joints is None or shares is None:
        return {}
    robot = stance.robot
    return {limb: (robot.chains[limb].coupling != 0.0) @ shares[limb] for limb in robot.limbs}


def _rocks(hands: Sequence[HandOnHold], settled: Sequence[SettledHand]) -> list[DrawnSurface]:
    """Return the rock of the hands in W; that which several hold, with the first."""
    placed = [hand.pose @ known.seating.pose for hand, known in zip(hands, settled, strict=True)]

    def alike(i: int, j: int) -> bool:
        return (
            hands[i].hold is hands[j].hold
            and np.allclose(placed[i].position, placed[j].position, atol=1e-6)
            and np.allclose(placed[i].rotation, placed[j].rotation, atol=1e-6)
        )

    rocks = []
    for i, (hand, known) in enumerate(zip(hands, settled, strict=True)):
        if any(alike(i, j) for j in range(i)):
            continue
        there = [other.pose.position for j, other in enumerate(hands) if alike(i, j)]
        patch = rock_patch(known, hand.pose.inverse().apply(np.array(there)))
        corners = hand.pose.apply(patch.reshape(-1, 3))
        apart = np.arange(len(corners)).reshape(-1, 3)
        rocks.append(DrawnSurface("rock", hand.limb, corners, apart))
    return rocks


def _body(
    plan: Plan, stance: Stance, fineness: int, without: Collection[int]
) -> list[DrawnSurface]:
    """Return the capsules of what no joint moves, and of links where the joints are known.

    Of a robot whose file has no capsules of its body, all triangles of B and the first joints.
    """
    robot = stance.robot
    ends, radii = robot.body_capsules
    kinds = ["body"] * len(ends)
    if plan.joints is not None:
        ends, radii = robot.placed_capsules(plan.joints), robot.capsules.radii
        kinds += ["link"] * (len(ends) - len(kinds))
    placed = stance.body.apply(ends.reshape(-1, 3)).reshape(-1, 2, 3)
    parts = zip(kinds, placed, radii.tolist(), robot.capsules.joints, strict=False)
    found = [
        DrawnSurface(kind, "", *_capsule(start, end, radius, fineness))
        for kind, (start, end), radius, joint in parts
        if joint not in without
    ]
    if "body" not in kinds and not without:
        corners = [stance.body.position]
        if plan.joints is not None:
            chains = [robot.link_chain(plan.joints, limb) for limb in robot.limbs]
            corners += [stance.body.apply(chain[0]) for chain in chains]
        between = np.array([*combinations(range(len(corners)), 3)], dtype=np.intp).reshape(-1, 3)
        found.append(DrawnSurface("body", "", np.array(corners), between))
    return found


def _capsule(start: Array, end: Array, radius: float, count: int) -> Triangles:
    """Return a capsule's surface [m], of so many points in half the outline of an end."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length if length else WORLD_UP
    aside = np.linalg.svd(along[None])[2][1]
    across = np.array([aside, np.cross(along, aside)])
    turn, rise = np.linspace(0.0, 2.0 * np.pi, 2 * count + 1), np.linspace(0.0, np.pi / 2.0, count)
    around = np.column_stack([np.cos(turn), np.sin(turn)]) @ across
    half = np.sin(rise)[:, None, None] * around, np.cos(rise)[:, None, None] * along
    beyond, before = half[0] + half[1], (half[0] - half[1])[::-1]
    return grid(np.concatenate([end + radius * beyond, start + radius * before]))


def _force(hand: HandOnHold, planned: HandPlan) -> Arrow:
    """Return the force of the rock on a hand."""
    force = -hand.pose.rotation @ planned.wrench[:3]
    size = f"{np.linalg.norm(force):.0f} N"
    return Arrow("force", hand.pose.position, force, size, planned.utilisation)


def _load(plan: Plan, question: Question) -> Arrow:
    """Return what the hands hold up, at its centre of mass; a weight if it is the robot's own."""
    stance, load = question.stance, question.load
    robot, turn = stance.robot, stance.body.rotation
    com = robot.com if plan.joints is None else robot.com_at(plan.joints)
    if question.body_wrench is None and load.com is not None:
        com = np.asarray(load.com)
    force, moment = -plan.body_wrench[:3], -plan.body_wrench[3:]
    moment = moment - np.cross(com, force)
    weight = robot.mass * turn.T @ stance.gravity
    size, about = 1e-3 * max(float(np.linalg.norm(weight)), 1.0), float(np.linalg.norm(moment))
    own = np.linalg.norm(force - weight) <= size and about <= size * robot.reach
    text = f"{'weight' if own else 'load'} {np.linalg.norm(force):.0f} N"
    if not own and round(about):
        text += f"\nand {about:.0f} N·m"
    return Arrow("load", stance.body.apply(com), turn @ force, text)
