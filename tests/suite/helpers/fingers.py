"""Random rock under a finger, and what a finger's joints bear, from its geometry alone."""

from __future__ import annotations

import numpy as np

from hand_models.finger import SettledFinger
from hand_models.sections import Section
from tests.suite.helpers.rocks import random_axes, random_ellipsoid, random_hold, random_profile


def random_section(rng: np.random.Generator) -> Section | None:
    """Of any kind, or none; its joint is at the origin, near the rock as a rule."""
    hold = (random_hold, random_ellipsoid, random_profile)[rng.choice(3, p=[0.6, 0.25, 0.15])](rng)
    axes = random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.03)])
    return hold.section(origin, axes[:, 0], axes[:, 2])


def torques(
    finger: SettledFinger, tension: float, outer: bool, shear: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Torque about each joint of the rock's forces, tendon and springs."""
    model = finger.model
    local = tension * (1.0 - model.friction) ** (np.arange(3) + (1 if outer else 0))
    points, u = finger.points, finger.directions
    force = shear[:, None] * u - normal[:, None] * np.column_stack([-u[:, 1], u[:, 0]])
    total = np.zeros(3)
    for i, contact in enumerate(finger.contacts):
        arms = points[i:] - np.array(contact.joint)
        total[i] = (arms[:, 0] * force[i:, 1] - arms[:, 1] * force[i:, 0]).sum()
        angle = contact.angle - (finger.contacts[i - 1].angle if i else 0.0)
        total[i] += local[i] * model.pulley_radii[i]
        total[i] -= model.joint_stiffness[i] * angle + model.joint_preload[i]
    return total
