"""Find oddities in the geometry of a stance, apart from its joints, that are likely mistakes.

All is computed in the body's frame, so that it does not depend on the world's frame W; only gravity
that points up is checked in W, whose z is up by the contract. If z of a hand, into its rock, points
out of the body's back, the hand is reversed if the body is on the rock's side of its palm;
otherwise the body is, if all hands are like that. If the robot's file does not give the direction
of the back, it is taken to be opposite to where most hands point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, InvalidInputError
from planner.result import Finding
from planner.scene.scene import Scene
from planner.scene.solids import capsule_solids, distance_between, hand_solids

__all__ = ["findings"]

QUATERNION_SLIP: Final = "is its quaternion [x, y, z, w]?"
"""The likely slip of what is turned."""


def findings(scene: Scene) -> tuple[Finding, ...]:
    """Return a finding for each oddity in the geometry of a stance.

    Oddities are hands that are out of reach, reversed, overlapping or in the body, a reversed body,
    a body in rock, crossed limbs, gravity that points up, fingers that point down and fingers that
    nearly pinch.

    Raises
    ------
    InvalidInputError
        If the stance is impossible: two hands at the same place, or a body deep in rock; the
        error's field is relative to the question.
    """
    along = _back(scene) @ scene.axes[:, :, 2].T
    above = -np.einsum("nx,nx->n", scene.places, scene.axes[:, :, 2])
    # a hand points out of the body's back within 60° of it; a palm that does has the body behind it
    # if B's origin is that far on the rock's side [m]
    back = along > 0.5
    away = back & (above > 0.05)
    return (
        *_out_of_reach(scene),
        *_palms(scene, away, above),
        *_reversed(back & ~away, along),
        *_in_rock(scene, away, above, along),
        *_overlapping(scene),
        *_in_body(scene),
        *_crossed(scene),
        *_gravity(scene),
        *_nearly_pinching(scene),
    )


def _back(scene: Scene) -> Array:
    """Return the direction out of the body's back in B; zero where it is not known."""
    known = scene.stance.robot.back
    if known is not None:
        return known
    total = scene.axes[:, :, 2].sum(axis=0)
    size = float(np.linalg.norm(total))
    # the mean of all z of H shows where the belly is if they agree so far
    return -total / size if size > 0.3 * len(scene.axes) else np.zeros(3)


def _of_hand(index: int, entry: str) -> str:
    return f"stance.hands[{index}].{entry}"


def _out_of_reach(scene: Scene) -> Iterator[Finding]:
    stance = scene.stance
    limbs = [hand.limb for hand in stance.hands]
    stretches = stance.robot.stretches(stance.body, limbs, [hand.pose for hand in stance.hands])
    for i, (limb, stretch) in enumerate(zip(limbs, stretches, strict=True)):
        if stretch > 1.0:
            message = (
                f"{limb}: out of reach, {_farther(stretch)} its limb goes; "
                "positions in metres, quaternions as [x, y, z, w]?"
            )
            field = _of_hand(i, "pose.position")
            yield Finding("out_of_reach", field, message, stretch, "1")


def _farther(stretch: float) -> str:
    """Say how many times as far something is, or how much farther where that is less than twice."""
    if stretch >= 2.0:
        return f"{stretch:.2g} times as far as"
    return f"{max(100.0 * (stretch - 1.0), 0.1):.2g} % farther than"


def _palms(scene: Scene, away: NDArray[np.bool_], above: Array) -> Iterator[Finding]:
    """Yield palms that are turned around; ``above``: how far B is on the rock's side of each."""
    for i in np.flatnonzero(away).tolist():
        message = (
            f"{scene.hands[i].limb}: the palm faces away from its rock, the body is "
            f"{above[i]:.2g} m on the side that z of H points to, which is into the rock: "
            f"{QUATERNION_SLIP}"
        )
        yield Finding("palm_away", _of_hand(i, "pose.orientation"), message, float(above[i]), "m")


def _reversed(back: NDArray[np.bool_], along: Array) -> Iterator[Finding]:
    """Yield a body that has all its hands behind its back."""
    if back.all():
        value = float(along.mean())
        message = (
            "the body is the wrong way round, z of all hands, into their rock, points out of its "
            f"back: {QUATERNION_SLIP}"
        )
        yield Finding("body_reversed", "stance.body.orientation", message, value, "1")


