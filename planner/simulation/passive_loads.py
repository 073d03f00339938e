"""Balance of passive loads: springs between a rigid body and the rock, some with limits.

The body moves by the twist b that solves

    Σ g_i clip(x_i + k_i g_iᵀ b, l_i, h_i) = r

over the loads x_i before, their stiffnesses k_i, their wrenches g_i per newton, and their limits.
It is the least elastic energy of the changes, and b minimises a convex function, the dual one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array

__all__ = ["BALANCE_SETTINGS", "balanced"]


@dataclass(frozen=True, slots=True)
class BalanceSettings:
    """Tolerances of the balance of passive loads."""

    balance: float = 1e-7
    """Missing wrench that counts as none: forces, and moments over 0.1 m [N]."""
    lost: float = 1e-5
    """Missing wrench beyond which there is no balance [N]: far above rounding."""
    rubs: float = 0.005
    """Part of the force that the body needs, up to which friction of tendons and drives holds what
    is missing along each axis: it holds several hundredths of a tension, and without it a change of
    0.02 N would let fall a stance whose palms press nowhere."""
    soft: float = 1e-2
    """Stiffness of that friction over a tile's sideways: little, so that it holds what is left."""
    moved: float = 0.1
    """Way, and turn over 0.1 m, by which a body has moved off its hands [m]: springs reach by
    millimetres."""
    steps: int = 60  # of Newton's method; 3 to 8 are the rule
    good_step: float = 0.1
    """Part of the slope along a step that may be left at its end without a search for the least."""
    singular: float = 1e-12
    """Part of the stiffest direction that keeps others from being singular once all are at limits.
    """
    far: float = 1e3
    """The same, at which the search for a balance ends [m]: a step on the way may go far."""


BALANCE_SETTINGS: Final = BalanceSettings()


def balanced(
    wrenches: Array, loads: Array, springs: Array, least: Array, most: Array, missing: Array
) -> tuple[Array, Array]:
    """Return passive loads (S, n) and the largest part of the wrench that they miss, (S,).

    Infinite where the body would move off its hands.
    See the module's equation.

    Newton's method on the convex dual function of b, to the least along each step.

    Parameters
    ----------
    wrenches : ndarray, shape (S, n, 6)
        g of each load, moments over 0.1 m.
    loads, springs, least, most : ndarray, shape (S, n)
        x, k, l and h.
    missing : ndarray, shape (S, 6)
        r − Σ g x.
    """
    found, twist = loads.copy(), np.zeros(missing.shape)
    due = missing + _times(loads, wrenches)
    off = np.abs(missing).max(axis=1)
    going = np.flatnonzero(off > BALANCE_SETTINGS.balance)
    for _ in range(BALANCE_SETTINGS.steps):
        if not len(going):
            break
        g, x, k, low, high = (each[going] for each in (wrenches, loads, springs, least, most))
        r, b = due[going], twist[going]
        free = x + k * _along(g, b)
        short = r - _times(np.clip(free, low, high), g)
        moving = k * ((free >= low) & (free <= high))
        slope = (g * moving[..., None]).swapaxes(1, 2) @ g
        soft = BALANCE_SETTINGS.singular * (k[..., None] * g**2).sum(axis=(1, 2)) + 1e-30
        step = np.linalg.solve(slope + soft[:, None, None] * np.eye(6), short[..., None])[..., 0]
        along = _along(g, step)
        share = _least_along(free, k * along, low, high, along, (step * r).sum(axis=1))
        twist[going] = b + share[:, None] * step
        found[going] = kept = np.clip(x + k * _along(g, twist[going]), low, high)
        off[going] = np.abs(r - _times(kept, g)).max(axis=1)
        gone = ~(np.abs(twist[going]).max(axis=1) < BALANCE_SETTINGS.far)
        going = going[(off[going] > BALANCE_SETTINGS.balance) & ~gone]
    off[np.abs(twist).max(axis=1) > BALANCE_SETTINGS.moved] = np.inf
    return found, off


def _least_along(
    free: Array, change: Array, low: Array, high: Array, along: Array, work: Array
) -> Array:
    """Return the multiple of a step at which the dual function is least, shape (S,).

    Its slope Σ a_i clip(f_i + t c_i, l_i, h_i) − w rises with t, linearly between the t at which
    loads meet their limits. Where it never reaches zero, a multiple far beyond is returned.

    Parameters
    ----------
    free, change, low, high, along : ndarray, shape (S, n)
        f, c, l, h and a.
    work : ndarray, shape (S,)
        w.
    """

    def slope(at: Array) -> Array:
        loads = free[:, None] + at[..., None] * change[:, None]
        return np.asarray(
            (np.clip(loads, low[:, None], high[:, None]) @ along[..., None])[..., 0] - work[:, None]
        )

    found = np.ones(len(free))
    whole = slope(np.array([[0.0, 1.0]] * len(free)))
    # with a whole step that is as good as the least, there is nothing to search
    hard = np.flatnonzero(np.abs(whole[:, 1]) > BALANCE_SETTINGS.good_step * np.abs(whole[:, 0]))
    if not len(hard):
        return found
    free, change, low, high, along, work = (
        each[hard] for each in (free, change, low, high, along, work)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        meets = np.hstack([(low - free) / change, (high - free) / change])
    meets = np.sort(np.where(np.isfinite(meets) & (meets > 0.0), meets, 0.0), axis=1)
    ends = np.hstack([meets, 2.0 * meets[:, -1:] + 1.0])
    slopes = slope(ends)
    rises = slopes >= 0.0
    last, row = ends.shape[1] - 1, np.arange(len(hard))
    j = np.where(rises.any(axis=1), rises.argmax(axis=1), last)
    i = np.maximum(j - 1, 0)
    (t0, d0), (t1, d1) = ((ends[row, at], slopes[row, at]) for at in (i, j))
    steep = np.where(t1 > t0, (d1 - d0) / np.where(t1 > t0, t1 - t0, 1.0), 0.0)
    exact = t0 - d0 / np.where(steep > 0.0, steep, 1.0)
    found[hard] = np.where(steep > 0.0, exact, np.where(d1 < 0.0, 1e12, t1))
    return found


def _along(wrenches: Array, twists: Array) -> Array:
    """Return g_iᵀ b, shape (S, n)."""
    return np.asarray((wrenches @ twists[..., None])[..., 0])


def _times(loads: Array, wrenches: Array) -> Array:
    """Return Σ x_i g_i, shape (S, 6)."""
    return np.asarray((loads[:, None] @ wrenches)[:, 0])
