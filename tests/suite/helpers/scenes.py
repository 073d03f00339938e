"""Stances that are meant, and the same with the slips that people make."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from msgspec import structs
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.hand import Grasp
from hand_models.rock import Cylinder, Edge, Ellipsoid, Hold, Mesh, Plane, Profile, Sphere
from hand_models.tile import Surface
from planner.prepare.settled_stance import settle_stance
from planner.question import HandOnHold, Question, Stance
from planner.result import Finding
from planner.scene import findings, scene_of, unit_findings
from tests.suite.helpers.stances import PALM_TO_WALL, PLACES, ROCK, on_wall, possible, wall

GRAVITIES = ((0.0, 0.0, -9.81), (0.0, 0.0, -1.62), (0.0, 0.0, -3.71))
"""Of the Earth, the Moon and Mars [m/s²]."""

SMALL_BODIES = (
    0.0,
    1e-5,
    5.7e-3,
    0.064,
    0.113,
    0.22,
    0.288,
    0.62,
    0.78,
    1.236,
    1.315,
    1.352,
    1.796,
)
"""Gravity on none, Bennu, Phobos, Mimas, Enceladus, Vesta, Ceres, Pluto, Triton, Callisto, Europa,
Titan and Io [m/s²]."""

LEANS = (-math.pi / 2.0, -1.2, -0.5, 0.0, 0.3, 0.9, math.pi / 2.0)
"""Of walls, from level ground to a ceiling [rad]."""

TWIN = {"left": "right", "right": "left"}

GRASPS = (
    Grasp(0.0),
    Grasp(math.pi / 2.0),
    Grasp(math.pi),
    Grasp(2.0),
    Grasp(0.0, palm=False, lateral=False),
    Grasp(fingernail=True),
)


def look(stance: Stance) -> tuple[Finding, ...]:
    """What is odd about a stance, its numbers included."""
    return (*findings(scene_of(stance, settle_stance(stance))), *unit_findings(Question(stance)))


def kinds(stance: Stance) -> set[str]:
    return {finding.kind for finding in look(stance)}


def _bumpy() -> Mesh:
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 13), np.linspace(-0.3, 0.3, 13), indexing="ij")
    z = 0.4 * (x**2 + y**2) + 0.004 * np.cos(23.0 * x) * np.cos(19.0 * y) - 0.004
    place = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (
        p.ravel() for p in (place[:-1, :-1], place[1:, :-1], place[:-1, 1:], place[1:, 1:])
    )
    faces = np.vstack([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    return Mesh(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces)


HOLDS: tuple[Hold, ...] = (
    Plane(),
    Cylinder(0.2),
    Cylinder(0.3),
    Cylinder(0.7),
    Sphere(0.25),
    Sphere(0.6),
    Ellipsoid((0.14, 0.2, 0.12)),
    Edge(0.05, math.pi / 2.0),
    Edge(0.15, 2.4),
    Profile([[-0.3, 0.1], [-0.1, 0.01], [0.0, 0.0], [0.1, 0.012], [0.3, 0.1]]),
    _bumpy(),
)


def on_any_wall(rng: np.random.Generator) -> Stance:
    """Two to four hands on like or different holds of a wall that leans, a little out of line."""
    lean = rng.choice(LEANS) + rng.uniform(-0.05, 0.05)
    limbs = rng.permutation(list(PLACES))[: rng.integers(2, 5)]
    yaw = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-math.pi, math.pi)]).as_matrix()
    body = Pose(rng.uniform(-5.0, 5.0, 3), yaw @ wall(lean))
    off = rng.uniform(0.3, 0.4)
    hands = []
    for limb in limbs:
        place = np.array([*PLACES[limb], -off]) + rng.uniform(-0.06, 0.06, 3)
        turn = Rotation.from_rotvec([*rng.uniform(-0.12, 0.12, 2), rng.uniform(-0.4, 0.4)])
        hold, grasp = HOLDS[rng.integers(len(HOLDS))], GRASPS[rng.integers(len(GRASPS))]
        pose = body @ Pose(place, PALM_TO_WALL @ turn.as_matrix())
        hand = HandOnHold(str(limb), pose, hold, ROCK, grasp=grasp)
        # nails do not fit all rock
        hands.append(hand if possible(hand) else replace(hand, grasp=Grasp()))
    gravity = np.array(GRAVITIES[rng.integers(len(GRAVITIES))])
    return Stance(tuple(hands), body, gravity=gravity)


def on_knobs(rng: np.random.Generator) -> Stance:
    """On undercuts, side pulls and tops of knobs and bars that stand out from a wall."""
    stance = on_wall(overhang=rng.choice((-0.5, 0.0, 0.4)), off=0.35)
    hands = []
    for hand in stance.hands:
        turn = Rotation.from_rotvec([rng.uniform(-0.7, 0.7), rng.uniform(-0.8, 0.8), 0.0])
        pose = Pose(hand.pose.position, hand.pose.rotation @ turn.as_matrix())
        hold = (Cylinder(0.15), Cylinder(0.2), Sphere(0.25), Ellipsoid((0.14, 0.2, 0.12)))[
            rng.integers(4)
        ]
        hands.append(replace(hand, pose=pose, hold=hold))
    return replace(stance, hands=tuple(hands))


def around_a_boulder(rng: np.random.Generator) -> Stance:
    """Hugging a boulder as large as the robot, palms toward its middle."""
    radius = rng.uniform(0.45, 0.6)
    return _facing(
        lambda place: (np.array([0.0, 0.0, -radius - 0.3]), radius), rng, Sphere(2.0 * radius)
    )


def in_a_corner(rng: np.random.Generator, angle: float) -> Stance:
    """On two walls that meet: in a corner at an angle above zero, else on a ridge [rad]."""
    body = Pose(np.zeros(3), wall())
    hands = []
    for limb, (up, across) in PLACES.items():
        side = math.copysign(1.0, across)
        turn = Rotation.from_rotvec([side * angle, 0.0, 0.0]).as_matrix()
        deep = -0.45 + math.sin(angle) * abs(across)
        pose = body @ Pose(np.array([up, across, deep]), turn @ PALM_TO_WALL)
        hold = HOLDS[rng.integers(len(HOLDS))]
        hands.append(HandOnHold(limb, pose, hold, ROCK))
    return Stance(tuple(hands), body)


def _facing(centre: Callable, rng: np.random.Generator, hold: Hold) -> Stance:
    body = Pose(np.zeros(3), wall(rng.choice((-1.2, 0.0, 0.5))))
    hands = []
    for limb, place in PLACES.items():
        middle, radius = centre(place)
        outward = np.array([0.8 * place[0], 0.8 * place[1], 0.0]) / radius
        outward[2] = math.sqrt(max(1.0 - outward @ outward, 0.05))
        outward /= np.linalg.norm(outward)
        z = -outward
        x = np.array([1.0, 0.0, 0.0]) - z[0] * z
        x /= np.linalg.norm(x)
        pose = Pose(middle + radius * outward, np.column_stack([x, np.cross(z, x), z]))
        hands.append(HandOnHold(limb, body @ pose, hold, ROCK))
    return Stance(tuple(hands), body)


def sound_stances(count: int, seed: int = 0) -> Iterator[Stance]:
    """So many different stances that are meant; mostly on walls."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        if i % 10 == 7:
            yield around_a_boulder(rng)
        elif i % 10 == 8:
            yield in_a_corner(rng, rng.uniform(-0.6, 0.6))
        elif i % 10 == 9:
            yield on_knobs(rng)
        else:
            yield on_any_wall(rng)


