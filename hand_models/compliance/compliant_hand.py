"""A hand whose wrist is compliant (Sections 5.3 and 5.4).

The hand is settled and its tendons hold a preload. Then the wrist moves by a small twist
ξ = (v, ω), of the hand frame about its origin at rest. In its plane each finger settles anew
(`compliant_finger`); across its plane, and under the palm, springs carry (`hand_springs`).

Forces and places are in H *at rest*: the tiles are anchored in the rock, which does not move.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base import Array, Indices, InvalidInputError, UnsupportedError
from hand_models.compliance.compliant_finger import CompliantFingers, FingerAtRest, FingerLoads
from hand_models.compliance.grasp import complex_steps, slopes
from hand_models.compliance.hand_springs import PalmSprings, lateral_stiffness
from hand_models.compliance.link import Numbers, across
from hand_models.finger import PHALANGES, SettledFinger
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
    wrenches : ndarray, shape (m, 6)
        Wrench of all tiles and the palm on the rock, in H at rest [N, N·m].
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
    wrenches: Numbers
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
        Closed hand, not in a fingernail grasp.
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
            raise UnsupportedError(
                "a grasp with fingernail requires wrist 'fixed'; set this, or remove fingernail"
            )
        hand = settled.hand
        self.settled = settled
        self.preload = _preload(preload, settled)
        self.frames = hand.frames(settled.grasp.outer_rotation)
        self.scheme: MotorScheme = scheme
        self.fingers = [self._finger(i, each) for i, each in enumerate(settled.fingers)]
        self._own = [np.flatnonzero(settled.finger_of == i) for i in range(len(FINGERS))]
        self._batch = CompliantHands([self])

    def _finger(self, i: int, finger: SettledFinger) -> FingerAtRest:
        settled, hand, name = self.settled, self.settled.hand, FINGERS[i]
        base_tile = name.startswith("outer")
        own = settled.finger_of == i
        tendon = FingerTendon.from_table(hand.table, base_tile, settled.stiffness_ratio)
        return FingerAtRest(
            finger,
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
        if tensions is None:
            tensions = np.broadcast_to(self.preload, (len(twists), len(FINGERS)))
        return self._batch.loads([twists], [tensions])[0]

    def finger_loads(self, i: int, twists: Numbers) -> FingerLoads:
        """Return the loads of one finger in its plane at m twists of the wrist.

        Parameters
        ----------
        i : int
            Index of the finger in `FINGERS`.
        twists : ndarray, shape (m, 6)
            Twists of the hand frame H, as in `loads` [m, rad].
        """
        x, z, turned, slip = (self._batch.bases[0, :, i] @ _terms(twists))[:, None]
        tension = np.full((1, len(twists)), self.preload[i])
        alone = CompliantFingers([self.fingers[i]], self.scheme)
        return alone.loads(x, z, turned, tension, slip).of(0)

    def lateral_loads(self, i: int, twists: Numbers) -> Numbers:
        """Return the lateral loads of one finger's tiles at m twists of the wrist.

        Parameters
        ----------
        i : int
            Index of the finger in `FINGERS`.
        twists : ndarray, shape (m, 6)
            Twists of the hand frame H, as in `loads` [m, rad].

        Returns
        -------
        ndarray, shape (m, n_i)
            Load of each of the finger's n_i tiles, from the base outward [N].
        """
        own = self._own[i]
        moved = self._batch.aside[0, own] @ _terms(twists)
        return np.asarray((self._batch.lateral_stiffness[0][np.ix_(own, own)] @ moved).T)

    def tiles_of(self, i: int) -> Indices:
        """Return the indices of finger ``i``'s tiles in `SettledHand.tiles`."""
        return self._own[i]

    def pushing(self, torques: Numbers) -> Numbers:
        """Select the torques on stops, (m, k), from the torques of all joints, (m, 12) [N·m].

        k: joints of `SettledHand.stops`. A torque is positive where it pushes against the stop.
        """
        stops = [(i, j) for i, j, _ in self.settled.stops]
        upper = [self.fingers[i].finger.contacts[j].stop == "upper" for i, j in stops]
        own = [len(PHALANGES) * i + j for i, j in stops]
        return np.asarray(torques[:, own] * np.where(upper, 1.0, -1.0))

    @property
    def palm_wrenches(self) -> Array:
        """Wrench on the rock per newton of the palm's shear, and of its pressing, shape (2, 6)."""
        return np.asarray(self._batch.palm_wrenches[0].T)

    def palm_travel(self, twists: Numbers) -> Numbers:
        """Return the palm's travel toward −x of H and along +z, (m, 2) [m], at twists (m, 6)."""
        return np.asarray((self._batch.palm[0] @ _terms(twists)).T)

    def stiffness(self, twist: ArrayLike | None = None) -> Array:
        """Return the stiffness K_g = ∂w_g/∂x_g (Eq. 11) of the hand at a twist of the wrist.

        By complex steps, exact but for rounding. At a kink, the stiffness on one of its sides.

        Parameters
        ----------
        twist : array_like, shape (6,), optional
            Twist of the hand frame H, as in `loads` [m, rad]; at rest by default.

        Returns
        -------
        ndarray, shape (6, 6)
            Derivative of the wrench on the rock by the twist [N/m, N/rad, N, N·m/rad].
        """
        at = np.zeros(6) if twist is None else np.asarray(twist, dtype=float)
        return slopes(self.loads(complex_steps(at)).wrenches)


