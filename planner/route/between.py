"""Between two knots: set-points as a controller interpolates them, and a bound of the utilisation.

Between two knots a controller interpolates the body's position, its orientation along the shortest
turn, joint angles and tensions linearly in time. Passive reactions (of palms, of fingers sideways,
of nails) settle. The hands that hold the robot stand still in W, where the balance is

    Σ G_h y_h = w(t),   w(t) = (1 − t) w_0 + t w_1 + d(t),

with the loads y of each hand. The deviation d from the straight line comes from the centre of mass
(`com_travel`), and from the wrench of a hand that opens or closes. The loads

    y(t) = (1 − t) y_0 + t y_1 + K d(t)

balance it if G K d = d, with a matrix K that changes passive reactions only. Every load over its
capacity is affine in y, so it exceeds the straight line between its ends by no more than the norm
of its row of K times that of d. The least utilisation over all reactions is no larger. This holds
for every limit whose row stays as it is: all limits of hands. The torques of joints that turn are
not affine: they are sampled in the middle, and a parabola through the three values is taken.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Pose, skew, wrench_transport
from hand_models.wrench_spaces import WRENCH_SCALE
from planner.motion import pose_between
from planner.route.com_travel import mass_travel, turn_between
from planner.route.held import HeldPosture, Posed, hold_with

__all__ = ["Passage"]
BEYOND_ROWS: Final = 1e-4
"""Load by which knots may be beyond a hard row [N]: less than the independent check allows of one,
and ten times what programs over samples leave."""


class Passage:
    """The way from one held posture to the next, with the same hands on the rock.

    Parameters
    ----------
    start, end : HeldPosture
    excess : float
        Utilisation that passive reactions may cost above the larger of both ends: how they settle
        is chosen for that.

    Attributes
    ----------
    still : bool
        True if neither the body nor a joint moves.
    """

    def __init__(self, start: HeldPosture, end: HeldPosture, excess: float = 0.02) -> None:
        self.start, self.end = start, end
        here, there, moving = start.posed, end.posed, end.posed.moving
        self.still = here.body is there.body and all(
            np.array_equal(at, there.angles[limb]) for limb, at in here.angles.items()
        )
        # largest deviation of the moving hand's wrench from the straight line, in H
        self._deviation = np.zeros(6) if moving is None else moving.deviation
        self._rows = here.holding.rows
        self._ball, self._box = self._off_by_mass(), self._off_by_hand()
        self._settling = self._settled_by(excess)

    def posed(self, t: float) -> Posed:
        """Return the posture that is interpolated at a time t from 0 to 1."""
        start, end = self.start.posed, self.end.posed
        body = start.body
        if start.body is not end.body:
            body = pose_between(start.body, end.body, t)
        angles = {limb: _mixed(at, end.angles[limb], t) for limb, at in start.angles.items()}
        moving = end.moving
        if moving is not None and start.moving is not None:
            first = start.moving
            moving = replace(
                moving,
                on_rock=first.on_rock or moving.on_rock,
                tensions=_mixed(first.tensions, moving.tensions, t),
                winch_angles=_mixed(first.winch_angles, moving.winch_angles, t),
                wrench=_mixed(first.wrench, moving.wrench, t),
                utilisation=max(first.utilisation, moving.utilisation),
            )
        if self.still:
            return start.beside(moving)
        return Posed(start.route, start.hands, body, angles, moving)

    def hold(self, t: float) -> HeldPosture:
        """Return the verified loads of what is interpolated at a time t from 0 to 1.

        Raises
        ------
        NoPlanError
            If they do not pass the checks.
        """
        posed = self.posed(t)
        return hold_with(posed, self.settled(t, posed))

    def settled(self, t: float, posed: Posed) -> list[Array]:
        """Return loads of each hand, shape (m,), that balance a posture with tensions at t [N].

        Parameters
        ----------
        t : float
            Time from 0 to 1.
        posed : Posed
            The posture that is interpolated at that time, or one near it.
        """
        ends = np.cumsum([len(own) for own in self.start.loads])[:-1]
        return np.split(self._loads(t, posed), ends)

    def _loads(self, t: float, posed: Posed) -> Array:
        y = _mixed(np.concatenate(self.start.loads), np.concatenate(self.end.loads), t)
        ends = self._needed(self.start.posed), self._needed(self.end.posed)
        return np.asarray(y + self._settling @ (self._needed(posed) - _mixed(*ends, t)))

    def bound(self) -> float:
        """Return the bound of the utilisation from the start to the end.

        It is infinite if passive reactions cannot balance the deviation from the straight line.
        """
        ends = self.start.used, self.end.used
        rows, changing = self._rows, self._changing()
        middle = self.posed(0.5)
        moving = [held.posed.moving for held in (self.start, self.end)]
        most = max(
            [0.0, *(each.utilisation for each in moving if each is not None and each.on_rock)]
        )
        around = self._deviation[:3]
        most = max(most, *(held.posed.cap_use(around) for held in (self.start, self.end)))
        ball, box = self._ball, self._box
        d, e = np.zeros(len(rows.used)), np.zeros(len(rows.used))
        if ball.any() or box.any():
            if not self._balances(ball) or not self._balances(box):
                return math.inf
            d, e = self._beyond(rows.used)
            slack = [
                rows.most - rows.hard @ np.concatenate(held.loads)
                for held in (self.start, self.end)
            ]
            out, wide = self._beyond(rows.hard)
            if (_room(slack[0] - wide, slack[1] - wide) < out - 1e-9).any():
                return math.inf
        peaks = _peak(*ends, d)[~changing] + e[~changing]
        most = max(most, float(peaks.max(initial=0.0)))
        if changing.any():
            used = _used(middle, self._loads(0.5, middle))
            most = max(most, float(_parabola(ends[0], used, ends[1])[changing].max()))
        return max(most, self._idle(middle))

    def _idle(self, middle: Posed) -> float:
        """Return the largest utilisation of the joints of limbs whose hand is not in the sets."""
        most, box = 0.0, self._deviation
        times = [self.start.posed, middle, self.end.posed]
        for limb in middle.idle:
            shares, mine = [], False
            for posed in times:
                own, moving = posed.posture.joints[limb].driven, posed.moving
                mine = moving is not None and moving.limb == limb
                wrench = moving.wrench if moving is not None and mine else np.zeros(6)
                shares.append(own.torques(wrench) / own.limits)
            peaks = np.maximum(_parabola(*shares), _parabola(*(-share for share in shares)))
            if box.any() and mine:
                peaks = peaks + np.abs(own.jacobian.T) @ box / own.limits
            most = max(most, float(peaks.max(initial=0.0)))
        return most

    def _changing(self) -> NDArray[np.bool_]:
        """Return True for limits whose rows change from the start to the end, shape (k,)."""
        here, there = self.start.prepared.hands.spaces, self.end.prepared.hands.spaces
        if here is there:
            return np.zeros(len(self._rows.used), dtype=bool)
        off = [
            np.abs(one.L - two.L).max(axis=1) + np.abs(one.l0 - two.l0)
            for one, two in zip(here, there, strict=True)
        ]
        return np.concatenate(off) > 1e-9 * np.concatenate([space.s for space in here])

    def _needed(self, posed: Posed) -> Array:
        """Return the wrench on the rock, in W about the start's body, shape (6,) [N, N·m]."""
        off = posed.body.position - self.start.posed.body.position
        return np.asarray(-wrench_transport(Pose(off, posed.body.rotation)) @ posed.needed)

    def _off_by_mass(self) -> Array:
        """Return wrenches (6, 3) of the mass off its straight line; of a ball of directions."""
        route = self.start.posed.route
        if self.still:
            return np.zeros((6, 3))
        start, end = self.start.posed, self.end.posed
        turn = start.body.rotation.T @ turn_between(start.body, end.body)
        off = mass_travel(route.start.robot, route.load, turn, start.angles, end.angles)
        pull = np.array(route.load.acceleration) - route.start.gravity
        return np.concatenate([np.zeros((3, 3)), off * skew(pull)])

    def _off_by_hand(self) -> Array:
        """Return wrenches (6, 6) of the moving hand off the straight line; each either way."""
        moving, posed = self.end.posed.moving, self.start.posed
        if moving is None or not self._deviation.any():
            return np.zeros((6, 6))
        pose = posed.body @ posed.hand_poses[moving.limb]
        about = Pose(pose.position - posed.body.position, pose.rotation)
        return wrench_transport(about) * self._deviation

    def _settled_by(self, excess: float) -> Array:
        """Return the matrix K, shape (M, 6): change of the passive reactions with the wrench."""
        rows, loads = self._rows, [np.concatenate(h.loads) for h in (self.start, self.end)]
        used = np.maximum(self.start.used, self.end.used)
        room = [used.max() + excess - used]
        room.append(_room(*(rows.most - rows.hard @ y for y in loads)))
        each = np.abs(np.concatenate([rows.used, rows.hard]))
        with np.errstate(divide="ignore", invalid="ignore"):
            alone = np.where(each > 1e-12, np.concatenate(room)[:, None] / each, np.inf)
        # a reaction may change as far as the first row allows that it alone would break
        weight = np.where(rows.passive, np.clip(alone.min(axis=0), 0.0, 1e3), 0.0) ** 2
        scaled = WRENCH_SCALE[:, None] * rows.wrench
        inverse = np.linalg.pinv(scaled * weight @ scaled.T, rcond=1e-10, hermitian=True)
        return np.asarray(weight[:, None] * scaled.T @ inverse * WRENCH_SCALE)

    def _balances(self, wrenches: Array) -> bool:
        """Return whether passive reactions can balance wrenches (6, n)."""
        off = self._rows.wrench @ (self._settling @ wrenches) - wrenches
        return bool(np.abs(off).max() <= 1e-6 * max(1.0, float(np.abs(wrenches).max())))

    def _beyond(self, rows: Array) -> tuple[Array, Array]:
        """Return how far the deviation takes rows (k, M) from the straight line, (k,) each.

        The first is the most at 4 t (1 − t), the second the most at any time.
        """
        through = rows @ self._settling
        return np.linalg.norm(through @ self._ball, axis=1), np.abs(through @ self._box).sum(axis=1)


