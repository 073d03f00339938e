"""Named stances that the tests share.

The wall carries a frame of its own: x up the wall, y to the climber's left, z out of the wall. The
body frame B and, mirrored, the hand frames H are parallel to it, so places on the wall are (x, y)
pairs in metres and ``off`` is how far the body stands off it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from msgspec import structs
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose, wrench_transport
from hand_models.hand import Grasp, spiny_hand
from hand_models.rock import Cylinder, Edge, Hold, Plane, Sphere
from hand_models.tile import Surface
from planner.prepare import hand_space
from planner.programs import WRENCH_UNIT, HandData, StanceData
from planner.question import HandOnHold, Limits, Load, Question, Stance
from planner.result import Plan
from planner.solving import plan
from service import answering
from service.commands.stances import read_request

PLACES = {
    "front_right": (0.5, -0.4),
    "rear_right": (-0.5, -0.4),
    "rear_left": (-0.5, 0.4),
    "front_left": (0.5, 0.4),
}
"""Of the four hands on the wall, seen from the body [m]."""

ROCK = Surface.named("rock")
SANDPAPER = Surface.named("sandpaper-36")
TILE_60N = Surface.from_values({"shear_limit": 60.0})

CALIBRATION_LOAD = Load(mass=108.0, com=(0.0, 0.0, 0.0))
"""Of the reference stance."""

PALM_TO_WALL = np.diag([1.0, -1.0, -1.0])
"""Axes of H in the frame of the wall."""


def wall(overhang: float = 0.0) -> np.ndarray:
    """Axes of a wall in W; ``overhang`` > 0 leans over the climber, < 0 is a slab [rad]."""
    c, s = math.cos(overhang), math.sin(overhang)
    return np.column_stack([[-s, 0.0, c], [0.0, 1.0, 0.0], [-c, 0.0, -s]])


def on_wall(
    hold: Hold | None = None,
    surface: Surface = ROCK,
    *,
    overhang: float = 0.0,
    off: float = 0.3,
    limbs: tuple[str, ...] = tuple(PLACES),
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81),
    **grasp,
) -> Stance:
    """Hands seated on four like holds of a wall; pinches on 300 mm cylinders by default."""
    hold = Cylinder(0.3) if hold is None else hold
    taken = Grasp(**{"outer_rotation": math.pi, **grasp})
    body = Pose(np.zeros(3), wall(overhang))
    hands = tuple(
        HandOnHold(
            limb,
            body @ Pose(np.array([*PLACES[limb], -off]), PALM_TO_WALL),
            hold,
            surface,
            grasp=taken,
        )
        for limb in limbs
    )
    return Stance(hands, body, gravity=np.array(gravity))


def ask(stance: Stance, *want: str, **kwargs) -> Question:
    """Ask about a stance, by default under the load of the reference stance."""
    if "body_wrench" not in kwargs:
        kwargs.setdefault("load", CALIBRATION_LOAD)
    return Question(stance, want=frozenset(want), **kwargs)


def limited(name: str, wrist: str = "fixed", **limits: object) -> Question:
    """The question of a bundled stance with the same wrist of all hands, and other limits."""
    request = read_request(name)
    hands = [structs.replace(hand, wrist=wrist) for hand in request.stance.hands]
    stance = structs.replace(request.stance, hands=hands)
    return answering.question(structs.replace(request, stance=stance, limits=Limits(**limits)))


def complying(question: Question, limbs: tuple[str, ...] = tuple(PLACES)) -> Question:
    """The same question with compliant wrists on some limbs, without extras."""
    hands = [
        replace(hand, wrist="compliant" if hand.limb in limbs else "fixed")
        for hand in question.stance.hands
    ]
    stance = replace(question.stance, hands=tuple(hands))
    return replace(question, stance=stance, want=frozenset())


def moved(stance: Stance, by: Pose) -> Stance:
    """The same stance elsewhere in the world, gravity turned with it."""
    hands = tuple(replace(hand, pose=by @ hand.pose) for hand in stance.hands)
    return replace(stance, hands=hands, body=by @ stance.body, gravity=by.rotation @ stance.gravity)


def random_hold(rng: np.random.Generator) -> Hold:
    kind = rng.integers(4)
    if kind == 0:
        return Cylinder(rng.uniform(0.15, 1.0))
    if kind == 1:
        return Sphere(rng.uniform(0.2, 1.0))
    if kind == 2:
        return Edge(rng.uniform(0.03, 0.2), rng.uniform(1.2, 2.8))
    return Plane()


def random_surface(rng: np.random.Generator) -> Surface:
    names = ("rock", "concrete-coarse", "concrete-fine", "sandpaper-36")
    surface = Surface.named(str(rng.choice(names)))
    return replace(
        surface,
        shear_limit=surface.shear_limit * rng.uniform(1.0, 1.5),
        compression_gain=float(rng.choice([0.0, 0.3])),
        half_planes=int(rng.choice([1, 2, 5])),
    )


def random_stance(rng: np.random.Generator) -> Stance:
    """One to four hands on random holds of a random wall, anywhere in the world."""
    yaw = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-math.pi, math.pi)]).as_matrix()
    body = Pose(rng.uniform(-5.0, 5.0, 3), yaw @ wall(rng.uniform(-0.6, 0.6)))
    off = rng.uniform(0.15, 0.45)
    limbs = rng.permutation(list(PLACES))[: rng.integers(1, 5)]
    hands = []
    for limb in limbs:
        place = np.array([*PLACES[limb], -off]) + rng.uniform(-0.15, 0.15, 3)
        turn = Rotation.from_rotvec([*rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.6, 0.6)])
        rotation = float(rng.choice([0.0, math.pi, rng.uniform(0.0, math.pi)]))
        closing = None if rng.random() < 0.5 else rng.uniform(20.0, 60.0)
        given = None
        if rng.random() < 0.4:
            # a little off the palm and askew
            askew = Rotation.from_rotvec(rng.uniform(-0.04, 0.04, 3)).as_matrix()
            given = Pose(rng.uniform([-0.03, -0.03, 0.0], [0.03, 0.03, 0.012]), askew)
        hand = HandOnHold(
            str(limb),
            body @ Pose(place, PALM_TO_WALL @ turn.as_matrix()),
            random_hold(rng),
            random_surface(rng),
            hold_in_hand=given,
            grasp=Grasp(rotation, closing, rng.random() < 0.85, rng.random() < 0.85),
        )
        hands.append(hand if possible(hand) else replace(hand, hold_in_hand=None))
    return Stance(tuple(hands), body)


def possible(hand: HandOnHold) -> bool:
    """Whether the rock does not stand in the hand."""
    try:
        spiny_hand().settle(hand.hold, hand.surface, hand.grasp, hand.placed_hold())
    except InvalidInputError:
        return False
    return True


def attainable_wrench(stance: Stance, rng: np.random.Generator) -> np.ndarray:
    """A body wrench that random loads of the stance's hands give (joint stops may not allow it)."""
    body = stance.body.inverse()
    total = np.zeros(6)
    for hand in stance.hands:
        settled, space = hand_space(stance, hand.limb)
        loads = []
        for column in space.columns:
            if column.endswith("/tension"):
                loads.append(settled.closing_tension * rng.uniform(0.9, 2.0))
            elif column.endswith("/lateral"):
                loads.append(rng.uniform(-20.0, 20.0))
            else:
                loads.append(rng.uniform(0.0, 150.0))
        wrench = space.wrench(np.array(loads))
        place = body @ hand.pose
        force = place.rotation @ -wrench[:3]
        total[:3] += force
        total[3:] += place.rotation @ -wrench[3:] + np.cross(place.position, force)
    return total


def random_question(seed: int, *want: str) -> Question:
    """A random stance under its own weight (one in three) or under a wrench that it can balance."""
    rng = np.random.default_rng(seed)
    stance = random_stance(rng)
    if rng.random() < 1.0 / 3.0:
        return Question(stance, want=frozenset(want))
    return Question(stance, body_wrench=attainable_wrench(stance, rng), want=frozenset(want))


@cache
def random_answer(seed: int) -> tuple[Question, Plan]:
    """A random question with all extras and its plan, found once for all tests."""
    question = random_question(seed, "load_factor", "prices")
    return question, plan(question)


def program_data(question: Question) -> StanceData:
    """What the programs get of a question."""
    body = question.stance.body.inverse()
    hands = []
    for hand in question.stance.hands:
        _, space = hand_space(question.stance, hand.limb)
        transport = wrench_transport(body @ hand.pose)
        hands.append(HandData.of(space, transport))
    return StanceData.of(tuple(hands), question.needed_wrench() / WRENCH_UNIT)