# Slips --------------------------------------------------------------------------------------------

TURN_X, TURN_Y, TURN_Z = (
    np.diag([1.0, -1.0, -1.0]),
    np.diag([-1.0, 1.0, -1.0]),
    np.diag([-1.0, -1.0, 1.0]),
)


def with_hand(stance: Stance, index: int, **changes) -> Stance:
    hands = list(stance.hands)
    hands[index] = replace(hands[index], **changes)
    return replace(stance, hands=tuple(hands))


def turned_hand(stance: Stance, index: int, turn: np.ndarray) -> Stance:
    pose = stance.hands[index].pose
    return with_hand(stance, index, pose=Pose(pose.position, pose.rotation @ turn))


def turned_body(stance: Stance, turn: np.ndarray) -> Stance:
    return replace(stance, body=Pose(stance.body.position, stance.body.rotation @ turn))


def misread(pose: Pose) -> Pose:
    """The pose of a quaternion that was written [w, x, y, z]."""
    return Pose.from_quaternion(pose.position, np.roll(pose.quaternion(), 1))


def nearer(stance: Stance, distance: float) -> Stance:
    """The body so much farther along −z of B, into the wall."""
    into = -stance.body.rotation[:, 2]
    return replace(stance, body=Pose(stance.body.position + distance * into, stance.body.rotation))


