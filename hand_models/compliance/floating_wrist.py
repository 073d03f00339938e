"""A hand whose motors stand still while its wrist gives way: its WrenchSpace (Eqs. 9–13, 17).

A twist ξ of the wrist loads every tile, and what the hand holds is everything that some twist gives
without a tile letting go. That set is not convex and not a polyhedron. Linearised at a wrist pose
ξ₀ it is one,

    w = w_g(ξ₀) + K_g(ξ₀) (ξ − ξ₀),    f_t = f_t(ξ₀) + ∂f_t/∂ξ (ξ − ξ₀),

with rows like those of a fixed wrist. The palm carries only where it moves against the rock, so
each of its ways of carrying is a set of its own. A tendon's stick and slip stay as they are at ξ₀.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, Indices
from hand_models.compliance.compliant_finger import STEP
from hand_models.compliance.compliant_hand import CompliantHand, HandLoads
from hand_models.compliance.grasp import Evaluation, Verdict, range_rows
from hand_models.compliance.rolling import Numbers
from hand_models.fixed_wrist import KEPT, RowLayout, layout_of
from hand_models.hand import FINGERS, HELD
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = ["PALM_MODES", "WRIST", "FloatingWrist", "PalmMode"]

WRIST: Final = ("wrist/vx", "wrist/vy", "wrist/vz", "wrist/wx", "wrist/wy", "wrist/wz")
"""Columns of a floating hand's set: the twist of the wrist about H at rest [m, rad]."""

ROUNDING: Final = 1e-9
"""Slope of a load that is none [N/m, N/rad]."""

PALM_ROWS: Final = 1e5
"""Newtons per metre by which rows of the palm's travel are made commensurate."""

PalmMode = Literal["off", "drags", "presses", "drags_and_presses"]
"""How a palm carries: not at all, by moving toward −x, into the rock, or both."""

PALM_MODES: Final[dict[tuple[bool, bool], PalmMode]] = {
    (False, False): "off",
    (True, False): "drags",
    (False, True): "presses",
    (True, True): "drags_and_presses",
}
"""By whether the palm drags, and whether it presses."""


