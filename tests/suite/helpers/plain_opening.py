"""One finger that opens, simulated step by step: for reading, and to compare with.

The law is that of `hand_models.finger.finger_path`. Here rock and joint stops are stiff springs,
the joints move in oil, and the tension is lowered by small increments, at each of which the finger
comes to rest before its spines are looked at. So no contact is ever switched.

Only where a phalanx is beside the rock, and where and along which direction a contact's force acts
(`phalanx_beside`), is shared with what is compared.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.finger import FingerModel, OpenFinger, SettledFinger
from hand_models.finger.phalanx_shape import PhalanxShape, fan_out
from hand_models.sections import Outlines
from hand_models.tile import engaged_share
from tests.suite.helpers import phalanges

ROCK = 1e6
"""Stiffness of rock, and of spines in pull [N/m]."""

STOP = 1e3
"""Stiffness of joint stops [N·m/rad]."""

LARGEST = 4e-3
"""Turn of a joint in a step [rad]."""

AT_REST = 5e-6
"""Torque that is none, in parts of the tendon's about the proximal joint at closing."""

NEAR = 1e-4
"""Gap of a tile that lies on the rock, as the closed hand has it [m]."""

SMALLEST = 1e-8
"""Turn below which torques may grow as they will [rad]."""

GROWN = 2e-3
"""Growth of a torque in a step, in the same parts."""

MOST_STEPS = 1000
"""At one tension."""

TURN = 1e-7
"""For derivatives [rad]."""


class LostError(Exception):
    """The finger does not come to rest."""


