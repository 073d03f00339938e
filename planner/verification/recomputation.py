"""What a plan's tensions, or where its wrists go, do to the hands: recomputed for the check.

From the plan's forces one by one: the balance of joints and tendons that they must keep (Eqs. 4–8,
`joint_balance`), the plan's half-planes, Eq. 21 itself (`LimitCurves`), and the published figures
of motors and structure.

What hangs on the hands alone is worked out when `Recomputing` is made, before there is a plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import FINGERS, HELD, HandModel
from hand_models.tile import HalfPlane, Surface
from planner.prepare import KEPT, HandBatch, TileIndex
from planner.question import HandOnHold
from planner.result import PlanArrays
from planner.verification.floating import check_finger, check_palm
from planner.verification.joint_balance import Fingers, JointBalance, tendons_of, wrenches_of
from planner.verification.nails import NO_NAILS, Nails
from planner.verification.sentences import COUNT, LOAD, PALM_SIGNS, UTILISATION, Recomputed

__all__ = ["LimitCurves", "Recomputing", "held_by", "limiting_shares", "planes_of"]

SMALL: Final = 1e-300
"""In place of a load that is zero, where something is divided by it [N]."""


@lru_cache(maxsize=KEPT)
def planes_of(pieces: tuple[tuple[HalfPlane, ...], ...], places: TileIndex) -> Array:
    """Return hands' half-planes over their capacities, of each tile if all its spines hold.

    Shape (T, 2 p, 3), for lateral loads of either sign; zero where a hand has fewer than others.
    """
    most = max(map(len, pieces))
    tables = [
        [
            (p.a_shear / p.capacity, p.a_normal / p.capacity, side * p.a_lateral / p.capacity)
            for side in (1.0, -1.0)
            for p in own
        ]
        + [(0.0, 0.0, 0.0)] * 2 * (most - len(own))
        for own in pieces
    ]
    return np.array(tables).take(places.hand, 0)


class LimitCurves:
    """The limit surfaces of some tiles, each on its own rock.

    The same surface as `Surface.strength`, written in the load itself instead of its direction:
    with a the load in the tile's plane and r its size, cos φ = a / r and cos θ = T / a, so that

        f_s(φ) [1 − (1 − λ(φ)) cos φ (1 − cos θ)] = f_s(φ) [1 − (1 − λ(φ)) (a − T) / r],

    and the exponent with which f_s falls that of the surface.

    Parameters
    ----------
    surfaces : sequence of Surface
        Some of them, in any order.
    of_tile : ndarray of int, shape (n,)
        Which of them each tile has.
    shares : ndarray, shape (n,) or ()
        Part of each tile's spines that are on the rock: that of a whole tile's strength.
    """

    def __init__(self, surfaces: Sequence[Surface], of_tile: Indices, shares: Array) -> None:
        numbers = [_numbers(surface) for surface in surfaces]
        of_each = np.array(numbers).T.take(of_tile, 1)
        of_each[[0, 2]] *= shares
        # f_s, and 1 − λ: at φ = 0, and what they lose up to φ_max; −1 / φ_max; γ; p
        self._flat, self._loss, (self._per_radian, self._gain, self._exponent) = np.split(
            of_each, [2, 4]
        )

    def excess(self, shear: Array, normal: Array, lateral: Array, relative: float) -> Array:
        """Return how far loads are beyond their surfaces, pressing ones in the tiles' planes [N].

        Parameters
        ----------
        shear, normal, lateral : ndarray, shape (n,)
            The last of either sign. Shear below zero is Coulomb friction's, not the spines'.
        relative : float
            Part of its strength by which a load may exceed it.

        Returns
        -------
        ndarray, shape (n,)
            Negative inside.
        """
        shear = np.maximum(shear, 0.0)
        along = np.hypot(shear, lateral)
        pull = np.minimum(normal, 0.0)
        # pressed, a tile holds what it does in its own plane, and more by the gain
        size = np.hypot(along, pull)
        ratio = np.minimum(np.arctan2(pull, along) * self._per_radian, 1.0)
        straight = self._flat[0] - self._loss[0] * ratio**self._exponent
        aside = self._flat[1] - self._loss[1] * ratio
        strength = straight * (1.0 - aside * ((along - shear) / (size + SMALL)))
        return np.asarray(size - self._gain * (normal - pull) - (1.0 + relative) * strength)


def _numbers(surface: Surface) -> tuple[float, ...]:
    """Return f_s and 1 − λ at φ = 0, what they lose up to φ_max, −1 / φ_max, γ, p."""
    share = surface.lateral_limit / surface.shear_limit
    return (
        surface.shear_limit,
        1.0 - share,
        surface.shear_limit - surface.pull_off_limit,
        share * (surface.lateral_pull_off_ratio - 1.0),
        -1.0 / surface.pull_off_angle,
        surface.compression_gain,
        surface.pull_off_exponent,
    )


PULLING: Final = np.array([np.inf, np.inf, 0.0])
"""Of a hand's force, what does not press."""

