"""The hand that leaves its hold, or comes to a new one: its states along its opening path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hand_models.base import Array
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, SettledHand
from hand_models.opening import HandPath, closing_path, opening_path
from hand_models.wrench_spaces import WrenchSpace
from planner.explanation import limit_name
from planner.prepare import FORCE_CAP
from planner.route.held import NoPlanError
from planner.route.moving_hand import MovingHand

__all__ = ["closing_loads", "closing_states", "in_air", "opening_states"]


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
    worst = int(used.argmax())
    return [
        MovingHand(
            limb=limb,
            on_rock=True,
            tensions=path.tensions[k],
            winch_angles=winches[k],
            wrench=wrenches[k],
            deviation=deviation[k],
            utilisation=max(float(used[worst]), 0.0),
            limiting=limit_name(limb, rows[worst]),
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
