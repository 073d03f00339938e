"""One finger that opens, simulated step by step: for reading, and to compare with.

The joints move in oil as those of a `PlainFinger` do that closes, while the tension is lowered by
small increments; the law is that of `hand_models.finger.finger_path`. Where spines let go is found
here by the force that they bear once the joints are at rest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from hand_models.finger import FingerModel, OpenFinger, SettledFinger
from tests.suite.helpers.plain_closing import (
    AIR,
    AT_REST,
    FREE,
    HELD,
    LARGEST,
    MOST_STEPS,
    OPEN,
    ROCK,
    SHUT,
    TURN,
    Beside,
    LostError,
    PlainFinger,
)

SLIDES = 3
"""What may become of a phalanx besides: pressed, it is dragged backwards against friction."""

NONE = 1e-7
"""A force that counts as none [N]."""

HARDLY = 1e-3
"""A force with which a tile hardly presses [N]."""


class PlainOpening(PlainFinger):
    """A closed finger whose tendon is let go.

    Attributes
    ----------
    let_go : list of (int, float)
        Phalanges whose spines have let go, and at which tension [N].
    """

    def __init__(self, model: FingerModel, opened: OpenFinger, closed: SettledFinger) -> None:
        super().__init__(model, opened)
        loss = model.losses(opened.base_tile)
        self.gain = loss * model.shear_gain
        self.q = closed.joint_angles.copy()
        here = self.beside(self.q)
        shears = closed.shears(opened.tension, opened.base_tile)
        normals = closed.normals(shears, opened.base_tile) @ [1.0, opened.tension]
        self.grip = closed.engagement.copy()
        self.modes = tuple(
            AIR if kind == "none" or (gap > 1e-4 and n >= 0.0) else ROCK if n >= 0.0 else HELD
            for kind, gap, n in zip(
                (contact.kind for contact in closed.contacts), here.gap, normals, strict=True
            )
        )
        sides = {"upper": SHUT, "lower": OPEN}
        self.sides = tuple(sides.get(contact.stop, FREE) for contact in closed.contacts)
        # on the rock a tile is held where the rock is
        self.least = np.where(here.gap < 1e-4, 0.0, here.gap)
        self.let_go: list[tuple[int, float]] = []

    def lower_to(self, tension: float) -> None:
        """Let the finger come to rest at a lower tension."""
        before = self.grip > 0.0
        for _ in range(MOST_STEPS):
            if self.step(tension, 0.0) < AT_REST and not self.released(tension):
                break
        else:
            raise LostError(f"in motion still at {tension:.2f} N")
        gone = before & (self.grip == 0.0)
        self.let_go += [(j, tension) for j in gone.nonzero()[0].tolist()]

    def laws(self, here: Beside, tension: float) -> np.ndarray:
        """Return the shear of each tile by its tendon alone [N]."""
        lowered = self.closing - tension
        bears = (np.array(self.modes) != AIR) | (np.array(self.sides) == FREE)
        whole = self.drag * self.closing - self.gain * lowered
        return np.asarray(np.minimum(here.share, self.grip) * bears * whole)

    def loads(self, tension: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return shears and normal loads [N], and the places and axes of the contacts in F."""
        here = self.beside(self.q)
        slides = np.array(self.modes) == SLIDES
        law = self.laws(here, tension)
        return np.where(slides, -self.surface.friction * self.normals, law), self.normals, self.q

    def released(self, tension: float) -> bool:
        """Let the spines go that bear too much, the worst first; return whether any did."""
        here = self.beside(self.q)
        law, pull = self.laws(here, tension), -self.normals
        pressed = np.isin(self.modes, (ROCK, SLIDES)) & (self.normals > NONE)
        beyond = np.where(pressed, 0.0, self.surface.friction * pull.clip(0.0) - law)
        strength = [
            math.hypot(t, p) - share * self.surface.strength(math.atan2(p, t))
            if p > NONE and share > 0.0
            else 0.0
            for t, p, share in zip(law, pull, np.minimum(here.share, self.grip), strict=True)
        ]
        beyond = np.where(self.grip > 0.0, np.maximum(beyond, strength), 0.0)
        worst = int(beyond.argmax())
        if beyond[worst] <= NONE:
            return False
        self.grip[worst] = 0.0
        if self.modes[worst] in (HELD, SLIDES):
            modes = list(self.modes)
            modes[worst] = AIR
            self.modes = tuple(modes)
        return True

    def step(self, tension: float, late: float) -> float:
        """Move for a while; return by how much the joints turned, had it been long [rad]."""
        self.steps += 1
        self.back_to_the_rock()
        here = self.beside(self.q)
        # nothing is caught anew
        self.grip = np.minimum(self.grip, here.share)
        # a tile that slides and is hardly pressed lets go
        gone = (np.array(self.modes) == SLIDES) & (self.normals < HARDLY)
        self.grip[gone] = 0.0
        self.modes = tuple(np.where(gone, AIR, self.modes).tolist())
        # dragged backwards, spines hold nothing that is not pressed
        within = (self.grip > 0.0) & (self.laws(here, tension) >= -NONE)
        held = np.array(self.modes) == HELD
        self.modes = tuple(np.where(held & ~within, AIR, self.modes).tolist())
        turned = [self.beside(self.q + TURN * e) for e in np.eye(3)]
        d_gap = np.column_stack([(each.gap - here.gap) / TURN for each in turned])
        size, mu = self.pull[0] * self.closing, self.surface.friction
        damping = 0.0
        while damping < 1e6 * size:
            for modes, sides in self.ways(here, within):
                slides = np.array(modes) == SLIDES

                def whole(
                    beside: Beside, q: np.ndarray, slides: np.ndarray = slides
                ) -> tuple[np.ndarray, np.ndarray]:
                    law = np.where(slides, 0.0, self.laws(beside, tension))
                    torque = tension * self.pull - self.preload - self.stiffness * q
                    arms = beside.across - mu * slides * beside.along
                    return torque + beside.along @ law, arms

                torque, arms = whole(here, self.q)
                stiff = np.column_stack(
                    [
                        (torque + arms @ self.normals - there - their @ self.normals) / TURN
                        for there, their in (
                            whole(each, self.q + TURN * e)
                            for each, e in zip(turned, np.eye(3), strict=True)
                        )
                    ]
                )
                if damping == 0.0:
                    softest = float(np.linalg.eigvalsh(0.5 * (stiff + stiff.T))[0])
                    oil = max(0.0, -2.0 * softest)
                else:
                    oil = damping
                plain = tuple(ROCK if mode == SLIDES else mode for mode in modes)
                there = here._replace(across=arms)
                found = self.moved(there, d_gap, stiff, oil, torque, plain, sides, within)
                if found is not None and self.drags(here, found[1], modes, tension):
                    break
            else:
                damping = max(4.0 * damping, 0.05 * size)
                continue
            turn, normals = found
            if np.abs(turn).max() <= LARGEST:
                break
            damping = max(2.0 * damping, 0.05 * size)
        else:
            raise LostError("no step")
        changed = modes != self.modes or sides != self.sides
        self.q = np.clip(self.q + turn, self.lower, self.upper)
        self.modes, self.sides, self.normals = modes, sides, normals
        return LARGEST if changed else float(np.abs(turn).max() * (1.0 + oil / 0.05))

    def drags(
        self, here: Beside, normals: np.ndarray, modes: tuple[int, ...], tension: float
    ) -> bool:
        """Return whether pressed tiles slide just where the tendon drags less than friction."""
        law, mu = self.laws(here, tension), self.surface.friction
        for mode, t, n in zip(modes, law, normals, strict=True):
            if mode == ROCK and t + mu * n < -NONE:
                return False
            if mode == SLIDES and t + mu * n > NONE:
                return False
        return True

    def ways(self, here: Beside, within: np.ndarray) -> Iterator[tuple[tuple[int, ...], ...]]:
        """What may become of phalanges and joints; first what differs least from what was."""
        phalanges = [
            [AIR]
            + [ROCK] * bool(gap < 3e-3)
            + [SLIDES] * bool(gap < 3e-3 and grip > 0.0)
            + [HELD] * bool(holds)
            for gap, holds, grip in zip(here.gap, within, self.grip, strict=True)
        ]
        near = 2.0 * LARGEST
        joints = [
            [FREE] + [OPEN] * bool(q < low + near) + [SHUT] * bool(q > high - near)
            for q, low, high in zip(self.q, self.lower, self.upper, strict=True)
        ]
        now = (*self.modes, *self.sides)
        others = sorted(
            itertools.product(*phalanges, *joints),
            key=lambda way: sum(a != b for a, b in zip(way, now, strict=True)),
        )
        for way in others:
            modes, sides = way[:3], way[3:]
            if sum(m != AIR for m in modes) + sum(s != FREE for s in sides) <= 3:
                yield modes, sides