WINCH, DRIVEN, SHEAR, LATERAL, TIP = 2, 3, 6, slice(7, 9), 9
"""Rows of `_uses_of`: winches, the first that is a utilisation, shears of fingers, their lateral
reactions to either side, their tips."""

SIDES: Final = np.array([[1.0], [-1.0]])
"""Of a lateral reaction."""

most = np.maximum.reduce


@lru_cache(maxsize=KEPT)
def _uses_of(places: TileIndex, hand: HandModel, strength: float) -> tuple[Array, Array, Array]:
    """Return what tensions do to tendons, motors and fingers, in rows over all fingers.

    Torque and current of the motors, angle of the winches; then utilisations of tendons, by the
    motors' torque and current, of the shears and lateral reactions of fingers, and of their tips.

    Parameters
    ----------
    places : TileIndex
    hand : HandModel
        Which all hands are.
    strength : float
        What every tendon may hold [N].

    Returns
    -------
    per_newton, at_zero : ndarray, shape (10, F)
        Of tension; of straight fingers without any.
    per_shear : ndarray, shape (10, 1)
        Per newton of the shears of a finger's tiles together, which pull them away from the winch.
    """
    drive, (_, left, _, _) = hand.drive, tendons_of(places, hand)
    # Eq. 5: a tile's spring and the rock's shear balance the tendon's two strands
    travel = drive.pulley_ratio / drive.tile_stiffness / drive.winch_radius
    strands = np.add.reduceat(left, places.first_of_finger)
    torque = drive.winch_radius / drive.gear_ratio / drive.efficiency
    current, idle = torque / drive.torque_constant, drive.no_load_current
    driven = [torque / drive.maximum_torque, current / drive.maximum_current]
    per_newton, at_zero = np.zeros((2, TIP + 1, len(strands)))
    per_newton[:SHEAR] = np.array([torque, current, 0.0, 1.0 / strength, *driven])[:, None]
    per_newton[WINCH] = travel * drive.pulley_ratio * strands
    at_zero[1], at_zero[SHEAR - 1] = idle, idle / drive.maximum_current
    at_zero[WINCH] = hand.nail.pulley_radius * hand.nail.retraction / drive.winch_radius
    per_shear = np.zeros((TIP + 1, 1))
    per_shear[WINCH] = -travel
    per_shear[SHEAR] = 1.0 / hand.structure.finger_shear
    return per_newton, at_zero, per_shear


def held_by(forces: Array) -> Array:
    """Return what hands hold that exert forces on the rock (H, 3), across and away from it [N]."""
    held = np.minimum(forces, PULLING)
    return np.asarray(np.sqrt(np.add.reduce(held * held, axis=1)))


def limiting_shares(known: HandBatch) -> Array:
    """Return the part of a whole tile's strength that limits each tile on rock, shape (T,).

    The share of its spines there; with fewer than φ₀ of them, the hand's ``least_share``, half of
    φ₀ at none, and as a parabola between.
    """
    share, least = known.engagement, known.hands[0].hand.least_share
    return np.where(share < least, 0.5 * least * (1.0 + (share / least) ** 2), share)