class CompliantHands:
    """H compliant hands whose loads are computed in one call, each at its own twists.

    Parameters
    ----------
    hands : sequence of CompliantHand, length H
        All of one scheme.

    Attributes
    ----------
    bases : ndarray, shape (H, 4, 4, 15)
        Motions (second axis: x, z, turn from x toward z, slip of the base tile) of each finger's
        base in its plane, per term of a twist: its 6 numbers, then 9 products of its rotations.
    aside, palm : ndarray, shapes (H, n, 15), (H, 2, 15)
        Displacement of each tile across its finger's plane, and of the palm toward −x and +z of
        the hand frame, per term of a twist.
    lateral_stiffness : ndarray, shape (H, n, n)
        Stiffness of each hand's tiles across their fingers' planes [N/m].
    palm_springs : PalmSprings
    palm_wrenches : ndarray, shape (H, 6, 2)
        Wrench on the rock per newton of the palm's shear, and of its pressing.
    """

    def __init__(self, hands: Sequence[CompliantHand]) -> None:
        self.hands = hands
        settled = [hand.settled for hand in hands]
        up, of = np.array([0.0, 0.0, 1.0]), settled[0].finger_of
        joints, along, sideways = (
            np.array([[getattr(frame, name) for frame in hand.frames] for hand in hands])
            for name in ("joint", "along", "across")
        )
        positions = np.array([each.positions for each in settled])
        first = np.searchsorted(of, range(len(FINGERS)))
        none = np.zeros((*joints.shape[:-1], 9))
        moves = (
            _moves(joints, along),
            _moves(joints, 0.0 * along + up),
            # from x toward z is against the sense of the axis across, z × x
            np.concatenate([0.0 * sideways, -sideways, none], axis=-1),
            _moves(positions[:, first], -along),
        )
        self.bases = np.stack(moves, axis=1)
        self.aside = _moves(positions, sideways[:, of])
        toward = np.array([-1.0, 0.0, 0.0]), up
        centres = np.array([[each.palm.centre] * len(toward) for each in settled])
        ways = np.broadcast_to(toward, centres.shape)
        self.palm = _moves(centres, ways)
        self.palm_wrenches = np.concatenate([ways, np.cross(centres, ways)], axis=-1).swapaxes(1, 2)
        self.palm_springs = PalmSprings(settled)
        arms = positions - joints[:, of]
        out = np.maximum((arms * along[:, of]).sum(axis=-1), 0.0)
        self.lateral_stiffness = lateral_stiffness(settled, out, arms[..., 2])
        self._positions = positions[..., None]
        self._axes = np.array([each.axes for each in settled])[..., None]
        # beside the fingers' planes, where tiles bear on one side
        beside = np.array([each.postures.across for each in settled])[..., None]
        places = joints[:, :, None] + beside * sideways[:, :, None]
        self._joints = places.reshape(len(hands), -1, 3)[..., None]
        self._along = along[:, :, None, :, None]
        # where each tile is among those of all fingers, and which tiles are of phalanges
        counts, place = np.bincount(of), np.arange(len(of)) - first[of]
        self._tiles = of * counts.max() + place
        self._phalanges = np.flatnonzero(place >= counts[of] - len(PHALANGES))
        fingers = [finger for hand in hands for finger in hand.fingers]
        self._fingers = CompliantFingers(fingers, hands[0].scheme)

    def loads(self, twists: Sequence[Numbers], tensions: Sequence[Numbers]) -> list[HandLoads]:
        """Return the loads of each hand at m twists of its wrist.

        Parameters
        ----------
        twists : sequence of ndarray, shape (m, 6)
            Twists for each hand [m, rad].
        tensions : sequence of ndarray, shape (m, 4)
            Tensions at which each hand's fingers have closed [N].
        """
        terms = _terms(np.array(twists))
        (hands, _, m), fingers, phalanges = terms.shape, len(FINGERS), len(PHALANGES)
        bases = np.moveaxis(self.bases @ terms[:, None], 1, 0)
        x, z, turned, slip = bases.reshape(len(bases), hands * fingers, m)
        closed = np.array(tensions).swapaxes(1, 2).reshape(hands * fingers, m)
        found = self._fingers.loads(x, z, turned, closed, slip)

        def of_hands(part: Numbers) -> Numbers:
            each = fingers * part.shape[-1]
            return np.asarray(part.swapaxes(1, 2).reshape(hands, each, m))

        def in_hands(part: Numbers) -> Numbers:
            flat = part.reshape(hands, fingers, phalanges, 2, m)
            risen = flat[..., :1, :] * self._along
            risen[..., 2, :] += flat[..., 1, :]
            return np.asarray(risen.reshape(hands, fingers * phalanges, 3, m))

        shears, those = of_hands(found.tile_shears)[:, self._tiles], self._phalanges
        normals = np.zeros_like(shears)
        normals[:, those] = of_hands(found.normals)
        laterals = self.lateral_stiffness @ (self.aside @ terms)
        palm = self.palm_springs.loads(self.palm @ terms)
        positions, axes = (
            np.broadcast_to(part, (*part.shape[:-1], m)).astype(terms.dtype)
            for part in (self._positions, self._axes)
        )
        points, u = (part.transpose(0, 2, 3, 1) for part in (found.points, found.directions))
        positions[:, those] = self._joints + in_hands(points)
        axes[:, those, 0], axes[:, those, 1] = -in_hands(u), in_hands(across(u))
        loads = np.stack([shears, normals, laterals], axis=2)
        forces = (loads[:, :, :, None] * axes).sum(axis=2)
        y, w = [1, 2, 0], [2, 0, 1]
        moments = positions[:, :, y] * forces[:, :, w] - positions[:, :, w] * forces[:, :, y]
        of_tiles = np.concatenate([forces.sum(axis=1), moments.sum(axis=1)], axis=1)
        all_hands = HandLoads(
            shears=shears.swapaxes(1, 2),
            normals=normals.swapaxes(1, 2),
            laterals=laterals.swapaxes(1, 2),
            tensions=found.motor_tensions.reshape(hands, fingers, m).swapaxes(1, 2),
            stop_torques=of_hands(found.stop_torques).swapaxes(1, 2),
            palm=palm.swapaxes(1, 2),
            positions=positions.transpose(0, 3, 1, 2),
            axes=axes.transpose(0, 4, 1, 2, 3),
            wrenches=(of_tiles + self.palm_wrenches @ palm).swapaxes(1, 2),
            reached=np.logical_and.reduce(found.reached.reshape(hands, fingers, m), axis=1),
        )
        each = [HandLoads(*parts) for parts in zip(*all_hands, strict=True)]
        return [
            own._replace(stop_torques=hand.pushing(own.stop_torques))
            for own, hand in zip(each, self.hands, strict=True)
        ]


