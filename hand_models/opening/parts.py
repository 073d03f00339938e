"""Parts of a hand's wrench on the rock while its tendons let go, or tighten.

- The phalanges of a finger are those of its `FingerPath`.
- A tile on a finger's base is dragged by the tendon as the others are; it is not pressed, so it
  lets go where its shear reaches zero.
- A nail's force is that of its closed hand as long as it can stay hooked (`Cling`), with the axial
  force nearest to zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.finger import PHALANGES, FingerPath, OpenFinger
from hand_models.hand import FINGERS, FingerFrame, SettledHand

__all__ = ["PATH_SETTINGS", "Part", "base_parts", "nail_parts", "open_fingers", "phalanx_parts"]


@dataclass(frozen=True)
class PathSettings:
    """Tolerances of the knots of a path."""

    force: float = 0.5
    """Largest distance of the hand's force from the straight line between knots [N]: beside the
    20 N with which a closed finger bears on the rock, a fortieth."""
    moment: float = 0.05
    """The same of the moment [N·m], at a tenth of a metre from the hand's origin."""
    pull: float = 1e-6
    """Force beyond which spines pull, or a phalanx presses, at the end of a path [N]."""
    snap: float = 1e-9
    """Difference of tension over which a snap is drawn [N], so that paths are functions of it."""


PATH_SETTINGS: Final = PathSettings()


class Part(NamedTuple):
    """Wrench of some tiles of one finger on the rock, over the path parameter s.

    s is the tension on a closing path, and how far it has been lowered on an opening path [N].

    Attributes
    ----------
    at : ndarray, shape (k,)
        s, strictly increasing.
    wrenches : ndarray, shape (k, 6)
    tiles : tuple of int
        Indices of the t tiles.
    engagement : ndarray, shape (k, t)
    bearing : ndarray of bool, shape (k, t)
    turns : sequence of float, length t
        s at which each tile lets go, or catches; NaN if it does not.
    joints : ndarray, shape (k, 3), or None
        Joint angles, where the tiles are those of the phalanges.
    """

    at: Array
    wrenches: Array
    tiles: tuple[int, ...]
    engagement: Array
    bearing: NDArray[np.bool_]
    turns: Sequence[float]
    joints: Array | None = None


def open_fingers(hand: SettledHand) -> list[OpenFinger]:
    """Return the fingers of a hand as they were before they closed, in the order of `FINGERS`."""
    there = hand.seating.pose.inverse()
    frames = hand.hand.frames(hand.grasp.outer_rotation)
    return [
        OpenFinger(frame.rock(hand.hold, there), hand.surface, hand.closing_tension, base_tile)
        for frame, base_tile in zip(frames, hand.hand.rubbing, strict=True)
    ]


def _wrenches(places: Array, forces: Array) -> Array:
    """Return wrenches about the origin of H of forces (k, t, 3) at places, shape (k, 6)."""
    moments = np.cross(places, forces).sum(axis=1)
    return np.concatenate([forces.sum(axis=1), moments], axis=1)


def phalanx_parts(hand: SettledHand, paths: Sequence[FingerPath], *, opens: bool) -> Iterator[Part]:
    """Yield what the phalanges of each finger do; a closed hand's numbers are its own."""
    closing = hand.closing_tension
    loads = hand.tile_loads(np.full(len(FINGERS), closing))
    frames = hand.hand.frames(hand.grasp.outer_rotation)
    for i, (path, frame) in enumerate(zip(paths, frames, strict=True)):
        tiles = tuple(
            k
            for k, tile in enumerate(hand.tiles)
            if tile.finger == FINGERS[i] and tile.phalanx in PHALANGES
        )
        own, finger = list(tiles), hand.fingers[i]
        closed_forces = np.einsum("tk,tkx->tx", loads[own], hand.axes[own])
        wrench = _wrenches(hand.positions[own][None], closed_forces[None])
        share = hand.engagement[own][None]
        bears = np.isin(range(len(PHALANGES)), finger.bearing)[None]
        q = finger.joint_angles[None]
        at = closing - path.tensions if opens else path.tensions
        along = _along(frame, path)
        on_path: list[NDArray[Any]] = [at, along, path.engagement, path.bears, path.joints]
        closed = [np.full(1, 0.0 if opens else closing), wrench, share, bears, q]
        s, w, phi, touch, joints = (
            np.concatenate([own, each] if opens else [each[:-1], own])
            for each, own in zip(on_path, closed, strict=True)
        )
        # strictly increasing: a snap, or drag that grows at one tension, takes no time
        s = s + PATH_SETTINGS.snap * np.arange(len(s))
        turns = np.where(share[0] > 0.0, np.fmin(path.touches, closing), np.nan)
        if opens:
            last = np.count_nonzero(phi > 0.0, axis=0) - 1
            turns = np.where((last >= 0) & (last < len(s) - 1), s[last], np.nan)
        yield Part(s, w, tiles, phi, touch, turns.tolist(), joints)


