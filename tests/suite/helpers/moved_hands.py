"""Hands on rock that is moved by micrometres: how their contacts and supports change.

``python -m tests.suite.helpers.moved_hands 0 200`` scans 200 hands and prints those that change.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from hand_models import Grasp, InvalidInputError, Pose, SettledHand, Surface
from hand_models.fixed_wrist import wrench_spaces
from hand_models.hand import Placement
from hand_models.rock import Hold, Profile
from tests.suite.helpers.fingers import fractal
from tests.suite.helpers.hands import HAND
from tests.suite.helpers.rocks import random_mesh, random_profile

MICROMETRE = 1e-6

PLACES = 61
"""One micrometre apart."""

LEAST = 0.05
"""Scale of a support, at least, in parts of the largest of its kind (force or moment)."""

DIRECTIONS = np.vstack([np.eye(6), -np.eye(6)])


class Scan(NamedTuple):
    """A hand at n places of its rock.

    Attributes
    ----------
    kinds : ndarray of int, shape (n, 12)
        Codes of the contacts of its phalanges.
    supports : ndarray, shape (n, 12)
        Largest force [N] or moment [N·m] along ± each axis of H.
    """

    kinds: np.ndarray
    supports: np.ndarray

    def flips(self) -> list[tuple[int, int]]:
        """Places and phalanges whose contact is unlike those on both sides, which are alike."""
        before, here, after = self.kinds[:-2], self.kinds[1:-1], self.kinds[2:]
        found = np.argwhere((here != before) & (before == after))
        return [(1 + place, phalanx) for place, phalanx in found.tolist()]

    def steps(self) -> np.ndarray:
        """Return the largest change of a support between neighbours, in parts of its scale."""
        largest = np.abs(self.supports).max(axis=0)
        kinds = largest.reshape(2, 2, 3).max(axis=(0, 2))
        scale = np.maximum(largest, LEAST * np.tile(np.repeat(kinds, 3), 2))
        return np.asarray((np.abs(np.diff(self.supports, axis=0)) / scale).max(axis=1))


def gentle_profile(rng: np.random.Generator) -> Profile:
    """A knoll with waves of 20 to 300 mm."""
    x = np.linspace(-0.25, 0.25, int(rng.choice([21, 51, 101])))
    z = rng.uniform(0.3, 3.0) * x**2 * rng.uniform(0.2, 1.5)
    for _ in range(5):
        length = 10.0 ** rng.uniform(-1.7, -0.5)
        size = 0.03 * length * rng.normal()
        z = z + size * np.sin(2.0 * np.pi * x / length + rng.uniform(0.0, 6.28))
    return Profile(np.column_stack([x, z - z.min()]))


def rough_profile(rng: np.random.Generator) -> Profile:
    """A wall with waves of 4 to 200 mm."""
    outline = fractal(rng, 10.0 ** rng.uniform(-3.0, -2.0), float(rng.choice([0.5, 0.7, 0.9])))
    outline[:, 0] -= 0.1
    outline[:, 1] -= outline[np.abs(outline[:, 0]) < 0.06, 1].min()
    return Profile(outline[::4])


def random_placement(seed: int) -> tuple[Placement, np.ndarray]:
    """A hand a little off its seat on a mesh or profile, and a direction to move its rock in."""
    rng = np.random.default_rng(seed)
    make = (random_profile, random_mesh, gentle_profile, rough_profile)[seed % 4]
    for _ in range(50):
        hold: Hold = make(rng)
        surface = Surface.named(str(rng.choice(["rock", "concrete-coarse"])))
        turned = rng.choice([math.pi, 0.0, rng.uniform(0.0, math.pi)], p=[0.5, 0.25, 0.25])
        grasp = Grasp(float(turned), closing_tension=float(rng.uniform(15.0, 45.0)))
        try:
            seat = HAND.settle(hold, surface, grasp).seating.pose
            off = rng.normal(size=3) * [5e-3, 5e-3, 2e-3] + [0.0, 0.0, 2e-3]
            turn = Rotation.from_rotvec(rng.normal(size=3) * 0.03).as_matrix()
            pose = Pose(seat.position + off, turn @ seat.rotation)
            HAND.settle(hold, surface, grasp, pose)
        except InvalidInputError:
            continue
        ways = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], rng.normal(size=3)])
        way = ways[seed // 4 % 3]
        return Placement(hold, surface, grasp, pose), way / np.linalg.norm(way)
    raise ValueError(f"no hand of seed {seed} closes")


def scanned(placement: Placement, way: np.ndarray, places: Sequence[float] = range(PLACES)) -> Scan:
    """Close a hand with its rock moved along a direction by micrometres."""
    pose = placement.hold_in_hand
    assert pose is not None
    moved = [
        placement._replace(
            hold_in_hand=Pose(pose.position + place * MICROMETRE * way, pose.rotation)
        )
        for place in places
    ]
    hands = [each for each in HAND.settle_each(moved) if isinstance(each, SettledHand)]
    kinds = np.array([hand.postures.kinds.ravel() for hand in hands])
    spaces = wrench_spaces(hands)
    return Scan(kinds, np.array([[space.support(d) for d in DIRECTIONS] for space in spaces]))


if __name__ == "__main__":
    first, count = map(int, sys.argv[1:3])
    for seed in range(first, first + count):
        scan = scanned(*random_placement(seed))
        steps = scan.steps()
        if scan.flips() or steps.max() > 0.01:
            print(seed, scan.flips(), f"{steps.max():.3f} at {steps.argmax()}", flush=True)