def _mixed(first: Array, last: Array, t: float) -> Array:
    return np.asarray(first + t * (last - first))


def _used(posed: Posed, loads: Array) -> Array:
    """Return the utilisation of each limit row of a posture's hands at loads (M,)."""
    found, before = [], 0
    for space in posed.holding.prepared.hands.spaces:
        own = loads[before : before + len(space.columns)]
        found.append((space.L @ own + space.l0) / space.s)
        before += len(own)
    return np.concatenate(found)


def _room(first: Array, last: Array) -> Array:
    """Return the largest d with (1 − t) first + t last ≥ 4 t (1 − t) d for all t from 0 to 1.

    It is the least over t of (first / t + last / (1 − t)) / 4; below zero where an end is.
    """
    roots = np.sqrt(np.maximum(first, 0.0)) + np.sqrt(np.maximum(last, 0.0))
    return np.where(np.minimum(first, last) < -BEYOND_ROWS, -np.inf, 0.25 * roots**2)


def _peak(first: Array, last: Array, d: Array) -> Array:
    """Return the most of (1 − t) first + t last + 4 t (1 − t) d over t from 0 to 1."""
    step = np.abs(last - first)
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = 0.5 * (first + last) + d + step**2 / (16.0 * d)
    return np.where(step < 4.0 * d, inside, np.maximum(first, last))


def _parabola(first: Array, middle: Array, last: Array) -> Array:
    """Return the most of the parabolas through values at the times 0, ½ and 1."""
    bend = 0.5 * (2.0 * middle - first - last)
    return _peak(first, last, np.maximum(bend, 0.0))