def _along(frame: FingerFrame, path: FingerPath) -> Array:
    """Return the wrench in H of a finger's phalanges on its path, shape (k, 6)."""
    into = np.cross(frame.along, frame.across)

    def in_hand(numbers: NDArray[np.complex128]) -> Array:
        return np.asarray(numbers.real[..., None] * frame.along + numbers.imag[..., None] * into)

    places = frame.joint + in_hand(path.places) + path.across[..., None] * frame.across
    forces = in_hand((path.normals + 1j * path.shears) * path.pushes)
    return _wrenches(places, forces)


def base_parts(hand: SettledHand, *, opens: bool) -> Iterator[Part]:
    """Yield what the tiles on the bases of the outer fingers do."""
    closing = hand.closing_tension
    for k, tile in enumerate(hand.tiles):
        if tile.phalanx != "base" or not hand.engagement[k] > 0.0:
            continue
        at_zero, slope = hand.loads[k, 0].tolist()
        full = at_zero + slope * closing
        at, shears = np.array([0.0, closing]), np.array([0.0, full])
        share = np.full(2, hand.engagement[k])
        if opens:
            ends = min(full / slope, closing) if slope > 0.0 else closing
            at = np.array([0.0, ends, ends + PATH_SETTINGS.snap])
            left = full - slope * ends
            lasts = left > PATH_SETTINGS.snap
            shears, share = np.array([full, left, left * lasts]), np.append(share, share[0] * lasts)
        forces = shears[:, None, None] * hand.axes[k, :1]
        wrenches = _wrenches(hand.positions[k, None], forces)
        turns = [at.item(1) if opens and share[-1] == 0.0 else math.nan]
        yield Part(at, wrenches, (k,), share[:, None], share[:, None] > 0.0, turns)


def nail_parts(hand: SettledHand, *, opens: bool) -> Iterator[Part]:
    """Yield what the nails that hook do."""
    closing = hand.closing_tension
    for k, (H, h) in zip(hand.nails.nonzero()[0].tolist(), hand.nail_rows, strict=True):
        force = hand.loads[k, 1]
        low, high = 0.0, closing
        for _ in range(48):  # halvings
            middle = 0.5 * (low + high)
            low, high = (low, middle) if _axial(H, h, force, middle) is not None else (middle, high)
        f = np.linspace(high, closing, 9)
        axial = [_axial(H, h, force, tension) or 0.0 for tension in f.tolist()]
        loads = np.column_stack([axial, force[0] + force[1] * f])
        wrenches = _wrenches(hand.positions[k, None], (loads @ hand.axes[k, :2])[:, None])
        off = np.array([high - PATH_SETTINGS.snap])
        s = np.concatenate([off, f])
        wrenches = np.vstack([np.zeros((1, 6)), wrenches])
        hooked = np.arange(len(s)) > 0
        if opens:
            s, wrenches, hooked = closing - s[::-1], wrenches[::-1], hooked[::-1]
        turns = [closing - high if opens else high]
        yield Part(s, wrenches, (k,), hooked[:, None].astype(float), hooked[:, None], turns)


def _axial(H: Array, h: Array, force: Array, tension: float) -> float | None:
    """Return the axial force nearest to zero with which a nail stays hooked [N]; None if none."""
    if force[0] + force[1] * tension < 0.0:
        return None
    slope, left = H[:, 1], h - H[:, 0] * tension
    below, above, still = slope < 0.0, slope > 0.0, slope == 0.0
    least = (left[below] / slope[below]).max(initial=-np.inf)
    most = (left[above] / slope[above]).min(initial=np.inf)
    if least > most or left[still].min(initial=0.0) < 0.0:
        return None
    return float(np.clip(0.0, least, most))
