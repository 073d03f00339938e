"""A hand whose wrist is compliant (Sections 5.3 and 5.4).

The hand is settled and its tendons hold a preload. Then the wrist moves by a small twist
ξ = (v, ω), of the hand frame about its origin at rest. In its plane each finger settles anew
(`compliant_finger`); across its plane the tiles are springs on a beam that leaves the base along
the finger (Section 5.3: linear elasticity),

    Y = (F + diag(1 / k))⁻¹ y,    F_ij = ℓ_i² (3 ℓ_j − ℓ_i) / (6 EI) + h_i h_j ℓ_i / GJ,  ℓ_i ≤ ℓ_j,

with Y the lateral load of each tile, y its displacement across the finger's plane, k the stiffness
of its spines on the rock, ℓ its distance along the finger from the joint and h its distance from
the finger's axis. The engaged palm tiles drag the rock by the palm's travel toward −x and share
that load on their tendon; each presses by its travel past its gap to the rock. A spring of
stiffness k carries k d²/(2 δ) at a travel d up to its onset δ, and k (d − δ/2) beyond.

Forces and places are in H *at rest*: the tiles are anchored in the rock, which does not move.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices, InvalidInputError, UnsupportedError, skew
from hand_models.compliance.compliant_finger import CompliantFingers, FingerAtRest, FingerLoads
from hand_models.compliance.grasp import complex_steps, slopes
from hand_models.compliance.rolling import Numbers
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, SettledHand
from hand_models.tendon import FingerTendon, MotorScheme

__all__ = ["CompliantHand", "CompliantHands", "HandLoads"]


class HandLoads(NamedTuple):
    """Loads of a hand at m twists of its wrist; n tiles in the order of `SettledHand.tiles`.

    Attributes
    ----------
    shears, normals, laterals : ndarray, shape (m, n)
        Loads of each tile [N].
    tensions : ndarray, shape (m, 4)
        Tension of each tendon at the first tile from its motor [N].
    stop_torques : ndarray, shape (m, k)
        Torque against the stop of each joint at a limit, in the order of `SettledHand.stops` [N·m].
    palm : ndarray, shape (m, 2)
        Shear of the palm along −x of the hand frame H, and its pressing along +z [N].
    positions : ndarray, shape (m, n, 3)
        Contacts in H at rest [m].
    axes : ndarray, shape (m, n, 3, 3)
        Rows: the unit force on the rock of shear, normal and lateral load, in H at rest.
    reached : ndarray of bool, shape (m,)
        Whether every phalanx with a contact still meets rock.
    """

    shears: Numbers
    normals: Numbers
    laterals: Numbers
    tensions: Numbers
    stop_torques: Numbers
    palm: Numbers
    positions: Numbers
    axes: Numbers
    reached: NDArray[np.bool_]

    @property
    def tile_loads(self) -> Numbers:
        """Shear, normal and lateral load of each tile, shape (m, n, 3) [N]."""
        return np.stack([self.shears, self.normals, self.laterals], axis=-1)


class CompliantHand:
    """A settled hand as a function from twists of its wrist to loads.

    Parameters
    ----------
    settled : SettledHand
        Not in a fingernail grasp.
    preload : array_like, shape (4,), optional
        Tension of each tendon before the wrist moves [N]; the closing tension by default.
    scheme : {'held', 'tension'}, optional
        Whether the motors stand still, or keep their tension, while the wrist moves.

    Raises
    ------
    InvalidInputError
        If a preload is negative or above the tendon's maximum.
    UnsupportedError
        If the hand clings with its nails, whose stiffness is not known.
    """

    def __init__(
        self,
        settled: SettledHand,
        preload: ArrayLike | None = None,
        scheme: MotorScheme = "held",
    ) -> None:
        if settled.grasp.fingernail:
            raise UnsupportedError("a fingernail grasp requires a fixed wrist")
        hand = settled.hand
        self.settled = settled
        self.preload = _preload(preload, settled)
        self.frames = hand.frames(settled.grasp.outer_rotation)
        self.scheme: MotorScheme = scheme
        self.fingers = [self._finger(i, name) for i, name in enumerate(FINGERS)]
        self._own = [np.flatnonzero(settled.finger_of == i) for i in range(len(FINGERS))]
        self._across = [self._lateral_stiffness(i) for i in range(len(FINGERS))]
        self.palm_shear_stiffness = float(settled.palm_stiffness[0])

    @cached_property
    def _together(self) -> CompliantFingers:
        return CompliantFingers(self.fingers, self.scheme)

    @cached_property
    def _alone(self) -> list[CompliantFingers]:
        return [CompliantFingers([finger], self.scheme) for finger in self.fingers]

    def _finger(self, i: int, name: str) -> FingerAtRest:
        settled, hand = self.settled, self.settled.hand
        base_tile = name.startswith("outer")
        own = settled.finger_of == i
        tendon = FingerTendon.from_table(hand.table, base_tile, settled.stiffness_ratio)
        return FingerAtRest(
            settled.fingers[i],
            hand.section(name, settled.hold, settled.grasp, settled.seating.pose),
            replace(
                tendon.engaged(settled.engagement[own]),
                friction=max(tendon.friction, hand.tendon_friction),
            ),
            tendon.friction,
            settled.loads[own, 0],
            # as it has closed: where tiles bear does not change with tension (Eq. 14)
            [each * settled.closing_tension for each in hand.depths[base_tile]],
        )

    def _lateral_stiffness(self, i: int) -> Array:
        """Return the stiffness of a finger's tiles across its plane, shape (n_i, n_i) [N/m]."""
        settled, hand = self.settled, self.settled.hand
        own = self._own[i]
        if not settled.grasp.lateral:
            return np.zeros((len(own), len(own)))
        arms = settled.positions[own] - self.frames[i].joint
        out = np.maximum(arms @ self.frames[i].along, 0.0)
        shorter, longer = np.minimum(out[:, None], out), np.maximum(out[:, None], out)
        flexibility = shorter**2 * (3.0 * longer - shorter) / (6.0 * hand.bending_stiffness)
        flexibility += np.outer(arms[:, 2], arms[:, 2]) * shorter / hand.torsional_stiffness
        # as (F + 1/K)⁻¹, also where tiles have no spines on the rock
        springs = np.diag(settled.engagement[own] * hand.lateral_stiffness)
        return np.asarray(np.linalg.solve(np.eye(len(own)) + springs @ flexibility, springs))

    def loads(self, twists: Numbers, tensions: Numbers | None = None) -> HandLoads:
        """Return every load of the hand at m twists of its wrist.

        Parameters
        ----------
        twists : ndarray, shape (m, 6)
            Displacement v and rotation ω of the hand frame H about its origin at rest [m, rad].
        tensions : ndarray, shape (m, 4), optional
            Tension at which each finger has closed before the wrist moves [N]; the preload by
            default.
        """
        bases = self._bases(range(len(FINGERS)), twists, tensions)
        return self._loads(twists, self._together.loads(*bases))

    def _loads(self, twists: Numbers, found: FingerLoads) -> HandLoads:
        """Return the hand's loads of those of its four fingers in their planes."""
        m, settled = len(twists), self.settled
        n = len(settled.tiles)
        kind = twists.dtype
        shears, normals, laterals = (np.zeros((m, n), dtype=kind) for _ in range(3))
        positions = np.broadcast_to(settled.positions, (m, n, 3)).astype(kind)
        axes = np.broadcast_to(settled.axes, (m, n, 3, 3)).astype(kind)
        tensions = found.motor_tensions.T
        reached = np.asarray(found.reached.all(axis=0))
        up = np.array([0.0, 0.0, 1.0])
        for i, (frame, own) in enumerate(zip(self.frames, self._own, strict=True)):
            shears[:, own] = own_shears(found.of(i), len(own))
            laterals[:, own] = self.lateral_loads(i, twists)
            phalanges = own[-len(PHALANGES) :]
            normals[:, phalanges] = found.normals[i]
            place, u = found.points[i], found.directions[i]
            positions[:, phalanges] = frame.joint + place[..., :1] * frame.along
            positions[:, phalanges] += place[..., 1:] * up
            axes[:, phalanges, 0] = -(u[..., :1] * frame.along + u[..., 1:] * up)
            axes[:, phalanges, 1] = u[..., :1] * up - u[..., 1:] * frame.along
        return HandLoads(
            shears=shears,
            normals=normals,
            laterals=laterals,
            tensions=tensions,
            stop_torques=self._pushing(found.stop_torques),
            palm=self.palm_loads(twists),
            positions=positions,
            axes=axes,
            reached=reached,
        )

    def finger_loads(self, i: int, twists: Numbers) -> FingerLoads:
        """Return the loads of one finger in its plane at twists of the wrist.

        Parameters
        ----------
        i : int
            Index of the finger in `FINGERS`.
        twists : ndarray, shape (m, 6)
            [m, rad]
        """
        return self._alone[i].loads(*self._bases([i], twists)).of(0)

    def lateral_loads(self, i: int, twists: Numbers) -> Numbers:
        """Return the lateral loads of one finger's tiles at twists of the wrist.

        Parameters
        ----------
        i : int
            Index of the finger in `FINGERS`.
        twists : ndarray, shape (m, 6)
            [m, rad]

        Returns
        -------
        ndarray, shape (m, n_i)
            For the n_i tiles of the finger, from the base outward [N].
        """
        v, turn, across = twists[:, :3], twists[:, 3:], self.frames[i].across
        places = self.settled.positions[self.tiles_of(i)]
        # b · (v + ω × p + ω × (ω × p) / 2) for all places p at once
        first = (v @ across)[:, None] + turn @ np.cross(places, across).T
        square = (turn * turn).sum(axis=1)[:, None]
        second = (turn @ across)[:, None] * (turn @ places.T) - square * (places @ across)
        return np.asarray((first + 0.5 * second) @ self._across[i].T)

    def tiles_of(self, i: int) -> Indices:
        """Return the indices of finger ``i``'s tiles in `SettledHand.tiles`."""
        return self._own[i]

    def _bases(
        self, fingers: Iterable[int], twists: Numbers, tensions: Numbers | None = None
    ) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers]:
        """Return how bases of fingers move in their planes, (F, m), as `CompliantFingers.loads`."""
        v, turn, each = twists[:, :3], twists[:, 3:], []
        if tensions is None:
            tensions = np.broadcast_to(self.preload, (len(twists), len(FINGERS)))
        for i in fingers:
            frame = self.frames[i]
            moved = _moved(frame.joint, v, turn)
            base = self.settled.positions[self._own[i][0]]
            slip = -(_moved(base, v, turn) @ frame.along)
            # from x toward z is against the sense of the axis across, z × x
            turned = -(turn @ frame.across)
            each.append((moved @ frame.along, moved[:, 2], turned, tensions[:, i], slip))
        x, z, turned, tension, slip = map(np.array, zip(*each, strict=True))
        return x, z, turned, tension, slip

    def _pushing(self, torques: Numbers) -> Numbers:
        """Return the torques on stops, positive where they are pushed."""
        pushing = [
            torques[i, :, j]
            * (1.0 if self.settled.fingers[i].contacts[j].stop == "upper" else -1.0)
            for i, j, _ in self.settled.stops
        ]
        nothing = np.zeros((torques.shape[1], 0), dtype=torques.dtype)
        return np.stack(pushing, axis=-1) if pushing else nothing

    def palm_loads(self, twists: Numbers) -> Numbers:
        """Return the palm's shear toward −x and its pressing, (m, 2) [N], at twists (m, 6)."""
        travel, palm = self.palm_travel(twists), self.settled.palm
        if not palm.engaged:
            return 0.0 * travel
        # [m] 0.1 mm of shear and 0.02 mm of pressing, over which a search sees the springs begin
        shear = self.palm_shear_stiffness * _compressed(travel[:, 0], 1e-4)
        beyond = travel[:, 1:] - np.maximum(palm.gaps[list(palm.engaged)], 0.0)
        stiffness = self.settled.hand.palm_pressing_stiffness * np.array(palm.engagement)
        return np.stack([shear, _compressed(beyond, 2e-5) @ stiffness], axis=-1)

    def palm_travel(self, twists: Numbers) -> Numbers:
        """Return the palm's travel toward −x and into the rock, (m, 2) [m], at twists (m, 6)."""
        moved = _moved(self.settled.palm.centre, twists[:, :3], twists[:, 3:])
        return np.asarray(moved[:, ::2] * (-1.0, 1.0))

    def wrenches(self, loads: HandLoads) -> Numbers:
        """Return the wrenches of the hand on the rock for given loads.

        Returns
        -------
        ndarray, shape (m, 6)
            Force and moment in the hand frame H at rest [N, N·m].
        """
        forces = np.einsum("mtk,mtkx->mtx", loads.tile_loads, loads.axes)
        moments = np.cross(loads.positions, forces).sum(axis=1)
        shear, pressing = loads.palm[:, 0], loads.palm[:, 1]
        palm = np.stack([-shear, 0.0 * shear, pressing], axis=-1)
        return np.concatenate(
            [forces.sum(axis=1) + palm, moments + np.cross(self.settled.palm.centre, palm)], axis=1
        )

    def stiffness(self, twist: ArrayLike | None = None) -> Array:
        """Return the stiffness K_g = ∂w_g/∂x_g (Eq. 11) of the hand at a twist of the wrist.

        By complex steps, exact but for rounding. At a kink, the stiffness on one of its sides.

        Parameters
        ----------
        twist : array_like, shape (6,), optional
            [m, rad]; at rest by default.

        Returns
        -------
        ndarray, shape (6, 6)
            Derivative of the wrench on the rock by the twist [N/m, N/rad, N, N·m/rad].
        """
        at = np.zeros(6) if twist is None else np.asarray(twist, dtype=float)
        return slopes(self.wrenches(self.loads(complex_steps(at))))