def _moves(places: Array, ways: Array) -> Array:
    """Return how far places move along unit vectors per term of a twist (`_terms`).

    Shapes (..., 3), (..., 3), (..., 15). To second order: a · (v + ω × p + ω × (ω × p) / 2).
    """
    # a · (ω × (ω × p)) = (ω · a) (ω · p) − (a · p) (ω · ω)
    along = (ways * places).sum(axis=-1)[..., None, None]
    second = 0.5 * (ways[..., None] * places[..., None, :] - along * np.eye(3))
    flat = second.reshape(*places.shape[:-1], -1)
    return np.concatenate([ways, np.cross(places, ways), flat], axis=-1)


def _terms(twists: Numbers) -> Numbers:
    """Return the numbers of twists (..., m, 6) and the products of their turns, (..., 15, m)."""
    turns = twists[..., 3:]
    products = (turns[..., :, None] * turns[..., None, :]).reshape(*turns.shape[:-1], 9)
    return np.concatenate([twists, products], axis=-1).swapaxes(-1, -2)


def _preload(preload: ArrayLike | None, settled: SettledHand) -> Array:
    if preload is None:
        return np.full(len(FINGERS), settled.closing_tension)
    tensions = np.asarray(preload, dtype=float)
    most = settled.hand.maximum_tension
    if tensions.shape != (len(FINGERS),) or not ((tensions >= 0.0) & (tensions <= most)).all():
        raise InvalidInputError(
            f"four tensions from 0 to tendon.maximum_tension, {most:g} N, are needed, got "
            f"{tensions.tolist()}",
            field="tendon_preload",
        )
    return tensions
