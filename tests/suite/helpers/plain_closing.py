"""One finger that closes on rock, simulated step by step: for reading, and to compare with.

The law is that of `hand_models.finger.closing`. Here it is a motion: the joints move in oil,
D dq/dt = torques, while the tension is raised by small increments, at each of which the finger
comes to rest before the next. Steps are of implicit Euler, linearised, so short that nothing
unstable grows by more than a part within one and no joint turns by more than `LARGEST`. In each,
what touches, holds or stands at a limit is found by trying all that it may be.

Only where a phalanx is beside the rock, and where and along which direction a contact's force acts
(`phalanx_beside`), is shared with what is compared.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hand_models.finger import FingerModel, OpenFinger
from hand_models.finger.phalanx_shape import PhalanxShape, fan_out
from hand_models.sections import Outlines
from hand_models.tile import engaged_share, pull_strength
from tests.suite.helpers import phalanges

INCREMENTS = 200
"""Of the tension."""

LATE_INCREMENTS = 20
"""In which tiles across gaps get their drag, at last."""

LARGEST = 4e-3
"""Turn of a joint in a step [rad]."""

AT_REST = 1e-5
"""Turn of a joint in a long step that is no motion any more [rad]."""

MOST_STEPS = 4000
"""At one tension."""

TURN = 1e-7
"""For derivatives [rad]."""

TOUCHING = 1e-7
"""A gap that counts as none [m]."""

AIR, ROCK, HELD = range(3)
"""What may become of a phalanx in a step: nothing, the rock stops it, or its spines hold it."""

OPEN, FREE, SHUT = -1, 0, 1
"""What may become of a joint: its lower limit stops it, nothing does, or its upper limit does."""

LIFTED = 1.0 / 240.0
"""Lengths of its tile by which a phalanx leaves the place where its spines were pulled off before
they may catch again."""


class LostError(Exception):
    """No step is possible, or the finger does not come to rest."""


class Beside(NamedTuple):
    """A finger beside its rock: gaps, shares of spines on it, and arms of forces about joints.

    ``along`` and ``across``, (3, 3): torque about joint i of unit shear and unit normal force that
    the rock exerts at contact j.
    """

    gap: np.ndarray
    share: np.ndarray
    along: np.ndarray
    across: np.ndarray


class PlainFinger:
    """A finger, its rock and what its tendon does.

    Attributes
    ----------
    q : ndarray, shape (3,)
        Turns of its joints [rad].
    touching : ndarray of bool, shape (3,)
        Which phalanges are on the rock or held to it.
    """

    def __init__(self, model: FingerModel, opened: OpenFinger) -> None:
        self.model, self.surface = model, opened.surface
        self.shape = PhalanxShape.of(model)
        reach = model.reach + model.tile_length
        self.rock = Outlines.of([opened.rock], reach, self.shape.spacing)
        loss = model.losses(opened.base_tile)
        self.closing = opened.tension
        self.pull, self.drag = loss * model.pulley_radii, loss * model.engagement
        self.stiffness, self.preload = np.array(model.joint_stiffness), model.joint_preload
        self.lower, self.upper = np.array(model.joint_lower), np.array(model.joint_upper)
        self.depth = self.pull * self.closing / (model.tile_centre * model.bed_stiffness)
        self.last: tuple[np.ndarray, Beside] | None = None
        self.q = np.clip(np.zeros(3), self.lower, self.upper)
        if min(self.beside(self.q).gap) < 0.0:
            self.q = self.lower.copy()
        # of the spines: share pulled off; have come to the rock; the least gap; pulled off there
        self.off = np.zeros(3)
        self.been = np.zeros(3, dtype=bool)
        self.least = np.full(3, math.inf)
        self.pulled_at = np.full(3, math.inf)
        self.off_since = np.zeros(3, dtype=bool)
        self.modes: tuple[int, ...] = (AIR,) * 3
        self.sides: tuple[int, ...] = (FREE,) * 3
        self.normals = np.zeros(3)
        self.steps = 0

    @property
    def touching(self) -> np.ndarray:
        return np.asarray(np.array(self.modes) != AIR)

    def close(self) -> None:
        """Tighten the tendon to the closing tension."""
        for tension in np.linspace(0.0, self.closing, INCREMENTS + 1)[1:]:
            self.come_to_rest(float(tension), 0.0)
        for late in np.linspace(0.0, 1.0, LATE_INCREMENTS + 1)[1:]:
            self.come_to_rest(self.closing, float(late))

    def come_to_rest(self, tension: float, late: float) -> None:
        for _ in range(MOST_STEPS):
            if self.step(tension, late) < AT_REST:
                return
        raise LostError("in motion still")

    # Geometry and forces --------------------------------------------------------------------------

    def beside(self, q: np.ndarray) -> Beside:
        """Where a step ends, the next begins: that is worked out once."""
        if self.last is None or not np.array_equal(self.last[0], q):
            self.last = q.copy(), self.beside_rock(q)
        return self.last[1]

    def beside_rock(self, q: np.ndarray) -> Beside:
        joints, u = fan_out(q, self.shape.end)
        found = phalanges.beside(self.rock, self.shape, joints, u, self.depth)
        share = engaged_share(found.tile_gap, self.shape.travel, self.shape.exponent)
        share = engaged_share(1.0 - share * found.push.imag, 1.0)
        arms = (joints + found.place * u)[None, :] - joints[:, None]
        # in the axes of the contact's force: it presses along +i and drags along −1
        arms = np.triu(arms * (found.push / 1j * u).conj()[None, :])
        return Beside(found.gap, share, -arms.imag, -arms.real)

    def shears(self, beside: Beside, tension: float, late: float) -> np.ndarray:
        modes, sides = np.array(self.modes), np.array(self.sides)
        part = np.where(self.been | (modes == ROCK), 1.0, late)
        # off the rock, a phalanx whose joint is at a limit is drawn in by nothing
        bears = (modes != AIR) | (sides == FREE)
        return np.asarray(np.where(bears, part, 0.0) * self.drag * self.holding(beside) * tension)

    def holding(self, beside: Beside) -> np.ndarray:
        """Return the share of each tile's spines that hold."""
        return np.asarray((beside.share - self.off).clip(0.0))

    def torque(self, beside: Beside, q: np.ndarray, tension: float, late: float) -> np.ndarray:
        """Of tendon, springs and drag; the normal forces are still to be found."""
        springs = self.preload + self.stiffness * q
        drag = beside.along @ self.shears(beside, tension, late)
        return np.asarray(tension * self.pull - springs + drag)

    # A step ---------------------------------------------------------------------------------------

    def step(self, tension: float, late: float) -> float:
        """Move for a while; return by how much the joints turned, had it been long [rad]."""
        self.steps += 1
        self.back_to_the_rock()
        here = self.beside(self.q)
        within = self.holding(here) > 0.0
        held = np.array(self.modes) == HELD
        self.least = np.where(
            within & ~held, np.minimum(self.least, here.gap.clip(0.0)), self.least
        )
        self.least = np.where((self.off == 0.0) & ~within, math.inf, self.least)
        # spines hold no longer than rock is within their travel
        self.modes = tuple(np.where(held & ~within, AIR, self.modes).tolist())
        turned = [self.beside_rock(self.q + TURN * e) for e in np.eye(3)]
        d_gap = np.column_stack([(each.gap - here.gap) / TURN for each in turned])

        def whole(beside: Beside, q: np.ndarray) -> np.ndarray:
            return self.torque(beside, q, tension, late) + beside.across @ self.normals

        before = whole(here, self.q)
        stiff = -np.column_stack(
            [
                (whole(each, self.q + TURN * e) - before) / TURN
                for each, e in zip(turned, np.eye(3), strict=True)
            ]
        )
        torque = self.torque(here, self.q, tension, late)
        softest = float(np.linalg.eigvalsh(0.5 * (stiff + stiff.T))[0])
        damping = max(0.0, -2.0 * softest)
        size = self.pull[0] * self.closing
        while damping < 1e6 * size:
            for modes, sides in self.ways(here, within):
                found = self.moved(here, d_gap, stiff, damping, torque, modes, sides, within)
                if found is not None:
                    break
            else:
                damping = max(4.0 * damping, 0.05 * size)
                continue
            turn, normals = found
            over = self.overloaded(here, normals, modes, within, tension, late)
            if over is not None:
                # its spines are pulled off: it all is different then
                self.off[over], self.been[over] = here.share[over], False
                self.pulled_at[over], self.off_since[over] = max(here.gap[over], 0.0), False
                return LARGEST
            if np.abs(turn).max() <= LARGEST:
                break
            damping = max(2.0 * damping, 0.05 * size)
        else:
            raise LostError("no step")
        changed = modes != self.modes or sides != self.sides
        self.q = np.clip(self.q + turn, self.lower, self.upper)
        self.modes, self.sides, self.normals = modes, sides, normals
        self.after(self.beside(self.q))
        # how far a motion goes on shows in what would move it without oil
        return LARGEST if changed else float(np.abs(turn).max() * (1.0 + damping / 0.05))

    def after(self, beside: Beside) -> None:
        """Note what has become of the spines."""
        on = np.array(self.modes) == ROCK
        lost = (self.off > 0.0) & (beside.gap > self.pulled_at + LIFTED * self.model.tile_length)
        self.off_since |= lost
        again = on & self.off_since
        self.off = np.where(again, 0.0, self.off)
        self.off_since &= ~again
        self.least = np.where(again, 0.0, self.least)
        self.been = (self.been | on) & (self.holding(beside) > 0.0)

    def back_to_the_rock(self) -> None:
        """Take back by how much linearised steps have left the rock, or entered it."""
        for _ in range(4):
            here = self.beside(self.q)
            modes = np.array(self.modes)
            apart = here.gap - np.where(modes == HELD, self.least, 0.0)
            rows = ((modes != AIR) & (np.abs(apart) > TOUCHING)) | (
                (modes == AIR) & (here.gap < -TOUCHING)
            )
            if not rows.any():
                return
            rows |= modes != AIR
            free = np.array(self.sides) == FREE
            turned = [self.beside_rock(self.q + TURN * e).gap for e in np.eye(3)]
            d_gap = np.column_stack([(gap - here.gap) / TURN for gap in turned])[rows][:, free]
            turn, *_ = np.linalg.lstsq(d_gap, -apart[rows], rcond=1e-6)
            self.q[free] += np.clip(turn, -LARGEST, LARGEST)
            self.q = np.clip(self.q, self.lower, self.upper)

    def ways(self, here: Beside, within: np.ndarray) -> Iterator[tuple[tuple[int, ...], ...]]:
        """What may become of phalanges and joints; first what was."""
        yield self.modes, self.sides
        phalanges = [
            [AIR] + [ROCK] * bool(gap < 3e-3) + [HELD] * bool(holds)
            for gap, holds in zip(here.gap, within, strict=True)
        ]
        near = 2.0 * LARGEST
        joints = [
            [FREE] + [OPEN] * bool(q < low + near) + [SHUT] * bool(q > high - near)
            for q, low, high in zip(self.q, self.lower, self.upper, strict=True)
        ]
        for sides in itertools.product(*joints):
            for modes in itertools.product(*phalanges):
                if sum(m != AIR for m in modes) + sum(s != FREE for s in sides) <= 3:
                    yield modes, sides

    def moved(
        self,
        here: Beside,
        d_gap: np.ndarray,
        stiff: np.ndarray,
        damping: float,
        torque: np.ndarray,
        modes: tuple[int, ...],
        sides: tuple[int, ...],
        within: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Return turns and normal forces if phalanges and joints do so; None if they cannot."""
        stiff = stiff + damping * np.eye(3)
        A, b = np.eye(6), np.zeros(6)
        A[:3, :3], b[:3] = stiff, torque
        A[:3, 3:] = -here.across
        # forces on the rock are zero, or as large as keeps the gap where it is to be
        for j, mode in enumerate(modes):
            if mode != AIR:
                A[3 + j] = 0.0
                A[3 + j, :3] = d_gap[j]
                A[3 + j, 3 + j] = -1e-12
                left = here.gap[j] - (self.least[j] if mode == HELD else 0.0)
                # in oil, rounding of a gap that is closed already is no motion
                b[3 + j] = 0.0 if mode == self.modes[j] and damping > 0.0 else -left
        limits = {OPEN: self.lower, SHUT: self.upper}
        for i, side in enumerate(sides):
            if side != FREE:
                A[i], b[i] = np.eye(6)[i], limits[side][i] - self.q[i]
        try:
            found = np.linalg.solve(A, b)
        except np.linalg.LinAlgError:
            return None
        turn, normals = found[:3], found[3:]
        part = min(1.0, LARGEST / max(float(np.abs(turn).max()), 1e-12))
        gap = here.gap + d_gap @ turn * part
        there = self.q + part * turn
        left = torque - stiff @ turn + here.across @ normals
        for j, mode in enumerate(modes):
            if mode == AIR:
                # where it stands wrong already it may at least not go on
                lowest = min(-TOUCHING, here.gap[j] + 1e-12)
                highest = max(self.least[j] + TOUCHING, here.gap[j] - 1e-12)
                if gap[j] < lowest or (within[j] and gap[j] > highest):
                    return None
            if mode == ROCK and normals[j] < -1e-9:
                return None
            if mode == HELD and normals[j] > 1e-9:
                return None
        for i, side in enumerate(sides):
            if side == FREE and not self.lower[i] - 1e-9 <= there[i] <= self.upper[i] + 1e-9:
                return None
            if side * left[i] < -1e-9:
                return None
        return turn, normals

    def overloaded(
        self,
        here: Beside,
        normals: np.ndarray,
        modes: tuple[int, ...],
        within: np.ndarray,
        tension: float,
        late: float,
    ) -> int | None:
        """Return the phalanx whose spines are pulled off, the worst first; None if all hold."""
        s, worst, which, shares = self.surface, 1e-9, None, self.holding(here)
        shears = self.shears(here, tension, late)
        # what the pull needs of drag may come later, and last of all
        drags = self.shears(here, self.closing, 1.0)
        for j, mode in enumerate(modes):
            pull = -normals[j]
            if mode != HELD or pull < 1e-8 or not within[j]:
                continue
            angle = math.atan2(pull, shears[j])
            strength = shares[j] * float(pull_strength(*s.straight_law, angle))
            beyond = max(math.hypot(pull, shears[j]) - strength, s.friction * pull - drags[j])
            if beyond > worst:
                worst, which = beyond, j
        return which