class CompliantHands:
    """Several compliant hands whose loads are computed in one call, each at its own twists.

    Parameters
    ----------
    hands : sequence of CompliantHand
        All of one scheme.
    """

    def __init__(self, hands: Sequence[CompliantHand]) -> None:
        self.hands = hands
        fingers = [finger for hand in hands for finger in hand.fingers]
        self._together = CompliantFingers(fingers, hands[0].scheme)

    def loads(self, twists: Sequence[Numbers], tensions: Sequence[Numbers]) -> list[HandLoads]:
        """Return the loads of each hand at m twists of its wrist.

        Parameters
        ----------
        twists : sequence of ndarray, shape (m, 6)
            Twists for each hand [m, rad].
        tensions : sequence of ndarray, shape (m, 4)
            Tensions at which each hand's fingers have closed [N].
        """
        count = len(FINGERS)
        each = [
            hand._bases(range(count), own, closed)
            for hand, own, closed in zip(self.hands, twists, tensions, strict=True)
        ]
        bases = [np.concatenate(parts) for parts in zip(*each, strict=True)]
        found = self._together.loads(*bases)
        return [
            hand._loads(own, found.of(slice(count * h, count * (h + 1))))
            for h, (hand, own) in enumerate(zip(self.hands, twists, strict=True))
        ]


