"""What there is to see of a plan: hands, rock, limbs and forces, placed in W."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Pose
from hand_models.hand import SettledHand
from planner.pictures.rock_patches import rock_patch
from planner.prepare import settle_hand
from planner.question import HandOnHold, Question, Stance
from planner.result import HandPlan, Plan

__all__ = [
    "UP",
    "DrawnCapsules",
    "DrawnHand",
    "DrawnLimb",
    "DrawnLoad",
    "Scene",
    "ViewDirections",
    "scene_of",
    "view_directions",
]

ARROW: Final = 0.5
"""Length of the longest force arrow in a picture [m]."""

LEANING: Final = 0.3
"""Horizontal part of a direction from which on it says where ahead is."""

UP: Final = np.array([0.0, 0.0, 1.0])
"""In W; and z of a hand."""

STEEP: Final = 0.9
"""Vertical part of the direction into the rock from which on the rock is a ceiling or a floor."""

SAME: Final = 1e-3
"""How far, relatively, a load may be from the robot's weight and still be called so."""


@dataclass(frozen=True, eq=False)
class DrawnHand:
    """A hand on its hold; places in W [m].

    Attributes
    ----------
    limb : str
    floats : bool
        Whether its wrist does.
    place : ndarray, shape (3,)
        Origin of H.
    palm : ndarray, shape (4, 3)
        Corners of the palm.
    fingers : tuple of ndarray, shape (4, 3)
        Joints and tip of each.
    touching : ndarray, shape (n, 3)
        Contacts of tiles and nails that hold.
    rock : ndarray, shape (m, 3, 3)
        Triangles.
    force : ndarray, shape (3,), or None
        Of the rock on the robot, in W [N].
    utilisation : float or None
    """

    limb: str
    floats: bool
    place: Array
    palm: Array
    fingers: tuple[Array, ...]
    touching: Array
    rock: Array
    force: Array | None
    utilisation: float | None


class DrawnLimb(NamedTuple):
    """A limb: its joints and its H in W, shape (n + 1, 3) [m], and each joint's utilisation (n,).

    None for a plan without torques.
    """

    limb: str
    chain: Array
    utilisations: Array | None


class DrawnCapsules(NamedTuple):
    """Capsules: their segments in W, shape (n, 2, 3), and their radii, shape (n,) [m]."""

    ends: Array
    radii: Array


class DrawnLoad(NamedTuple):
    """What the hands hold up: a force at a place, in W [m, N], and a moment about it [N·m].

    ``weight`` tells whether it is the robot's own weight and nothing else.
    """

    place: Array
    force: Array
    moment: Array
    weight: bool


@dataclass(frozen=True, eq=False)
class Scene:
    """All that is drawn of a plan.

    Attributes
    ----------
    body : Pose
        B in W.
    hands : tuple of DrawnHand
    limbs : tuple of DrawnLimb
        Empty where nothing is said of joints.
    body_capsules, link_capsules : DrawnCapsules
        Of what no joint moves, and of the limbs' links where the joints are known; as in the
        robot's parameters.
    torso : ndarray, shape (m, 3, 3)
        Of a robot whose file has no such capsules: triangles of the hull of B and the first joints,
        in W [m].
    load : DrawnLoad
    """

    body: Pose
    hands: tuple[DrawnHand, ...]
    limbs: tuple[DrawnLimb, ...]
    body_capsules: DrawnCapsules
    link_capsules: DrawnCapsules
    torso: Array
    load: DrawnLoad

    @property
    def points(self) -> Array:
        """All places, with the tips of arrows, shape (n, 3) [m]."""
        parts = [
            self.body.position,
            self.load.place,
            self.load.place + self.scale * self.load.force,
        ]
        for hand in self.hands:
            parts += [hand.rock, hand.palm, *hand.fingers]
            if hand.force is not None:
                parts.append(hand.place + self.scale * hand.force)
        parts += [limb.chain for limb in self.limbs]
        for ends, radii in (self.body_capsules, self.link_capsules):
            parts += [ends + side * radii[:, None, None] for side in (-1.0, 1.0)]
        return np.vstack([np.reshape(part, (-1, 3)) for part in parts])

    @property
    def scale(self) -> float:
        """Length of the arrow of a force [m/N]."""
        forces = [self.load.force, *(hand.force for hand in self.hands if hand.force is not None)]
        return ARROW / max(1.0, *(float(np.linalg.norm(force)) for force in forces))


class ViewDirections(NamedTuple):
    """Unit directions in W that are seen from the robot: ahead, and into the rock.

    Attributes
    ----------
    ahead : ndarray, shape (3,)
        Horizontal.
    into : ndarray, shape (3,)
        The mean of the hands' z; ahead where they cancel.
    toward : bool
        Whether the rock is ahead; if not, under a ceiling, on a floor or between walls, −z or x of
        B is.
    steep : bool
        Whether the rock is a ceiling or a floor.
    """

    ahead: Array
    into: Array
    toward: bool
    steep: bool


def view_directions(stance: Stance) -> ViewDirections:
    """Return how a stance is looked at."""
    into = np.mean([hand.pose.rotation[:, 2] for hand in stance.hands], axis=0)
    x, _, z = stance.body.rotation.T
    level = [
        direction - (direction @ UP) * UP for direction in (into, -z, x, np.array([1.0, 0.0, 0.0]))
    ]
    chosen = next(i for i, v in enumerate(level) if np.linalg.norm(v) >= LEANING)
    ahead = level[chosen] / np.linalg.norm(level[chosen])
    length = float(np.linalg.norm(into))
    into = into / length if length >= LEANING else ahead
    return ViewDirections(ahead, into, chosen == 0, bool(abs(into @ UP) >= STEEP))