class PlainOpening:
    """A closed finger whose tendon is let go.

    Attributes
    ----------
    q, shears, normals : ndarray, shape (3,)
        Turns of its joints [rad]; loads of its phalanges on the rock [N].
    grip : ndarray, shape (3,)
        Share of each tile's spines that hold.
    let_go : list of (int, float)
        Phalanges whose spines have let go, and at which tension [N].
    """

    def __init__(self, model: FingerModel, opened: OpenFinger, closed: SettledFinger) -> None:
        self.model, self.surface, self.closing = model, opened.surface, opened.tension
        self.shape = PhalanxShape.of(model)
        reach = model.reach + model.tile_length
        self.rock = Outlines.of([opened.rock], reach, self.shape.spacing)
        loss = model.losses(opened.base_tile)
        self.pull, self.drag = loss * model.pulley_radii, loss * model.engagement
        self.gain = loss * model.shear_gain
        self.depth = self.pull * self.closing / (model.tile_centre * model.bed_stiffness)
        self.size = float(self.pull[0]) * self.closing
        self.q, self.grip = closed.joint_angles.copy(), closed.engagement.copy()
        gap, *_ = self.beside(self.q)
        self.least = np.where(gap < NEAR, 0.0, gap)
        # a tile beside a joint's stop that bears nothing is drawn in by nothing
        self.grip[[contact.kind == "none" for contact in closed.contacts]] = 0.0
        self.shears = self.normals = np.zeros(3)
        self.let_go: list[tuple[int, float]] = []

    def beside(self, q: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return what is beside the phalanges.

        Gaps, shares, arms (3, 3) of unit shears and normal forces about joints; and places of
        contacts and unit vectors of normal forces, as complex numbers in F.
        """
        joints, u = fan_out(q, self.shape.end)
        within = self.depth + 1e-4
        near = phalanges.points_near(self.rock, self.shape, joints, u, within)
        found = phalanges.beside(self.rock, self.shape, joints, u, self.depth, near)
        share = np.array(list(map(self.on_rock, joints, u, found.tile_gap)))
        share = engaged_share(1.0 - share * found.push.imag, 1.0)
        arms = (joints + found.place * u)[None, :] - joints[:, None]
        arms = np.triu(arms * (found.push / 1j * u).conj()[None, :])
        return found.gap, share, -arms.imag, -arms.real, joints + found.place * u, found.push * u

    def on_rock(self, joint: complex, u: complex, tile_gap: float) -> float:
        """Return the share of a tile's spines that reach the rock: the mean over its strips."""
        s, behind = self.shape, self.rock.behind[0]
        seen = (self.rock.places[0] - joint) * u.conjugate()
        away = np.abs(seen - seen.real.clip(s.near, s.far) - 1j * s.lift)
        near = away - away.min(initial=math.inf) + tile_gap < s.travel
        farther = np.zeros(1)
        if behind.shape[1] > 1 and near.any():
            farther = (away[near, None] + behind[near]).min(axis=0) - away.min()
        return float(np.mean(engaged_share(tile_gap + farther, s.travel, s.exponent)))

    def contacts(self) -> tuple[np.ndarray, np.ndarray]:
        """Return places (x, z) of contacts in F [m], and forces on the rock there [N], (3, 2)."""
        forces = (self.normals + 1j * self.shears) * self.pushes
        places, forces = (np.column_stack([each.real, each.imag]) for each in (self.places, forces))
        return places, forces

    def torque(self, q: np.ndarray, tension: float) -> np.ndarray:
        """Return the torque on each joint, and note the loads."""
        gap, share, along, across, self.places, self.pushes = self.beside(q)
        law = self.drag * self.closing - self.gain * (self.closing - tension)
        held = np.minimum(share, self.grip)
        law, held = held * law, (held > 0.0) & (law >= 0.0)
        pull = np.where(held, (gap - self.least).clip(0.0), 0.0)
        self.normals = ROCK * ((-gap).clip(0.0) - pull)
        friction = self.surface.friction * self.normals.clip(0.0)
        self.law, self.share, self.shears = law, share, np.maximum(law, -friction)
        m = self.model
        stops = (q - m.joint_upper).clip(0.0) + (q - m.joint_lower).clip(None, 0.0)
        springs = np.array(m.joint_preload) + np.array(m.joint_stiffness) * q + STOP * stops
        return np.asarray(
            tension * self.pull - springs + along @ self.shears + across @ self.normals
        )

    def lower_to(self, tension: float) -> None:
        """Let the finger come to rest at a lower tension, and its spines go that bear too much."""
        while True:
            self.come_to_rest(tension)
            # nothing is caught anew
            out = (self.grip > 0.0) & (self.share == 0.0)
            self.let_go += [(j, tension) for j in out.nonzero()[0].tolist()]
            self.grip = np.minimum(self.grip, self.share)
            beyond = np.where(self.grip > 0.0, self.overloads(), 0.0)
            worst = int(beyond.argmax())
            if beyond[worst] <= 1e-6:
                break
            self.grip[worst] = 0.0
            self.let_go.append((worst, tension))

    def overloads(self) -> np.ndarray:
        """Return by how much the spines of each tile bear too much; they do not where pressed."""
        pull, s = (-self.normals).clip(0.0), self.surface
        over = np.where(self.normals > 0.0, 0.0, s.friction * pull - self.law)
        for j in (pull > 0.0).nonzero()[0].tolist():
            strength = self.grip[j] * s.strength(math.atan2(pull[j], self.law[j]))
            over[j] = max(over[j], math.hypot(self.law[j], pull[j]) - strength)
        return np.asarray(over)

    def come_to_rest(self, tension: float) -> None:
        """Let the joints move: steps of implicit Euler, shorter where torques grow."""
        oil, here = 0.02 * self.size, self.torque(self.q, tension)
        for _ in range(MOST_STEPS):
            left = float(np.abs(here).max())
            if left < AT_REST * self.size:
                return
            stiff = np.column_stack(
                [(here - self.torque(self.q + TURN * e, tension)) / TURN for e in np.eye(3)]
            )
            # what is unstable grows by a part within a step
            unstable = -2.0 * float(np.linalg.eigvals(stiff).real.min())
            oil = max(oil, min(unstable, self.size))
            while True:
                turn = np.linalg.solve(stiff + oil * np.eye(3), here)
                size = float(np.abs(turn).max())
                there = self.torque(self.q + turn, tension)
                grown = float(np.abs(there).max()) - left
                if size < LARGEST and (grown < 0.1 * left or grown < GROWN * self.size):
                    break
                if size < SMALLEST:
                    break
                oil *= 4.0
            self.q, here, oil = self.q + turn, there, max(0.4 * oil, 1e-6)
        raise LostError(f"in motion still at {tension:.2f} N")
