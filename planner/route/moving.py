"""States of what moves in a climb: a hand along its opening path, and the body on all hands."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hand_models.base import Array, Pose
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, SettledHand
from hand_models.opening import HandPath, closing_path, opening_path
from hand_models.wrench_spaces import WrenchSpace
from planner.explanation import limit_name, most_used
from planner.motion import (
    BranchEndError,
    CollisionScene,
    NearestPair,
    check_shift,
    met_in_shift,
    pose_between,
    shift_postures,
)
from planner.prepare import FORCE_CAP
from planner.robots import scene_number
from planner.route.held import NoPlanError, Posed
from planner.route.moving_hand import MovingHand
from planner.route.settings import KnotNumbers

__all__ = ["closing_loads", "closing_states", "in_air", "opening_states", "shift_of_body"]


def closing_loads(settled: SettledHand, space: WrenchSpace) -> Array:
    """Return the loads y, shape (m,), of a hand at its closing tensions and no other load [N]."""
    tensions = [name.endswith("/tension") for name in space.columns]
    return np.where(tensions, settled.closing_tension, 0.0)


def opening_states(limb: str, settled: SettledHand, space: WrenchSpace) -> list[MovingHand]:
    """Return the states of a hand that opens, from its closing tensions to none.

    Parameters
    ----------
    limb : str
    settled : SettledHand
        The closed hand.
    space : WrenchSpace
        Its set, of which the closing tensions without other loads are an element.

    Raises
    ------
    NoPlanError
        If a finger jams.
    """
    path = opening_path(settled)
    if path.jammed:
        raise NoPlanError(path.jammed[0].reason)
    return _states(limb, settled, space, path, opens=True)


def closing_states(limb: str, settled: SettledHand, space: WrenchSpace) -> list[MovingHand]:
    """Return the states of a hand that closes, from no tension to its closing tensions.

    Parameters as in `opening_states`.
    """
    return _states(limb, settled, space, closing_path(settled), opens=False)


def in_air(hand: MovingHand) -> MovingHand:
    """Return an open hand that has left its rock."""
    free = np.zeros(6)
    return replace(hand, on_rock=False, wrench=free, deviation=free, utilisation=0.0)


def _states(
    limb: str, settled: SettledHand, space: WrenchSpace, path: HandPath, *, opens: bool
) -> list[MovingHand]:
    y = closing_loads(settled, space)
    closed, used = space.wrench(y), (space.L @ y + space.l0) / space.s
    winches = _winch_angles(settled, path, opens=opens)
    # the set's wrench of the closed hand, and the path's, differ by little
    wrenches = path.wrenches.copy()
    at = 0 if opens else -1
    off = np.abs(wrenches[at] - closed)
    wrenches[at] = closed
    deviation = np.vstack([np.zeros(6), path.deviation])
    deviation[1 if opens else -1] += off
    # joints and the cap on the force count with the wrench of each state
    rows = space.rows[: len(space.s)]
    apart = [row.limit.startswith("joint") or row.limit == FORCE_CAP for row in rows]
    used = np.where(apart, 0.0, used)
    return [
        MovingHand(
            limb=limb,
            on_rock=True,
            tensions=path.tensions[k],
            winch_angles=winches[k],
            wrench=wrenches[k],
            deviation=deviation[k],
            utilisation=max(float(used.max()), 0.0),
            limiting=limit_name(limb, rows[most_used(used)]),
        )
        for k in range(len(wrenches))
    ]


def _winch_angles(settled: SettledHand, path: HandPath, *, opens: bool) -> Array:
    """Return the winch angles along a path, shape (k, 4) [rad].

    Tiles hold by the part of their spines that the path says, with the shear of the closed hand's
    law; while closing, shear grows in proportion to the tension.
    """
    model, f = settled.hand, path.tensions
    loss = 1.0 - model.finger.friction
    whole = np.maximum(settled.engagement, 1e-12)
    fingers = np.asarray(settled.finger_of)
    own = f[:, fingers]
    laws = settled.loads[:, 0]
    if opens:
        shears = laws[:, 0] + laws[:, 1] * own
    else:
        at = laws[:, 0] + laws[:, 1] * settled.closing_tension
        shears = at * own / settled.closing_tension
    shears = shears * path.engagement / whole
    drawn = np.array([shears[:, fingers == i].sum(axis=1) for i in range(len(FINGERS))]).T
    sums = np.cumsum(loss ** np.arange(len(PHALANGES) + 1.0))
    losses = np.array([sums[-1 if name.startswith("outer") else -2] for name in FINGERS])
    joints = path.joints @ np.array(model.finger.pulley_radii)
    nails = model.nail.pulley_radius * np.asarray(settled.nail_angles)
    return np.asarray(model.drive.winch_angle(joints, f, drawn, losses, nails))


def shift_of_body(
    first: Posed, goal: Pose, scene: CollisionScene, numbers: KnotNumbers
) -> tuple[list[Pose], dict[str, Array]]:
    """Return the way of a body on all hands: poses of B in W, and joint angles before and at each.

    There are so many poses that interpolated joints keep each hand on its hold.

    Parameters
    ----------
    first : Posed
        Before the shift.
    goal : Pose
        Pose of B in W, which is the last one.
    scene : CollisionScene
    numbers : KnotNumbers

    Raises
    ------
    NoPlanError
        If a link meets something.
    BranchEndError
        If a limb cannot follow.
    """
    robot, hands = first.route.start.robot, {each.limb: each.pose for each in first.hands}
    margin = scene_number("motion", "margin_at_hold")
    for halvings in range(numbers.halvings + 1):
        count = 2**halvings
        parts = [k / count for k in range(1, count)]
        bodies = [*(pose_between(first.body, goal, part) for part in parts), goal]
        try:
            found = shift_postures(robot, hands, bodies, first.angles)
        except BranchEndError as error:
            # what is met is said before a limb that cannot follow
            met = met_in_shift(scene, hands, first.body, goal, first.angles, margin=margin)
            if met is None:
                raise
            raise _in_the_way(met) from error
        ways = {limb: np.vstack([first.angles[limb], each]) for limb, each in found.items()}
        halfway = [pose_between(a, b, 0.5) for a, b in pairwise([first.body, *bodies])]
        middle = {limb: 0.5 * (way[1:] + way[:-1]) for limb, way in ways.items()}
        off = 0.0
        for k, body in enumerate(halfway):
            there = robot.hand_poses({limb: each[k] for limb, each in middle.items()})
            away = [body.apply(there[limb].position) - hands[limb].position for limb in ways]
            off = max(off, float(np.linalg.norm(away, axis=1).max()))
        if off <= numbers.slack:
            break
    seen = check_shift(scene, [first.body, *bodies], ways, margin=margin)
    if not seen.clear:
        raise _in_the_way(seen.nearest)
    return bodies, ways


def _in_the_way(met: NearestPair) -> NoPlanError:
    """Return the error of a shift in which something is met."""
    return NoPlanError(f"while the body shifts, {met}; shift the body less or elsewhere")