def exchanged(stance: Stance, first: str, second: str) -> Stance:
    """The limbs of hands exchanged."""
    swap = {first: second, second: first}
    hands = tuple(replace(h, limb=swap.get(h.limb, h.limb)) for h in stance.hands)
    return replace(stance, hands=hands)


def scaled(stance: Stance, factor: float) -> Stance:
    """All places in another unit."""

    def grown(pose: Pose) -> Pose:
        return Pose(factor * pose.position, pose.rotation)

    hands = tuple(replace(hand, pose=grown(hand.pose)) for hand in stance.hands)
    return replace(stance, hands=hands, body=grown(stance.body))


def beside(stance: Stance, distance: float) -> Stance:
    """The second hand at the first one's place, or so far beside it."""
    pose = stance.hands[0].pose
    there = Pose(pose.position + distance * pose.rotation[:, 1], pose.rotation)
    return with_hand(stance, 1, pose=there)


def in_the_body(stance: Stance) -> Stance:
    there = Pose(stance.body.apply([0.2, 0.0, -0.02]), stance.hands[0].pose.rotation)
    return with_hand(stance, 0, pose=there)


def lifted(stance: Stance) -> Stance:
    pose = stance.hands[0].pose
    there = pose.position + np.array([0.0, 0.0, 3.0])
    return with_hand(stance, 0, pose=Pose(there, pose.rotation))


def inside_a_boulder(stance: Stance) -> Stance:
    """The body within a boulder that hands are on."""
    hands = tuple(replace(hand, hold=Sphere(3.0)) for hand in stance.hands)
    return replace(nearer(stance, 1.0), hands=hands)


def with_gravity(stance: Stance, size: float) -> Stance:
    """Gravity of that size [m/s²]."""
    return replace(stance, gravity=size * stance.gravity / np.linalg.norm(stance.gravity))


def with_strength(stance: Stance, **numbers: float) -> Stance:
    """All hands on rock of those numbers."""
    surface = Surface.from_values(numbers)
    return all_of(stance, lambda s, i: with_hand(s, i, surface=surface))


def with_grasp(stance: Stance, **changes: float) -> Stance:
    """All hands with another grasp."""
    return all_of(
        stance, lambda s, i: with_hand(s, i, grasp=structs.replace(s.hands[i].grasp, **changes))
    )


def all_of(stance: Stance, slip: Callable[[Stance, int], Stance]) -> Stance:
    for i in range(len(stance.hands)):
        stance = slip(stance, i)
    return stance


REFUSED = "refused"

