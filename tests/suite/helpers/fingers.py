"""Random rock under a finger, and what holds of fingers on it, from their geometry alone."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hand_models import Surface
from hand_models.finger import ClosedFinger, FingerModel, OpenFinger, SettledFinger
from hand_models.rock import Hold, Profile
from hand_models.sections import FingerRock, PolylineSection, Section
from hand_models.tile import pull_strength
from tests.suite.helpers.rocks import (
    distance,
    random_axes,
    random_ellipsoid,
    random_hold,
    random_mesh,
    random_profile,
)

DEEPEST = 1e-4
"""How far a phalanx may stand in the rock [m]."""

BALANCED = 1e-6
"""Torque that may be left about a joint at 37 N [N·m]; as much more at more."""

FEW = 1e-3
"""Of a force that counts as none [N]."""

Clearance = Callable[[np.ndarray], np.ndarray]
"""Distances from the rock of points (..., 2) of a finger's plane, negative inside [m]."""


class OnHold(NamedTuple):
    """An open finger, and how far places in its plane are from its rock."""

    opened: OpenFinger
    clearance: Clearance


def random_section(rng: np.random.Generator) -> Section | None:
    """Of any kind, or none; its joint is at the origin, near the rock as a rule."""
    hold = (random_hold, random_ellipsoid, random_profile)[rng.choice(3, p=[0.6, 0.25, 0.15])](rng)
    axes = random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.03)])
    return hold.section(origin, axes[:, 0], axes[:, 2])


def any_hold(rng: np.random.Generator) -> Hold:
    """Of every kind; meshes seldom, as they take long to make."""
    kinds = (random_hold, random_ellipsoid, random_profile, random_mesh)
    hold: Hold = kinds[rng.choice(4, p=[0.6, 0.2, 0.17, 0.03])](rng)
    # a finger takes the outline of its own strip only
    return Profile(hold.outlines[0]) if isinstance(hold, Profile) else hold


def random_opening(model: FingerModel, seed: int) -> OnHold:
    """A finger over any kind of hold."""
    rng = np.random.default_rng(seed)
    hold, axes = any_hold(rng), random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.004, 0.03)])
    if rng.random() < 0.7:
        below = hold.entry(origin, np.array([0.0, 0.0, 1.0]))
        reach = below if math.isfinite(below) else 0.0
        origin[2] += reach - model.tile_height - rng.uniform(0.0, 0.005)
    surface = Surface.from_values({"shear_limit": float(rng.uniform(10.0, 80.0))})
    tension = float(rng.uniform(15.0, 60.0))
    outer = bool(rng.random() < 0.5)
    section = hold.section(origin, axes[:, 0], axes[:, 2])
    x, z = axes[:, 0], axes[:, 2]

    def clearance(points: np.ndarray) -> np.ndarray:
        places = origin + points[..., :1] * x + points[..., 1:] * z
        away = distance(hold, places)
        if isinstance(hold, Profile):
            # where an outline ends rock ends, so that a finger may reach behind it
            first, last = hold.outlines[0][[0, -1], 0]
            if (places[..., 0] < first).any() or (places[..., 0] > last).any():
                return np.asarray(np.abs(away))
        return away

    return OnHold(OpenFinger(FingerRock(section), surface, tension, outer), clearance)


def fractal(rng: np.random.Generator, amplitude: float, roughness: float) -> np.ndarray:
    """An outline (x, z) of rough rock: waves of 200 down to 4 mm.

    Parameters
    ----------
    rng : Generator
    amplitude : float
        Of the longest waves, about [m].
    roughness : float
        With what power of their length the amplitudes of waves grow; rougher if it is less.
    """
    x = np.linspace(-0.1, 0.3, 2001)
    z = np.zeros_like(x)
    longest = 0.2
    length = longest
    while length > 0.004:
        size = amplitude * (length / longest) ** roughness * rng.normal()
        z += size * np.sin(2.0 * np.pi * x / length + rng.uniform(0.0, 2.0 * np.pi))
        length /= 1.5
    return np.column_stack([x, z])


GRASPS = tuple(itertools.product((20.0, 25.0, 30.0, 37.0, 45.0, 60.0), (False, True)))
"""Closing tensions [N], and whether the finger is an outer one."""