def _in_rock(
    scene: Scene, away: NDArray[np.bool_], above: Array, along: Array
) -> Iterator[Finding]:
    """Yield a body that is in rock, or behind all of it."""
    rough = 0.05  # depth that is not odd, as capsules and rock far from a hand are rough [m]
    asked = np.flatnonzero(~away).tolist()
    deepest = dict(zip(asked, _depths(scene, asked), strict=True))
    found = {scene.hands[i].limb: deep for i, deep in deepest.items() if deep > rough}
    where = "in the rock"
    # of logs on either side the body may be a little above [m]; palms point out of its belly from
    # 134° to its back on: hands that hug a boulder point sideways
    if not found and above.min() > 0.1 and along.max() < -0.7:
        where = "behind the rock"
        found = {hand.limb: up for hand, up in zip(scene.hands, above.tolist(), strict=True)}
    if found:
        most = max(found.values())
        order = [limb for limb in scene.stance.robot.limbs if limb in found]
        message = (
            f"the body is {most:.2g} m {where} of {', '.join(order)}: is its position on the "
            "right side of the rock, in W, in metres?"
        )
        yield Finding("body_in_rock", "stance.body.position", message, most, "m")


def _depths(scene: Scene, hands: Sequence[int]) -> list[float]:
    """Return how deep the body is in the rock of hands [m].

    Rock that is not smooth is slow to query, and gives the depth along z, not the least: of such
    only how deep B's origin is.
    """
    deepest = 0.2  # in a ball, a boulder or a log, at which B's origin cannot be [m]
    points, radii = _body_points(*scene.stance.robot.body_capsules)
    smooth = [i for i in hands if scene.swept[i] is not None]
    found = {}
    if smooth:
        deep = scene.smooth_depths(smooth, points)
        for i, origin in zip(smooth, deep[:, 0].tolist(), strict=True):
            hand, shape = scene.hands[i], scene.swept[i]
            # an edge's rock has no end
            if origin > deepest and shape is not None and not shape.sine:
                raise InvalidInputError(
                    f"the body's origin is {origin:.2g} m deep in the rock of {hand.limb}; at most "
                    f"{deepest:g} m is allowed, as rock's shape is rough: is the position in W, "
                    "in metres, on the right side of the rock?",
                    field="stance.body.position",
                )
        found = dict(zip(smooth, (deep + radii).max(axis=1).tolist(), strict=True))
    into_rock = (0.0, 0.0, 1.0)
    return [
        found[i] if i in found else -scene.hands[i].hold.entry(scene.rocks[i].position, into_rock)
        for i in hands
    ]


def _body_points(ends: Array, radii: Array) -> tuple[Array, Array]:
    """Return B's origin, then ends and middles of the body's capsules, with their radii."""
    middles = 0.5 * (ends[:, 0] + ends[:, 1])
    points = np.concatenate([np.zeros((1, 3)), ends[:, 0], middles, ends[:, 1]])
    return points, np.concatenate([[0.0], radii, radii, radii])


def _overlapping(scene: Scene) -> Iterator[Finding]:
    """Yield hands that are in each other."""
    apart = scene.places[:, None] - scene.places
    close = np.einsum("ijx,ijx->ij", apart, apart) < scene.stance.robot.hand.palm_length**2
    # every hand is close to itself
    if np.count_nonzero(close) == len(close):
        return
    hands = hand_solids(scene)
    for i, j in np.argwhere(np.triu(close, 1)).tolist():
        gap = distance_between(hands[i], hands[j])[0]
        if gap < 0.0:
            one, other = _in_order(scene, i, j)
            field = _of_hand(j, "pose.position")
            names = f"{scene.hands[one].limb} and {scene.hands[other].limb}"
            off = np.linalg.norm(scene.places[i] - scene.places[j])
            turned = np.abs(scene.axes[i] - scene.axes[j]).max()
            # [m], and the largest difference of entries of the axes
            if off <= 1e-3 and turned <= 1e-3:
                raise InvalidInputError(
                    f"{names} are at the same position; each hand needs its own", field=field
                )
            message = (
                f"{names} overlap, their palms are {-gap:.2g} m in each other: is the same hold "
                "given twice?"
            )
            yield Finding("hands_overlap", field, message, -gap, "m")