def own_shears(found: FingerLoads, count: int) -> Numbers:
    """Return the shears of a finger's tiles at m poses, shape (m, count) [N].

    ``count``: 3, or 4 with a base tile, whose shear then comes first.
    """
    if count == len(PHALANGES):
        return found.shears
    return np.concatenate([found.base_shears[:, None], found.shears], axis=1)


def _compressed(travel: Numbers, onset: float) -> Numbers:
    """Return how far one-sided springs are compressed that grow stiff over ``onset`` [m]."""
    part = np.where(travel.real < onset, np.where(travel.real > 0.0, travel, 0.0), onset)
    return np.asarray(part / onset * (travel - 0.5 * part))


def _moved(place: Array, v: Numbers, turn: Numbers) -> Numbers:
    """Return how far a place moves with the wrist, to second order in its turn, shape (m, 3)."""
    # ω × p, and ω × (ω × p) = ω (ω · p) − p (ω · ω)
    first = turn @ skew(place)
    square = (turn * turn).sum(axis=1)[:, None]
    return np.asarray(v + first + 0.5 * ((turn @ place)[:, None] * turn - square * place))


def _preload(preload: ArrayLike | None, settled: SettledHand) -> Array:
    if preload is None:
        return np.full(len(FINGERS), settled.closing_tension)
    tensions = np.asarray(preload, dtype=float)
    most = settled.hand.maximum_tension
    if tensions.shape != (len(FINGERS),) or not ((tensions >= 0.0) & (tensions <= most)).all():
        raise InvalidInputError(
            f"four tensions from 0 to {most:g} N are needed, got {tensions.tolist()}",
            field="tendon_preload",
        )
    return tensions