def rough_opening(
    model: FingerModel,
    surface: Surface,
    seed: int,
    grasp: tuple[float, bool] = (37.0, False),
) -> OnHold:
    """A finger over rough rock."""
    rng = np.random.default_rng(seed)
    amplitude = 0.5 * 10.0 ** rng.uniform(-3.0, -1.7)
    hold = Profile(fractal(rng, amplitude, float(rng.choice([0.5, 0.7, 0.9]))))
    tilt = rng.uniform(-0.4, 0.4)
    down = np.array([0.0, 0.0, 1.0])
    away = 0.005 + rng.uniform(0.0, 0.03)
    origin = (hold.entry(-down, down) - 1.0 - away) * down
    x = np.array([math.cos(tilt), 0.0, math.sin(tilt)])
    z = np.array([-x[2], 0.0, x[0]])
    section = hold.section(origin, x, z)

    def clearance(points: np.ndarray) -> np.ndarray:
        places = origin + points[..., :1] * x + points[..., 1:] * z
        return np.asarray(distance(hold, places))

    return OnHold(OpenFinger(FingerRock(section), surface, *grasp), clearance)


def lifted(on_hold: OnHold, lift: float) -> OnHold:
    """The same finger, farther from its rock of outlines."""
    opened, clearance = on_hold
    away = np.array([0.0, lift])
    assert isinstance(opened.rock.tile, PolylineSection)
    section = PolylineSection([piece + away for piece in opened.rock.tile.pieces])
    return OnHold(
        opened._replace(rock=FingerRock(section)), lambda points: clearance(points - away)
    )


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


def phalanx_outlines(finger: SettledFinger) -> tuple[np.ndarray, np.ndarray]:
    """Places all around the bar of each phalanx, and along its axis, (3, k, 2) [m].

    A bar is round about its axis: lifted under the tile, then straight on to the next joint.
    """
    model = finger.model
    radius = min(model.frame_radius, model.tile_height)
    near, far = model.tile_range
    along = np.concatenate([np.linspace(near, far, 70), np.linspace(far, model.joint_spacing, 50)])
    axis = along + 1j * np.interp(along, [far, model.joint_spacing], [1.0, 0.0]) * (
        model.tile_height - radius
    )
    slope = np.exp(1j * math.atan2(radius - model.tile_height, model.joint_spacing - far))
    across = np.where(np.arange(len(along)) < 70, 1j, 1j * slope)
    turn = np.exp(1j * np.linspace(0.0, math.tau, 48, endpoint=False))
    corners = axis[[0, 69, -1], None] + radius * turn
    bar = np.concatenate([axis + radius * across, axis - radius * across, corners.ravel()])
    joints = np.array([complex(*contact.joint) for contact in finger.contacts])[:, None]
    u = np.exp(1j * np.array([contact.angle for contact in finger.contacts]))[:, None]
    around, inside = joints + bar * u, joints + axis * u
    return np.stack([around.real, around.imag], -1), np.stack([inside.real, inside.imag], -1)


