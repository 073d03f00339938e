"""Wrench space of a hand whose motors stand still and whose wrist is compliant (Eqs. 9–13, 17).

A twist ξ of the wrist loads every tile, and the hand can exert every wrench that some twist gives
without exceeding a limit. That set is neither convex nor a polyhedron. Linearised about a wrist
pose ξ₀ it is a polyhedron,

    w = w_g(ξ₀) + K_g(ξ₀) (ξ − ξ₀),    f_t = f_t(ξ₀) + ∂f_t/∂ξ (ξ − ξ₀),

(w the wrench, K_g the hand's stiffness, f_t the tendon tensions), with rows like those of a fixed
wrist. A tendon's stick and slip stay as they are at ξ₀.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import ClassVar, Final, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, BoundedStore, Indices
from hand_models.compliance.compliant_hand import CompliantHand, HandLoads
from hand_models.compliance.grasp import (
    CompliantGrasp,
    GraspLoads,
    LoadRows,
    complex_steps,
    rows_of_range,
)
from hand_models.compliance.link import Numbers
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist import layout_of, twist_arms
from hand_models.hand import FINGERS, HELD_DIRECTIONS
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["PALM_MODES", "WRIST_COLUMNS", "FloatingWrist", "PalmMode"]

WRIST_COLUMNS: Final = ("wrist/vx", "wrist/vy", "wrist/vz", "wrist/wx", "wrist/wy", "wrist/wz")
"""Columns of a floating hand's set: the twist of its wrist, of H about its origin at rest [m, rad].
"""

PalmMode = Literal["off", "drags", "presses", "drags_and_presses"]
"""How a palm carries: not at all, by moving toward −x, by moving past its gap to the rock, or both.
"""

PALM_MODES: Final[dict[tuple[bool, bool], PalmMode]] = {
    (False, False): "off",
    (True, False): "drags",
    (False, True): "presses",
    (True, True): "drags_and_presses",
}
"""Palm modes by (palm drags, palm presses)."""


@dataclass(eq=False)
class FloatingWrist(CompliantGrasp):
    """Limits and wrench space of a hand with a floating wrist: motors stand still, the wrist moves.

    Its loads e are the tiles' shears, normals and laterals, the tensions, the palm's shear and
    pressing, the torques on stops, and the twists of joints.

    Attributes
    ----------
    hand : CompliantHand
    tension_limit : float, optional
        Cap on every tendon's tension; the hand's maximum if that is less [N].
    palm_carries : bool
        Whether the palm's springs carry load; only if one of its tiles is engaged.
    """

    hand: CompliantHand
    tension_limit: float | None = None

    columns: ClassVar[tuple[str, ...]] = WRIST_COLUMNS
    range_rows = rows_of_range(WRIST_COLUMNS)
    driven: ClassVar[bool] = False
    """Whether the motors keep the tensions that a plan asks for (True), or stand still (False)."""

    def __post_init__(self) -> None:
        self.layout = layout_of(self.hand.settled, sticking=False)
        self.palm_carries = bool(self.hand.settled.palm.engaged)
        self._twist_arms = twist_arms(self.hand.settled, self.layout.twisted)
        self.load_rows = self._load_rows()
        # loads at the complex steps from poses, by the poses
        self._kept: BoundedStore[bytes, HandLoads] = BoundedStore(
            "linearised wrists",
            most=16,  # some more than a search comes back to
        )

    def _load_rows(self) -> LoadRows:
        """Return what loads and wrenches must keep to."""
        settled, layout = self.hand.settled, self.layout
        n, structure = len(settled.tiles), settled.hand.structure
        tension, palm = 3 * n, 3 * n + len(FINGERS)
        stop = palm + 2
        twist, nl = stop + len(settled.stops), len(layout.limits) - len(HELD_DIRECTIONS)
        size = twist + len(layout.twisted)
        P, p, s = np.zeros((nl, size)), np.zeros(nl), np.full(len(layout.limits), np.nan)
        tile, (planes,) = layout.plane_tiles, layout.planes([settled.surface])
        *slopes, capacity = planes.T
        k = len(tile)
        for part, slope in enumerate(slopes):
            P[np.arange(k), part * n + tile] = slope
        s[:k] = capacity * settled.limit_shares[tile]
        most = settled.hand.maximum_tension
        if self.tension_limit is not None:
            most = min(most, self.tension_limit)
        for per_newton, at_zero, end in (
            (1.0, 0.0, most),
            *settled.hand.drive.limits,
        ):
            own = slice(k, k + len(FINGERS))
            P[own, tension:palm], p[own], s[own] = per_newton * np.eye(len(FINGERS)), at_zero, end
            k = own.stop
        for i in layout.engaged:
            P[k, np.flatnonzero(settled.finger_of == i)], s[k] = 1.0, structure.finger_shear
            k += 1
        for i in layout.reacting:
            own = slice(k, k + 2)
            P[own, 2 * n + np.flatnonzero(settled.finger_of == i)] = [[1.0], [-1.0]]
            s[own], k = settled.lateral_limits[i], own.stop
        for t in layout.tips:
            P[k, n + t], s[k] = 1.0, structure.fingertip_force
            k += 1
        for t in range(twist, size):
            own = slice(k, k + 2)
            P[own, t], s[own], k = (1.0, -1.0), structure.finger_twist, own.stop
        if settled.palm.engaged:
            P[k:, palm:stop] = np.eye(2)
            s[k:nl] = settled.palm.shear_limit, settled.palm.pressing_limit
        s[nl:] = structure.hand_load
        # in newtons of tension, so that rows stay commensurate
        pushed = [1.0 / max(abs(float(torque[1])), 1e-6) for _, _, torque in settled.stops]
        touching = np.flatnonzero(settled.touching)
        those = [*range(tension, palm), *touching, *(n + layout.frames)]
        Q = np.zeros((len(those) + len(pushed), size))
        Q[np.arange(len(those)), those] = -1.0
        row, friction = palm - tension + np.arange(len(touching)), settled.surface.friction
        Q[row, n + touching] = -friction
        base = layout.bases
        Q[row[np.isin(touching, base)], n + base + 1] = -friction * settled.engagement[base]
        Q[len(those) :, stop:twist] = -np.diag(pushed)
        q = np.zeros(len(Q))
        q[row] = settled.drag_allowances[touching]
        held = np.hstack([HELD_DIRECTIONS, np.zeros_like(HELD_DIRECTIONS)])
        # no row says which way the palm goes: its law is the same either way
        names = tuple(row for row in layout.rows if not row.limit.endswith("_reversed"))
        return LoadRows(names, P, p, held, s, Q, q)

    def loads_at(self, twists: Numbers) -> GraspLoads:
        """Return loads e and wrenches w at poses of the wrist.

        Parameters
        ----------
        twists : ndarray, shape (m, d)
            m poses of the wrist: its twist, in a subclass other components too.
        """
        return self._grasp_loads(self.hand_loads(twists))

    def closed_at(self, y: Array) -> Array:
        """Return the tensions at which the hand has closed, for a pose of the wrist.

        Parameters
        ----------
        y : ndarray, shape (d,)
            Pose of the wrist. In this class it has no effect: the tensions are the preload.

        Returns
        -------
        ndarray, shape (4,)
            Tension of each tendon [N].
        """
        return self.hand.preload

    def hand_loads(self, y: Numbers) -> HandLoads:
        """Return the loads of tiles, tendons and palm at poses of the wrist.

        Parameters
        ----------
        y : ndarray, shape (m, d)
            m poses of the wrist.
        """
        return self.hand.loads(y)

    def stretches(self, shears: Array) -> Array:
        """Return how far tiles are stretched along the rock: shear over contact stiffness [m].

        Parameters
        ----------
        shears : ndarray, shape (n,)
            Shear of each tile [N].

        Returns
        -------
        ndarray, shape (n,)
            Zero for tiles off the rock.
        """
        fingers = self.hand.fingers
        stiffness = np.concatenate([finger.anchored.contact_stiffness for finger in fingers])
        held, found = stiffness > 0.0, np.zeros(len(stiffness))
        found[held] = np.abs(shears[held]) / stiffness[held]
        return found

    def _grasp_loads(self, loads: HandLoads) -> GraspLoads:
        palm, wrenches = loads.palm, loads.wrenches
        if not self.palm_carries:
            palm, wrenches = 0.0 * palm, wrenches - palm @ self.hand.palm_wrenches
        elements = [loads.shears, loads.normals, loads.laterals, loads.tensions, palm]
        elements += [loads.stop_torques, self._twists(loads)]
        return GraspLoads(np.concatenate(elements, axis=1), wrenches, loads.reached)

    def _twists(self, loads: HandLoads) -> Numbers:
        """Return the twist of each joint of ``layout.twisted``, shape (m, k) [N·m]."""
        in_plane = loads.tile_loads[..., :2, None] * loads.axes[..., :2, :]
        return np.asarray(np.einsum("ktx,mtx->mk", self._twist_arms, in_plane.sum(axis=2)))

    def sieve(self, twists: Array) -> Indices:
        """Return the indices of those of m wrist poses (m, d) that keep the limits of finger tiles.

        Fingers are tested one after another, each only at the poses that passed before.
        """
        rows, n, left = self.load_rows, len(self.hand.settled.tiles), np.arange(len(twists))
        for i in self.layout.engaged:
            own, phalanges = self.hand.tiles_of(i), self.hand.tiles_of(i)[-len(PHALANGES) :]
            found = self.hand.finger_loads(i, twists[left])
            laterals = self.hand.lateral_loads(i, twists[left])
            shears = found.tile_shears[:, : len(own)]
            elements = np.concatenate([shears, found.normals, laterals], axis=1)
            mine = np.flatnonzero(np.isin(self.layout.plane_tiles, own))
            P = rows.P[np.ix_(mine, [*own, *n + phalanges, *2 * n + own])]
            with np.errstate(invalid="ignore"):
                holds = (elements @ P.T <= rows.s[mine]).all(axis=1)
                pressed = found.normals
                if len(own) > len(PHALANGES):
                    share = self.hand.settled.engagement[own[0]]
                    pressed = np.column_stack([share * pressed[:, 0], pressed])
                drags = shears + self.hand.settled.surface.friction * pressed
                drags += self.hand.settled.drag_allowances[own]
                holds &= found.reached & (drags >= 0.0).all(axis=1)
            left = left[holds]
        return left

    @property
    def pressing(self) -> Array:
        """Pose of the wrist, shape (d,), at which the nearest palm tile just meets the rock."""
        y, palm = self.at_rest, self.hand.settled.palm
        if self.palm_carries:
            inward = WRIST_COLUMNS.index("wrist/vz") - len(WRIST_COLUMNS)
            y[inward] += max(0.0, palm.nearest_gap)
        return y

    def palm_mode(self, y: Array) -> PalmMode:
        """Return which of the palm's springs carry load at a wrist pose y, shape (d,)."""
        twist = y[-len(WRIST_COLUMNS) :]
        shear, inward = self.hand.palm_travel(twist[None])[0].tolist()
        presses = inward > self.hand.settled.palm.nearest_gap
        return PALM_MODES[self.palm_carries and shear > 0.0, self.palm_carries and presses]

    def without_palm(self) -> Self:
        """Return a copy whose palm carries no load; both share one cache of loads."""
        idle = copy(self)
        idle.palm_carries = False
        return idle

    @property
    def travel_rows(self) -> tuple[Array, Array]:
        """A and b of hard rows A y ≤ b on the wrist pose y, shapes (k, d), (k,); here none."""
        return np.zeros((0, len(self.columns))), np.zeros(0)

    def linearised(
        self, twist: ArrayLike | None = None, *, within: ArrayLike | None = None
    ) -> WrenchSpace:
        return self.linearised_each(self._pose(twist)[None], within)[0]

    def linearised_each(self, twists: Array, within: ArrayLike | None = None) -> list[WrenchSpace]:
        """Return the wrench space linearised about each of k poses of the wrist.

        The loads at all poses are computed in one call and cached by pose, so that a later call
        with another ``within`` reuses them.

        Parameters
        ----------
        twists : ndarray, shape (k, d)
            Poses of the wrist.
        within : array_like, shape (d,), optional
            Largest change of each component from its pose, added as hard rows.

        Returns
        -------
        list of WrenchSpace, length k
            Each as from `linearised`.
        """
        return [
            self._about(at, self._grasp_loads(loads), *self.travel_rows, within)
            for at, loads in zip(twists, self._stepped(twists), strict=True)
        ]

    def _stepped(self, twists: Array) -> list[HandLoads]:
        """Return the loads at the complex steps from each of some poses."""
        keys = [at.tobytes() for at in twists]
        known = dict(zip(keys, self._kept.find(keys), strict=True))
        new = [at for at, key in zip(twists, keys, strict=True) if known[key] is None]
        if new:
            steps = np.concatenate([complex_steps(at) for at in new])
            known.update(self.keep(np.array(new), self.hand_loads(steps)))
        return [loads for key in keys if (loads := known[key]) is not None]

    def loads_of(self, y: Array) -> HandLoads:
        """Return the loads at one pose of the wrist, from the cache where its set was linearised.

        Parameters
        ----------
        y : ndarray, shape (d,)
            The pose.

        Returns
        -------
        HandLoads
            Loads at this pose alone (m = 1).
        """
        (steps,) = self._stepped(y[None])
        return HandLoads(*[part[:1].real for part in steps])

    def knows(self, poses: Array) -> bool:
        """Return True if the loads about all of k poses, shape (k, d), are in the cache."""
        return None not in self._kept.find([at.tobytes() for at in poses])

    def keep(self, poses: Array, loads: HandLoads) -> list[tuple[bytes, HandLoads]]:
        """Add the loads at the complex steps from k wrist poses to the cache, and return both.

        Parameters
        ----------
        poses : ndarray, shape (k, d)
            Poses of the wrist.
        loads : HandLoads
            Loads at the `complex_steps` from each pose, one pose after the other, k d in all.

        Returns
        -------
        list of (bytes, HandLoads), length k
            Cache key of each pose, and its d loads.
        """
        d = poses.shape[1]
        each = [HandLoads(*(part[k : k + d] for part in loads)) for k in range(0, poses.size, d)]
        made = [(at.tobytes(), own) for at, own in zip(poses, each, strict=True)]
        self._kept.keep(made)
        return made