def _in_order(scene: Scene, i: int, j: int) -> tuple[int, int]:
    """Return two hands in the order of the robot's limbs."""
    limbs, hands = scene.stance.robot.limbs, scene.hands
    return (i, j) if limbs.index(hands[i].limb) < limbs.index(hands[j].limb) else (j, i)


def _in_body(scene: Scene) -> Iterator[Finding]:
    """Yield hands that are in the body."""
    ends, radii = scene.stance.robot.body_capsules
    if not len(ends):
        return
    reach = math.sqrt(np.einsum("nkx,nkx->nk", ends, ends).max()) + radii.max()
    reach += scene.stance.robot.hand.palm_length
    near = np.flatnonzero(np.einsum("nx,nx->n", scene.places, scene.places) < reach**2)
    if not len(near):
        return
    hands, body = hand_solids(scene), capsule_solids(["body"] * len(ends), ends, radii)
    for i in near.tolist():
        gap = min(distance_between(hands[i], part)[0] for part in body)
        if gap < 0.0:
            message = (
                f"{scene.hands[i].limb}: the hand is {-gap:.2g} m in the body: are both positions "
                "in W, in metres?"
            )
            field = _of_hand(i, "pose.position")
            yield Finding("hand_in_body", field, message, -gap, "m")


def _crossed(scene: Scene) -> Iterator[Finding]:
    """Yield pairs of limbs that would both be better off with each other's holds."""
    away = np.linalg.norm(scene.shoulders[:, None] - scene.places[None], axis=2)
    own = np.diag(away)
    gain = own[:, None] + own[None] - away - away.T
    # gain in distance to the shoulders from which on limbs count as crossed
    least = 0.25 * scene.stance.robot.reach
    while gain.max() > least:
        i, j = _in_order(scene, *np.unravel_index(gain.argmax(), gain.shape))
        nearer = float(gain[i, j])
        names = f"{scene.hands[i].limb} and {scene.hands[j].limb}"
        message = (
            f"{names} cross, with their limbs exchanged their hands would be {nearer:.2g} m nearer "
            "to their shoulders: are left and right (y of B points left), or front and rear, "
            "swapped?"
        )
        yield Finding("limbs_crossed", _of_hand(i, "limb"), message, nearer, "m")
        gain[[i, j]] = gain[:, [i, j]] = 0.0


def _gravity(scene: Scene) -> Iterator[Finding]:
    """Yield gravity that points up, and fingers that point down."""
    stance = scene.stance
    size = float(np.linalg.norm(stance.gravity))
    if not size:
        return
    upward = float(stance.gravity[2]) > 0.0
    if upward:
        message = (
            f"gravity points up, {stance.gravity[2]:.3g} m/s² along z of W: is its sign right?"
        )
        yield Finding("gravity_up", "stance.gravity", message, float(stance.gravity[2]), "m/s²")
    up = stance.body.rotation.T @ stance.gravity / -size
    fingers = scene.axes[:, :, 0] @ up
    # in a pinch the outer fingers pull the other way
    alike = np.array([math.cos(hand.grasp.outer_rotation) > 0.0 for hand in scene.hands])
    low = fingers < -0.8  # by more than 143° from up
    down = alike & low
    if upward and low.all():
        return
    for i in np.flatnonzero(down).tolist():
        message = (
            f"{scene.hands[i].limb}: its fingers point down, so that they can only pull the body "
            f"down: x of H is along the inner fingers; {QUATERNION_SLIP}"
        )
        field = _of_hand(i, "pose.orientation")
        yield Finding("fingers_down", field, message, float(fingers[i]), "1")


def _nearly_pinching(scene: Scene) -> Iterator[Finding]:
    """Yield hands whose outer fingers lack less than a degree of half a turn."""
    for i, hand in enumerate(scene.hands):
        lacking = math.pi - hand.grasp.outer_rotation
        if lacking < math.radians(1.0) and not hand.grasp.pinch:
            message = (
                f"{hand.limb}: its outer fingers turn by {hand.grasp.outer_rotation:.10g} rad, "
                f"{lacking:.2g} rad less than in a pinch: is it pi (3.142)?"
            )
            field = _of_hand(i, "grasp.outer_rotation")
            yield Finding("nearly_pinching", field, message, hand.grasp.outer_rotation, "rad")