def from_lines(pieces: Sequence[np.ndarray], points: np.ndarray) -> np.ndarray:
    """How far points (k, 2) are from polylines [m]."""
    start = np.concatenate([piece[:-1] for piece in pieces])
    step = np.concatenate([np.diff(piece, axis=0) for piece in pieces])
    away = points[:, None] - start
    part = np.clip((away * step).sum(axis=-1) / (step**2).sum(axis=-1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(away - part[..., None] * step, axis=-1).min(axis=1))


def _loads_of_all_spines(closed: ClosedFinger, opened: OpenFinger) -> np.ndarray:
    """Return shears, normals and stop torques, (3, 3, 2), if no tile had few spines.

    The joint of a tile with few is taken as locked: only with all of its load it is in balance.
    """
    finger, of_tile = closed.finger, opened.base_tile
    whole = [replace(contact, bearing_share=1.0) for contact in finger.contacts]
    if whole == list(finger.contacts):
        return np.array(closed[1:4])
    finger = SettledFinger(finger.model, tuple(whole))
    shears = finger.shears(opened.tension, of_tile)
    normals = finger.normals(shears, of_tile)
    return np.array([shears, normals, finger.stop_torques(shears, normals, of_tile)])


def faults(on_hold: OnHold, closed: ClosedFinger) -> list[str]:
    """What is wrong with a closed finger; nothing if it stands as Section 5 has it."""
    opened, clearance = on_hold
    finger, tension = closed.finger, opened.tension
    model, wrong = finger.model, []
    around, axes = phalanx_outlines(finger)
    clear = clearance(around).min(axis=1)
    if clear.min() < -DEEPEST:
        wrong.append(f"in the rock: {clear}")
    # rock of outlines is smoothed: on that they press
    if isinstance(opened.rock.tile, PolylineSection):
        clear = np.array([from_lines(opened.rock.tile.pieces, axis).min() for axis in axes])
        clear -= min(model.frame_radius, model.tile_height)
        if clear.min() < -DEEPEST:
            wrong.append(f"in the smoothed rock: {clear}")
    # a chain of phalanges, joints within their limits and where they are said to stand at one
    ends = [contact.end(model.joint_spacing) for contact in finger.contacts]
    starts = [contact.joint for contact in finger.contacts]
    if not np.allclose([(0.0, 0.0), *ends[:-1]], starts, atol=1e-12):
        wrong.append("not a chain")
    q = finger.joint_angles
    limits = {"lower": np.array(model.joint_lower), "upper": np.array(model.joint_upper)}
    if (q < limits["lower"] - 1e-9).any() or (q > limits["upper"] + 1e-9).any():
        wrong.append(f"beyond its joints' limits: {q}")
    for i, contact in enumerate(finger.contacts):
        if contact.stop in limits and abs(q[i] - limits[contact.stop][i]) > 1e-9:
            wrong.append(f"joint {i} is not at its limit")
    if len(finger.free) != len(finger.bearing):
        wrong.append("not as many joints held as phalanges bear")
    # in balance at the closing tension; stops only push
    powers = np.array([1.0, tension])
    shear, normal, stop = _loads_of_all_spines(closed, opened) @ powers
    left = torques(finger, tension, opened.base_tile, shear, normal)
    for i, contact in enumerate(finger.contacts):
        held = {"upper": max(left[i], 0.0), "lower": min(left[i], 0.0)}.get(contact.stop or "", 0.0)
        if abs(left[i] - held) > BALANCED * max(1.0, tension / 37.0):
            wrong.append(f"joint {i} ({contact.stop}) is left with {left[i]:.3g} N·m")
        if abs(left[i] - stop[i]) > 1e-9 * max(1.0, np.abs(normal).max()):
            wrong.append(f"the torque at joint {i} is not what it is said to be")
    # what presses is on the rock, what pulls is held
    shear, normal = (values @ powers for values in closed[1:3])
    local = (1.0 - model.friction) ** (np.arange(3) + (1 if opened.base_tile else 0))
    drag = local * np.array(model.engagement) * tension
    surface = opened.surface
    for i, contact in enumerate(finger.contacts):
        share = finger.engagement[i]
        if not math.isclose(shear[i], share * drag[i], abs_tol=1e-9):
            wrong.append(f"phalanx {i} is dragged with {shear[i]} N")
        if normal[i] > FEW and clear[i] > DEEPEST:
            wrong.append(f"phalanx {i} presses with {normal[i]:.3g} N across {clear[i]:.2g} m")
        if contact.kind == "frame" and clear[i] > DEEPEST:
            wrong.append(f"phalanx {i} is on no rock: {clear[i]:.2g} m")
        if contact.kind == "none" and (normal[i] != 0.0 or shear[i] != 0.0):
            wrong.append(f"phalanx {i} is loaded in the air")
        if normal[i] < -FEW:
            angle = math.atan2(-normal[i], shear[i])
            most = share * float(pull_strength(*surface.straight_law, angle))
            if math.hypot(shear[i], normal[i]) > most * (1.0 + 1e-6) + FEW:
                wrong.append(f"phalanx {i} is held with {normal[i]:.3g} N of {most:.3g} N")
            if shear[i] < -surface.friction * normal[i] - FEW:
                wrong.append(f"phalanx {i} is held with {normal[i]:.3g} N by {shear[i]:.3g} N")
    # none is left open under tension
    if not finger.bearing and any(contact.stop == "lower" for contact in finger.contacts):
        wrong.append("open, in the air")
    return wrong