class Recomputing:
    """Recomputes plans of the same settled hands.

    Parameters
    ----------
    known : HandBatch
    places : sequence of HandOnHold
        Whose limbs, wrists and preloads count: the tensions (4,) to which the motors of each hand
        have tightened its tendons if its wrist floats [N], by default the closing tension.
    strength : float
        What every tendon may hold [N].
    """

    def __init__(self, known: HandBatch, places: Sequence[HandOnHold], strength: float) -> None:
        hands, index, body = known.hands, known.places, known.hands[0].hand
        self.known, self._body, self._winch = known, body, body.drive.winch_radius
        self.limbs = tuple([place.limb for place in places])
        self._places = places
        self._balance = JointBalance(known)
        # tiles that touch nothing use nothing of their limits
        shares = np.where(known.touch.away, 1.0, limiting_shares(known))
        sheared = np.array([hand.surface.shear_limit for hand in hands])[index.hand]
        self._allowances = sheared * (shares - known.engagement) * known.touch.touches
        self._whole = known.touch.touches / shares
        self._curves = LimitCurves([hand.surface for hand in hands], index.hand, shares)
        self._lateral = np.array([hand.surface.lateral_limit for hand in hands])[index.hand]
        aside = self._lateral * known.engagement * known.touch.touches
        aside = np.add.reduceat(aside, index.first_of_finger)
        # fingers without rock have no reaction
        self._aside = SIDES / np.where(aside > 0.0, aside, np.inf)
        self._palm_shares = PALM_SIGNS / known.palm_limits
        self._per_newton, straight, self._per_shear = _uses_of(index, body, strength)
        self._at_zero = straight.copy()
        self._at_zero[WINCH] += known.bends @ (np.array(body.finger.pulley_radii) / self._winch)
        self._nails = Nails(known) if len(index.nails) else None
        drawing = [
            i
            for i, holds in enumerate(known.touch.holding)
            if holds and body.finger.friction > 0.0 and places[i // COUNT].wrist == "fixed"
        ]
        self._drawing = np.array(drawing, dtype=np.intp)
        self._closing = np.array([hands[i // COUNT].closing_tension for i in drawing])

    def allowed(self, arrays: PlanArrays) -> Array:
        """Return the error that loads of each hand may have, shape (H,), at least `LOAD` [N]."""
        largest = np.fmax.reduceat(np.abs(arrays.loads).ravel(), 3 * self.known.places.first)
        largest = np.fmax(largest, np.abs(arrays.palms).max(axis=1))
        return np.asarray(LOAD * np.fmax(largest, 1.0))

    def of(self, found: list[str], arrays: PlanArrays, bears: Array | None) -> Recomputed:
        """Return what a plan's numbers do to the hands.

        The tiles' loads are what the plan says, as long as these balance; see `solved`.

        Parameters
        ----------
        found : list of str
            What is wrong so far; what is found on the way is appended.
        arrays : PlanArrays
        bears : ndarray, shape (H,), or None
            Utilisation of each hand by what its stance adds: joints, caps.
        """
        known, balance, f = self.known, self._balance, arrays.tensions
        places, again, tiles = known.places, arrays.loads, len(arrays.loads)
        shear, normal = balance.shears(f), again[:, 1]
        floats = [h for h, wrist in enumerate(arrays.wrists) if wrist is not None]
        each = wrenches_of(arrays.points, arrays.forces)
        left = balance.left(f, each)
        stops, wound, drawn = balance.stops(left), f, shear
        if floats:
            # the motors of hands that float stand still where they have tightened their tendons
            wound = self._wound(f, floats)
            drawn = balance.shears(wound)
            shear, normal, stops = self._floated(found, arrays, floats, wound)
            again = np.column_stack((shear, normal, again[:, 2]))
        uses = self._per_newton * f
        uses += self._at_zero
        uses += self._per_shear * np.add.reduceat(drawn, places.first_of_finger)
        uses[LATERAL] = self._aside * np.add.reduceat(again[:, 2], places.first_of_finger)
        uses[TIP] = normal.take(places.tips) / self._body.structure.fingertip_force
        if floats:
            uses[WINCH] += self._per_newton[WINCH] * (wound - f)
            sums = np.add.reduceat(shear, places.first_of_finger)
            uses[SHEAR] = self._per_shear[SHEAR] * sums

        planes = (planes_of(arrays.half_planes, places) @ again[:, :, None])[:, :, 0]
        used = most(planes, axis=1)
        used *= self._whole
        # what a tile takes sideways is limited for a finger: it has a part of its reaction
        sides = again[:, 2:] / self._lateral[:, None] * SIDES.T
        planes = np.hstack([planes, sides])
        curve = self._curves.excess(again[:, 0], again[:, 1], again[:, 2], UTILISATION)
        if not most(curve) <= LOAD:
            # beyond its half-planes a tile may be outside the surface, too
            curve[(most(planes, axis=1) * self._whole > 1.0) | known.touch.away] = 0.0
        hooked = NO_NAILS
        if self._nails is not None:
            hooked = self._nails.loads(arrays)
            used[self._nails.tiles] = most(hooked.used, axis=1)
            turned = hooked.angles - self._body.nail.retraction
            uses[WINCH, self._nails.fingers] += self._body.nail.pulley_radius / self._winch * turned
        used = np.maximum(used, 0.0)

        wrenches = np.add.reduceat(each[:tiles], places.first)
        wrenches += each[tiles:]
        wrenches[:, 3:] += arrays.palm_moments
        force = arrays.wrenches[:, :3]
        along = force @ HELD.T
        palms = arrays.palms[:, ::2] * self._palm_shares
        pressed = most(palms, axis=1)
        by_rows = most(along, axis=1)
        # of all four tendons, motors, fingers and tips
        whole = most(uses[DRIVEN:].reshape(-1, len(palms), COUNT), axis=(0, 2))
        whole = np.maximum(whole, np.maximum.reduceat(used, places.first))
        whole = np.maximum(np.maximum(whole, pressed), by_rows / self._body.structure.hand_load)
        if bears is not None:
            whole = np.maximum(whole, bears)
        return Recomputed(
            limbs=self.limbs,
            known=known,
            arrays=arrays,
            floats=bool(floats),
            shear=shear,
            normal=normal,
            allowances=self._allowances,
            left=left if balance.held is None else np.where(balance.held, 0.0, left),
            stops=stops,
            stop_fingers=balance.stop_fingers,
            drawing=self._drawing,
            slackened=f[self._drawing] - self._closing,
            nails=hooked,
            curves=curve,
            forces=arrays.forces[:tiles] - (arrays.loads[:, None] @ arrays.axes)[:, 0],
            wrenches=wrenches,
            held=held_by(force),
            by_rows=by_rows,
            along=along,
            drives=uses[:DRIVEN],
            tiles=used,
            palms=pressed,
            hands=whole,
            shares=(uses[DRIVEN:].T, planes, palms),
        )

    def solved(self, again: Recomputed) -> Recomputed:
        """Return the numbers with the loads that fixed hands' tensions give by Eq. 6."""
        if again.floats:
            return again
        fingers = self._balance.fingers(again.arrays.tensions)
        return again._replace(shear=fingers.shear, normal=self._balance.solved(fingers)[0])

    # Floating wrists ----------------------------------------------------------------------------

    def _wound(self, tensions: Array, floats: Sequence[int]) -> Array:
        """Return to which tensions winches have drawn the tendons: of floating hands, preloads."""
        wound = tensions.reshape(-1, COUNT).copy()
        for h in floats:
            preload = self._places[h].tendon_preload
            wound[h] = self.known.hands[h].closing_tension if preload is None else preload
        return wound.ravel()

    def _floated(
        self, found: list[str], arrays: PlanArrays, floats: Sequence[int], wound: Array
    ) -> tuple[Array, Array, Array]:
        """Return shears, normals and what presses on stops of hands of which some float.

        ``wound``: to which tensions winches have drawn the tendons.
        """
        known, allowed, balance = self.known, self.allowed(arrays), self._balance
        places, fingers = known.places, balance.fingers(wound)
        unknown: list[int] = []
        fingers = Fingers(*(part.copy() for part in fingers))
        for h in floats:
            hand, limb, wrist = known.hands[h], self.limbs[h], arrays.wrists[h]
            assert wrist is not None
            for i, name in enumerate(FINGERS):
                finger = COUNT * h + i
                own = np.flatnonzero(places.finger == finger)
                fingers.points[own], fingers.axes[own] = arrays.points[own], arrays.axes[own]
                planned = arrays.loads[own], arrays.points[own], arrays.axes[own]
                there = check_finger(
                    found,
                    f"{limb}: {name}",
                    hand,
                    i,
                    (*planned, float(arrays.tensions[finger])),
                    wrist,
                    (float(wound[finger]), fingers.shear[own]),
                    float(allowed[h]),
                )
                fingers.shear[own], fingers.joints[finger] = there.shear, there.joints
                if there.torques is None:
                    unknown.append(finger)
                else:
                    fingers.torques[finger] = there.torques
            check_palm(found, limb, hand, arrays.palms[h], wrist, float(allowed[h]))
        normal, left = balance.solved(fingers)
        told = places.phalanges[unknown]
        normal[told], left[unknown] = arrays.loads[told, 1], 0.0
        return fingers.shear, normal, balance.stops(left)