@dataclass(frozen=True, eq=False)
class FloatingWrist:
    """The limits of a compliant hand.

    Attributes
    ----------
    hand : CompliantHand
    tension_limit : float, optional
        A caller's cap on every tendon [N]; the hand's own maximum if that is less.
    palm : {'off', 'drags', 'presses', 'drags_and_presses'}
        How the palm carries in linearised sets, if nothing else is said.
    """

    hand: CompliantHand
    tension_limit: float | None = None
    palm: PalmMode = "off"

    @cached_property
    def layout(self) -> RowLayout:
        """Names and coefficients of the rows."""
        return layout_of(self.hand.settled, sticking=False)

    @cached_property
    def _planes(self) -> tuple[Indices, Array, Array, Array, Array]:
        """Of `RowLayout.planes`, capacities of each tile's spines on the rock."""
        settled = self.hand.settled
        tile, (planes,) = self.layout.plane_tiles, self.layout.planes([settled.surface])
        a_shear, a_normal, a_lateral, capacity = planes.T
        return tile, a_shear, a_normal, a_lateral, capacity * settled.engagement[tile]

    @property
    def limits(self) -> tuple[Row, ...]:
        """Limit rows; the last `HELD` ones are wrench rows."""
        return self.layout.limits

    @cached_property
    def _limit_map(self) -> tuple[Array, Array, Array]:
        """(P, p, s): loads of the limit rows but the wrench rows are P e + p, capacities s.

        e as of `_elements`: shears, normals, laterals, tensions, palm.
        """
        settled, layout = self.hand.settled, self.layout
        n = len(settled.tiles)
        rows = len(layout.limits) - len(HELD)
        P, p, s = np.zeros((rows, 3 * n + len(FINGERS) + 2)), np.zeros(rows), np.empty(rows)
        tile, a_shear, a_normal, a_lateral, capacity = self._planes
        k = len(tile)
        index = np.arange(k)
        P[index, tile], P[index, n + tile], P[index, 2 * n + tile] = a_shear, a_normal, a_lateral
        s[:k] = capacity
        drive, most = settled.hand.drive, settled.hand.maximum_tension
        if self.tension_limit is not None:
            most = min(most, self.tension_limit)
        tendon = np.arange(len(FINGERS))
        for per_newton, at_zero, most_of in (
            (1.0, 0.0, most),
            (drive.torque_per_newton, 0.0, drive.maximum_torque),
            (drive.current_per_newton, drive.no_load_current, drive.maximum_current),
        ):
            P[k + tendon, 3 * n + tendon], p[k + tendon], s[k + tendon] = (
                per_newton,
                at_zero,
                most_of,
            )
            k += len(tendon)
        structure = settled.hand.structure
        for i in layout.engaged:
            P[k, np.flatnonzero(settled.finger_of == i)] = 1.0
            s[k] = structure.finger_shear
            k += 1
        for t in layout.tips:
            P[k, n + t], s[k] = 1.0, structure.fingertip_force
            k += 1
        if settled.palm.engaged:
            P[-2, -2] = P[-1, -1] = 1.0
            s[-2:] = settled.palm.shear_limit, settled.palm.pressing_limit
        return P, p, s

    @cached_property
    def _hard_map(self) -> Array:
        """Q: hard rows of tendons, tiles, frames and stops are Q (e, stop torques) ≤ 0."""
        settled, layout = self.hand.settled, self.layout
        n = len(settled.tiles)
        size = 3 * n + len(FINGERS) + 2
        those = [
            *(3 * n + np.arange(len(FINGERS))),
            *np.flatnonzero(settled.touching),
            *(n + t for t in layout.frames),
        ]
        Q = np.zeros((len(those) + len(settled.stops), size + len(settled.stops)))
        Q[np.arange(len(those)), those] = -1.0
        for k, (_, _, torque) in enumerate(settled.stops):
            # in newtons of tension, so that rows stay commensurate
            Q[len(those) + k, size + k] = -1.0 / max(abs(float(torque[1])), 1e-6)
        return Q

    def judge(self, twists: Array) -> Verdict:
        """Return how near its limits the hand is at some twists of the wrist, shape (m, 6)."""
        return self.evaluate(twists).verdict

    def evaluate(self, twists: Array) -> Evaluation:
        """Return wrenches and limits at some twists of the wrist, shape (m, 6)."""
        loads = self.hand.loads(twists)
        P, p, s = self._limit_map
        D = HELD / self.hand.settled.hand.structure.hand_load
        e, wrenches = _elements(loads), self.hand.wrenches(loads)
        with np.errstate(invalid="ignore"):
            used = np.concatenate([(e @ P.T + p) / s, wrenches[:, :3] @ D.T], axis=1)
            broken = np.concatenate([e, loads.stop_torques], axis=1) @ self._hard_map.T
        used = np.where(loads.reached[:, None], used, np.inf)
        broken = np.where(loads.reached[:, None], broken, np.inf)
        verdict = Verdict(
            used.max(axis=1), used.argmax(axis=1), broken.max(axis=1, initial=-np.inf)
        )
        return Evaluation(wrenches, verdict)

    def sieve(self, twists: Array) -> Indices:
        """Return which twists pass the limits of each finger's tiles, one finger after another."""
        left = np.arange(len(twists))
        tile, a_shear, a_normal, a_lateral, capacity = self._planes
        for i in self.layout.engaged:
            own = self.hand.tiles_of(i)
            mine = np.isin(tile, own)
            loads = self.hand.finger_loads(i, twists[left])
            e = np.concatenate(
                [loads.shears, loads.normals, self.hand.lateral_loads(i, twists[left])], axis=1
            )
            n, m = len(own), loads.normals.shape[1]
            place = tile[mine] - own[0]
            rows = np.arange(int(mine.sum()))
            P = np.zeros((len(rows), e.shape[1]))
            P[rows, place] = a_shear[mine]
            # a base tile has no normal load
            bears = place >= n - m
            P[rows[bears], n + place[bears] - (n - m)] = a_normal[mine][bears]
            P[rows, n + m + place] = a_lateral[mine]
            with np.errstate(invalid="ignore"):
                holds = loads.reached & ((e @ P.T <= capacity[mine]).all(axis=1))
                holds &= (loads.shears >= 0.0).all(axis=1)
            left = left[holds]
        return left

    def palm_modes(self) -> tuple[PalmMode, ...]:
        """Return the ways in which the palm can carry."""
        if not self.hand.settled.palm.engaged:
            return ("off",)
        return tuple(PALM_MODES.values())

    def linearised(
        self,
        twist: ArrayLike | None = None,
        palm: PalmMode | None = None,
        within: ArrayLike | None = None,
    ) -> WrenchSpace:
        """Return the set linearised at a wrist pose.

        Parameters
        ----------
        twist : array_like, shape (6,), optional
            ξ₀ [m, rad]; at rest by default.
        palm : {'off', 'drags', 'presses', 'drags_and_presses'}, optional
            How the palm carries; the attribute of that name by default.
        within : array_like, shape (6,), optional
            How far from ξ₀ each component of ξ may go [m, rad]; by default as far as the rows let.

        Returns
        -------
        WrenchSpace
            Columns `WRIST`; rows as of a fixed wrist, with hard rows that keep the palm's way of
            carrying, and the wrist within its range.
        """
        hand, settled, layout = self.hand, self.hand.settled, self.layout
        at = np.zeros(6) if twist is None else np.asarray(twist, dtype=float)
        palm = palm or self.palm
        dragging = palm in ("drags", "drags_and_presses")
        pressing = palm in ("presses", "drags_and_presses")
        steps = at + 1j * STEP * np.eye(6)
        loads = hand.loads(steps)
        free = hand.palm_loads(steps)
        loads = loads._replace(palm=free * np.array([dragging, pressing]))
        e = _elements(loads)
        slope = _slopes(e)
        start = e[0].real - slope @ at
        P, p, s = self._limit_map
        P_hard = self._hard_map
        torques = loads.stop_torques
        torque_slope = _slopes(torques)
        torque_start = torques[0].real - torque_slope @ at
        H = P_hard @ np.vstack([slope, torque_slope])
        h = -P_hard @ np.concatenate([start, torque_start])
        if settled.palm.engaged:
            # a palm that carries moves against the rock; one that does not, away from it
            palm_slope = free.imag.T / STEP / _stiffnesses(hand)[:, None]
            palm_start = free[0].real / _stiffnesses(hand) - palm_slope @ at
            signs = np.where([dragging, pressing], -1.0, 1.0)
            H = np.vstack([H, signs[:, None] * palm_slope * PALM_ROWS])
            h = np.concatenate([h, -signs * palm_start * PALM_ROWS])
        rows = layout.rows
        if within is not None:
            sides, most, names = range_rows(WRIST, at, within)
            H, h = np.vstack([H, sides]), np.concatenate([h, most])
            rows = _with_range(layout, names)

        wrenches = hand.wrenches(loads)
        generators = _slopes(wrenches)
        origin = wrenches[0].real - generators @ at
        D = np.zeros((len(HELD), 6))
        D[:, :3] = HELD
        held = np.full(len(D), settled.hand.structure.hand_load)
        return WrenchSpace(
            origin=origin,
            generators=generators,
            columns=WRIST,
            rows=rows,
            L=np.vstack([P @ slope, D @ generators]),
            l0=np.concatenate([P @ start + p, D @ origin]),
            s=np.concatenate([s, held]),
            H=H,
            h=h,
            D=D,
        )


@lru_cache(maxsize=KEPT)
def _with_range(layout: RowLayout, names: tuple[Row, ...]) -> tuple[Row, ...]:
    """Return the names of all rows, the same tuple for the same rows."""
    return layout.rows + names


def _slopes(values: Numbers) -> Array:
    """Return the derivatives that complex steps have found, without what is rounding alone."""
    slopes = np.asarray(values.imag.T / STEP)
    return np.where(np.abs(slopes) > ROUNDING, slopes, 0.0)


def _elements(loads: HandLoads) -> Numbers:
    """Return shears, normals, laterals, tensions and palm loads, shape (m, 3 n + 6)."""
    return np.concatenate(
        [loads.shears, loads.normals, loads.laterals, loads.tensions, loads.palm], axis=1
    )


def _stiffnesses(hand: CompliantHand) -> Array:
    return np.array([hand.palm_shear_stiffness, hand.palm_pressing_stiffness])