SLIPS: dict[str, tuple[Callable[[Stance], Stance], set[str]]] = {
    "a palm turned about x": (lambda s: turned_hand(s, 0, TURN_X), {"palm_away"}),
    "a palm turned about y": (lambda s: turned_hand(s, 2, TURN_Y), {"palm_away"}),
    "all palms turned": (
        lambda s: all_of(s, lambda t, i: turned_hand(t, i, TURN_X)),
        {"palm_away"},
    ),
    "a hand's quaternion as [w, x, y, z]": (
        lambda s: with_hand(s, 1, pose=misread(s.hands[1].pose)),
        {"palm_away", "fingers_down", "body_in_rock"},
    ),
    "the body's quaternion as [w, x, y, z]": (
        lambda s: replace(s, body=misread(s.body)),
        {"body_reversed", "limbs_crossed", "out_of_reach"},
    ),
    "fingers down": (lambda s: turned_hand(s, 1, TURN_Z), {"fingers_down"}),
    "the body beyond the wall": (lambda s: nearer(s, 0.75), {"body_in_rock"}),
    "the body in the wall": (lambda s: nearer(s, 0.35), {"body_in_rock"}),
    "left and right exchanged": (
        lambda s: exchanged(exchanged(s, "front_left", "front_right"), "rear_left", "rear_right"),
        {"limbs_crossed"},
    ),
    "front hands exchanged": (
        lambda s: exchanged(s, "front_left", "front_right"),
        {"limbs_crossed"},
    ),
    "front and rear exchanged": (
        lambda s: exchanged(s, "front_left", "rear_left"),
        {"limbs_crossed"},
    ),
    "the body rolled over": (lambda s: turned_body(s, TURN_X), {"body_reversed"}),
    "the body pitched over": (lambda s: turned_body(s, TURN_Y), {"body_reversed"}),
    "the body head down": (lambda s: turned_body(s, TURN_Z), {"limbs_crossed"}),
    "gravity's sign": (lambda s: replace(s, gravity=-s.gravity), {"gravity_up"}),
    "centimetres": (lambda s: scaled(s, 100.0), {REFUSED}),
    "hands on one hold": (lambda s: beside(s, 0.03), {"hands_overlap"}),
    "hands in one place": (lambda s: beside(s, 0.0), {REFUSED}),
    "a hand in the body": (in_the_body, {"hand_in_body"}),
    "a hand three metres up": (lifted, {"out_of_reach"}),
    "the body in a boulder": (inside_a_boulder, {REFUSED}),
    "gravity in g": (lambda s: with_gravity(s, 1.0), {"unit"}),
    "gravity in g, with digits": (lambda s: with_gravity(s, 9.81 / 9.80665), {"unit"}),
    "gravity in cm/s²": (lambda s: with_gravity(s, 981.0), {"unit"}),
    "gravity in mm/s²": (lambda s: with_gravity(s, 9810.0), {"unit"}),
    "gravity in ft/s²": (lambda s: with_gravity(s, 32.17), {"unit"}),
    "a hand's pull-off of a tile": (lambda s: with_strength(s, shear_limit=353.0), {"unit"}),
    "what a hand holds, of a tile": (lambda s: with_strength(s, shear_limit=490.0), {"unit"}),
    "a tendon's tension, of a tile": (lambda s: with_strength(s, shear_limit=700.0), {"unit"}),
    "a tile's strength in mN": (lambda s: with_strength(s, shear_limit=57000.0), {"unit"}),
    "a tile's strength in kN": (lambda s: with_strength(s, shear_limit=0.057), {"unit"}),
    "a closing tension in gf": (lambda s: with_grasp(s, closing_tension=3770.0), {REFUSED}),
    "a closing tension in kgf": (lambda s: with_grasp(s, closing_tension=3.77), {"unit", REFUSED}),
    "half a turn with two decimals": (
        lambda s: with_grasp(s, outer_rotation=3.14),
        {"nearly_pinching"},
    ),
    "half a turn cut after five": (
        lambda s: with_grasp(s, outer_rotation=3.14159),
        {"nearly_pinching"},
    ),
    "a log in mm": (lambda s: with_hand(s, 0, hold=Cylinder(60.0)), {"unit"}),
    "a ball in cm": (lambda s: with_hand(s, 0, hold=Sphere(25.0)), {"unit"}),
}
"""Slips by name, and what tells of each."""

BASES = {
    "logs": lambda: on_wall(Cylinder(0.3), outer_rotation=0.5),
    "overhang": lambda: on_wall(Plane(), overhang=0.5, outer_rotation=0.0, off=0.35),
    "slab": lambda: on_wall(
        Edge(0.1, 1.9), overhang=-0.4, outer_rotation=0.8, gravity=GRAVITIES[2]
    ),
}
"""Stances that the slips are made in."""


def twin(limb: str) -> str:
    """The limb on the other side."""
    return "_".join(TWIN.get(part, part) for part in limb.split("_"))


def mirrored(stance: Stance) -> Stance:
    """The stance left for right, as seen from the body. Holds must be their own mirror images."""
    flip = np.diag([1.0, -1.0, 1.0])

    def reflected(pose: Pose) -> Pose:
        seen = stance.body.inverse() @ pose
        return stance.body @ Pose(flip @ seen.position, flip @ seen.rotation @ flip)

    hands = tuple(replace(h, limb=twin(h.limb), pose=reflected(h.pose)) for h in stance.hands)
    turn = stance.body.rotation
    return replace(stance, hands=hands, gravity=turn @ flip @ turn.T @ stance.gravity)