def scene_of(plan: Plan, question: Question) -> Scene:
    """Return what there is to see of a plan for a question."""
    stance = question.stance
    plans = {hand.limb: hand for hand in plan.hands or ()}
    settled = [settle_hand(hand, stance) for hand in stance.hands]
    rocks = _rocks(stance.hands, settled)
    limbs = _limbs(plan, question)
    body, links = _capsules(plan, stance)
    hull = [stance.body.position, *(limb.chain[0] for limb in limbs)]
    return Scene(
        body=stance.body,
        hands=tuple(
            _hand(hand, known, rock, plans.get(hand.limb))
            for hand, known, rock in zip(stance.hands, settled, rocks, strict=True)
        ),
        limbs=limbs,
        body_capsules=body,
        link_capsules=links,
        torso=np.zeros((0, 3, 3)) if len(body.ends) else _torso(np.array(hull)),
        load=_load(plan, question),
    )


def _rocks(hands: Sequence[HandOnHold], settled: Sequence[SettledHand]) -> list[Array]:
    """Return the rock of each hand in W; that which several hold, with the first."""
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
            rocks.append(np.zeros((0, 3, 3)))
            continue
        there = [hands[j].pose.position for j in range(len(hands)) if j == i or alike(i, j)]
        patch = rock_patch(known, hand.pose.inverse().apply(np.array(there)))
        rocks.append(hand.pose.apply(patch.reshape(-1, 3)).reshape(-1, 3, 3))
    return rocks


def _hand(hand: HandOnHold, settled: SettledHand, rock: Array, plan: HandPlan | None) -> DrawnHand:
    kind = settled.hand
    x, y = np.abs(kind.palm_tiles[:, :2]).max(axis=0) + kind.palm_tile_size / 2.0
    into_world, frames = hand.pose.apply, kind.frames(settled.grasp.outer_rotation)
    return DrawnHand(
        limb=hand.limb,
        floats=hand.wrist == "floating",
        place=hand.pose.position,
        palm=into_world([(x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0), (-x, y, 0.0)]),
        fingers=tuple(
            into_world(frame.joint + finger.chain @ [frame.along, UP])
            for frame, finger in zip(frames, settled.fingers, strict=True)
        ),
        touching=into_world(settled.positions[settled.holding]),
        rock=rock,
        force=None if plan is None else -hand.pose.rotation @ plan.wrench[:3],
        utilisation=None if plan is None else plan.utilisation,
    )


def _limbs(plan: Plan, question: Question) -> tuple[DrawnLimb, ...]:
    if plan.joints is None:
        return ()
    stance, shares = question.stance, plan.joint_shares
    robot = stance.robot
    return tuple(
        DrawnLimb(
            limb,
            stance.body.apply(robot.link_chain(plan.joints, limb)),
            None if shares is None else (robot.chains[limb].coupling != 0.0) @ shares[limb],
        )
        for limb in stance.robot.limbs
    )


def _capsules(plan: Plan, stance: Stance) -> tuple[DrawnCapsules, DrawnCapsules]:
    """Return those of the body, and those of links."""
    robot = stance.robot
    (body, radii), links = robot.body_capsules, np.zeros((0, 2, 3))
    if plan.joints is not None:
        links = robot.placed_capsules(plan.joints)[len(body) :]
    of_links = robot.capsules.radii[len(body) :][: len(links)]

    def placed(ends: Array, widths: Array) -> DrawnCapsules:
        return DrawnCapsules(stance.body.apply(ends.reshape(-1, 3)).reshape(-1, 2, 3), widths)

    return placed(body, radii), placed(links, of_links)


def _torso(points: Array) -> Array:
    """Return the triangles of the hull of points (n, 3), whether it is solid, flat or a line."""
    off = points - points.mean(axis=0)
    axes = np.linalg.svd(off)[2]
    for dimensions in (3, 2):
        try:
            hull = scipy.spatial.ConvexHull(off @ axes[:dimensions].T)
        except (scipy.spatial.QhullError, ValueError):
            continue
        if dimensions == 3:
            return np.asarray(points[hull.simplices])
        first, *others = hull.vertices
        return np.array([points[[first, i, j]] for i, j in pairwise(others)])
    along = off @ axes[0]
    ends = points[[int(along.argmin()), int(along.argmax())]]
    return np.array([(ends[0], ends[1], ends[1])])


def _load(plan: Plan, question: Question) -> DrawnLoad:
    """Return what the hands hold up, at the centre of mass that was planned with."""
    stance, load = question.stance, question.load
    robot, turn = stance.robot, stance.body.rotation
    com = robot.com if plan.joints is None else robot.com_at(plan.joints)
    if question.body_wrench is None and load.com is not None:
        com = np.asarray(load.com)
    force, moment = -plan.body_wrench[:3], -plan.body_wrench[3:]
    moment = moment - np.cross(com, force)
    weight = robot.mass * turn.T @ stance.gravity
    size = SAME * max(float(np.linalg.norm(weight)), 1.0)
    return DrawnLoad(
        place=stance.body.apply(com),
        force=turn @ force,
        moment=turn @ moment,
        weight=bool(
            np.linalg.norm(force - weight) <= size and np.linalg.norm(moment) <= size * robot.reach
        ),
    )
