"""What a plan's tensions, or where its wrists go, do to the hands: recomputed for the check.

From the plan's forces one by one: the balance of joints and tendons that they must keep (Eqs. 4–8,
`joint_balance`), the plan's half-planes, Eq. 21 itself (`limit_curve`), and the published figures
of motors and structure. Only where something is off, Eq. 6 is solved to say what would be right
(`equilibrium`).

What hangs on the hands alone is worked out when `Recomputing` is made, before there is a plan.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS, HELD
from planner.prepare import HandBatch
from planner.result import PlanArrays
from planner.verification.arrays import (
    DRIVEN,
    LOAD,
    SHEAR,
    TIP,
    UTILISATION,
    WINCH,
    arms_of,
    limits_of,
    planes_of,
    roles_of,
    uses_of,
)
from planner.verification.equilibrium import Equilibrium, equilibrium
from planner.verification.floating import ClaimedFinger, check_finger, check_palm
from planner.verification.joint_balance import LEVER, JointBalance
from planner.verification.nails import check_nails, nail_angles
from planner.verification.sentences import Recomputed

__all__ = ["PULLING", "STOP", "Recomputing"]

STOP: Final = 1e-6
"""How much torque a joint's stop may seem to pull, by rounding [N·m]."""

NEAR: Final = LOAD * LEVER
"""Error of balances [N, N·m], drives and utilisations below which nothing can be off."""

PULLING: Final = np.array([np.inf, np.inf, 0.0])
"""Of a hand's force, what does not press."""

COUNT: Final = len(FINGERS)

least, most = np.minimum.reduce, np.maximum.reduce

PALM_SIDES: Final = np.array([-1.0, 0.0, 1.0])
"""Which way a palm carries along x, y and z."""

PALM_SIGNS: Final = PALM_SIDES[::2]
"""The same along x and z: of its shear and pressing."""


class Recomputing:
    """Recomputes plans of the same settled hands.

    Parameters
    ----------
    known : HandBatch
    limbs : tuple of str
    strength : float
        What every tendon may hold [N].
    preloads : sequence of ndarray or None
        Tensions (4,) to which the motors of each hand have tightened its tendons if its wrist
        floats [N]; None for the closing tension.
    """

    def __init__(
        self,
        known: HandBatch,
        limbs: tuple[str, ...],
        strength: float,
        preloads: Sequence[Array | None],
    ) -> None:
        hands, places, body = known.hands, known.places, known.hands[0].hand
        self.known, self.limbs, self._body, self._preloads = known, limbs, body, preloads
        self._balance = JointBalance(known)
        self._limits = limits_of(known)
        self._arms = arms_of(known.points)
        self._palm_shares = PALM_SIGNS / known.palm_limits
        self._uses = uses = uses_of(places, body, strength)
        self._at_zero = uses.at_zero.copy()
        self._at_zero[WINCH] += known.bends @ uses.per_bend
        self._tiles = tuple([hand.tiles for hand in hands])
        self._engaged = tuple([hand.palm.engaged for hand in hands])
        self._off = [h for h, engaged in enumerate(self._engaged) if not engaged]

    def allowed(self, arrays: PlanArrays) -> Array:
        """Return the error that loads of each hand may have, shape (H,), at least `LOAD` [N]."""
        first = roles_of(self.known.places).first_component
        largest = np.fmax.reduceat(np.abs(arrays.loads).ravel(), first)
        most = np.fmax(largest, np.abs(arrays.palms).max(axis=1))
        return np.asarray(LOAD * np.fmax(most, 1.0))

    def of(self, found: list[str], arrays: PlanArrays, bears: Array | None) -> Recomputed:
        """Return what a plan's numbers do to the hands.

        The tiles' loads are what the plan says, as long as these balance; see `near`.

        Parameters
        ----------
        found : list of str
            What is wrong so far; what is found on the way is appended.
        arrays : PlanArrays
        bears : ndarray, shape (H,), or None
            Utilisation of each hand by what its stance adds: joints, caps.
        """
        known, balance, f = self.known, self._balance, arrays.tensions
        places, loads, tiles = known.places, arrays.loads, len(arrays.loads)
        shear, normal, floats = balance.shears(f), loads[:, 1], self._floats(arrays)
        same = arrays.points is known.points
        each = (self._arms if same else arms_of(arrays.points)) @ arrays.forces[:, :, None]
        each = each[:, :, 0]
        left = balance.left(f, each)
        stops = balance.stops(left)
        drawn = np.add.reduceat(shear, places.first_of_finger)
        again = loads
        if floats:
            shear, normal, stops, drawn = self._floated(found, arrays, floats)
            again = np.column_stack((shear, normal, loads[:, 2]))
        uses = self._uses.per_newton * f
        uses += self._at_zero
        uses += self._uses.per_shear * drawn
        uses[TIP] = normal.take(places.tips) * self._uses.per_press
        if floats:
            uses[WINCH] += self._uses.per_newton[WINCH] * (self._wound(f, floats) - f)
            uses[SHEAR] = self._uses.per_shear[SHEAR] * np.add.reduceat(
                shear, places.first_of_finger
            )

        limits, told = self._limits, arrays.half_planes
        planes = limits.planes if told == limits.pieces else planes_of(told, known)
        used = most(planes @ again[:, :, None], axis=(1, 2))
        curve = limits.curves.excess(again[:, 0], again[:, 1], again[:, 2], UTILISATION)
        if not most(curve) <= LOAD:
            # beyond its half-planes a tile may be outside the surface, too
            curve[(used > 1.0) | known.touch.away] = -np.inf
        if len(places.nails):
            used += check_nails(found, known, self.limbs, arrays, self.allowed(arrays))
            turned = nail_angles(known, arrays) - self._body.nail.retraction
            uses[WINCH] += self._uses.per_nail * turned
        used = np.maximum(used, 0.0)

        wrenches = np.add.reduceat(each[:tiles], places.first)
        wrenches += each[tiles:]
        wrenches[:, 3:] += arrays.palm_moments
        force = arrays.wrenches[:, :3]
        by_rows = most(HELD @ force.T)
        held = np.minimum(force, PULLING)
        palms = arrays.palms[:, ::2] * self._palm_shares
        pressed = most(palms, axis=1)
        # of all four tendons, motors, fingers and tips
        whole = most(uses[DRIVEN:].reshape(-1, len(palms), COUNT), axis=(0, 2))
        whole = np.maximum(whole, np.maximum.reduceat(used, places.first))
        whole = np.maximum(np.maximum(whole, pressed), by_rows / self._uses.hand_load)
        if bears is not None:
            whole = np.maximum(whole, bears)
        return Recomputed(
            limbs=self.limbs,
            known=known,
            arrays=arrays,
            shear=shear,
            normal=normal,
            left=left,
            stops=stops,
            stop_fingers=balance.stop_fingers,
            curves=curve,
            forces=arrays.forces[:tiles] - (loads[:, None] @ arrays.axes)[:, 0],
            wrenches=wrenches - arrays.wrenches,
            held=np.sqrt(np.add.reduce(held * held, axis=1)),
            by_rows=by_rows,
            drives=uses[:DRIVEN],
            tiles=used,
            palms=pressed,
            hands=whole,
        )

    def near(self, again: Recomputed) -> bool:
        """Whether all numbers of fixed hands are so near that none can be off by what it may.

        By the Euclidean norm of all, which none of them exceeds. Numbers that are not finite are
        not near, nor are those of a plan that has tiles elsewhere than the hands.
        """
        arrays, touch, normal = again.arrays, self.known.touch, again.normal
        apart, left, palms = again.shear - arrays.loads[:, 0], again.left, arrays.palms
        if self._floats(arrays) or not self._at_home(arrays):
            return False
        if len(self.known.places.nails):
            apart[self.known.places.nails] = 0.0
        if self._balance.held is not None:
            left = np.where(self._balance.held, 0.0, left)
        off = np.concatenate(
            (
                apart,
                left.ravel(),
                normal.take(self.known.places.bases),
                again.forces.ravel(),
                again.wrenches.ravel(),
                (again.drives - arrays.drives).ravel(),
                again.tiles - arrays.tile_utilisations,
                again.palms - arrays.palm_utilisations,
                again.hands - arrays.utilisations,
            )
        )
        return bool(
            math.sqrt(off.dot(off)) <= NEAR
            and least(arrays.tensions) >= 0.0
            and least(again.shear) >= -LOAD
            and most(again.curves) <= LOAD
            and least(again.by_rows - again.held) >= -LOAD
            and least(palms * PALM_SIDES, axis=None) >= 0.0
            and not palms[:, 1].any()
            and not (self._off and palms[self._off].any())
            and (
                len(touch.touching) == len(touch.contacts)
                or (least(normal * touch.framed) >= -LOAD and not arrays.forces[touch.idle].any())
            )
            and (not len(again.stops) or least(again.stops) >= -STOP)
            and arrays.tiles == self._tiles
            and np.array_equal(arrays.engagement, self.known.engagement)
            and arrays.engaged == self._engaged
        )

    def solved(self, again: Recomputed) -> Recomputed:
        """Return the numbers with the loads that fixed hands' tensions give by Eq. 6."""
        arrays = again.arrays
        if self._floats(arrays):
            return again
        shear, normal, _ = self._solved(arrays.tensions)
        return again._replace(shear=shear, normal=normal)

    @cached_property
    def _equilibrium(self) -> Equilibrium:
        return equilibrium(self.known)

    def _solved(self, tensions: Array) -> tuple[Array, Array, Array]:
        """Return shear and normal of each tile (T,), and what presses on stops (k,), by Eq. 6."""
        solved = self._equilibrium
        rows = solved.rows[0] + solved.rows[1] * tensions[solved.fingers]
        tiles, fingers, _ = self.known.places.shape
        shear, normal = rows[: 2 * tiles].reshape(2, tiles)
        return shear, normal, rows[2 * tiles + fingers :]

    # Floating wrists ----------------------------------------------------------------------------

    def _at_home(self, arrays: PlanArrays) -> bool:
        """Whether tiles and palms are where the settled hands have them, and turned so."""
        pairs = (arrays.points, self.known.points), (arrays.axes, self.known.axes)
        return all(told is own or np.array_equal(told, own) for told, own in pairs)

    def _floats(self, arrays: PlanArrays) -> list[int]:
        return [h for h, wrist in enumerate(arrays.wrists) if wrist is not None]

    def _wound(self, tensions: Array, floats: Sequence[int]) -> Array:
        """Return to which tensions winches have drawn the tendons: of floating hands, preloads."""
        wound = tensions.copy()
        for h in floats:
            preload = self._preloads[h]
            own = wound[COUNT * h : COUNT * (h + 1)]
            own[:] = self.known.hands[h].closing_tension if preload is None else preload
        return wound

    def _floated(
        self, found: list[str], arrays: PlanArrays, floats: Sequence[int]
    ) -> tuple[Array, Array, Array, Array]:
        """Return shears, normals and stops of hands of which some float, and sums of shears.

        The motors of those stand still where they have tightened their tendons; the sums are of
        these tensions.
        """
        wound = self._wound(arrays.tensions, floats)
        shear, normal, stops = self._solved(wound)
        drawn = np.add.reduceat(shear, self.known.places.first_of_finger)
        for h in floats:
            self._float(found, arrays, h, (wound, shear, normal, stops))
        return shear, normal, stops, drawn

    def _float(
        self,
        found: list[str],
        arrays: PlanArrays,
        h: int,
        loads: tuple[Array, Array, Array, Array],
    ) -> None:
        """Put what a floating hand carries where its wrist goes in place of that at rest.

        ``loads``: the preloads, shears, normals and what presses on stops.
        """
        hand, limb, wrist = self.known.hands[h], self.limbs[h], arrays.wrists[h]
        assert wrist is not None
        (preloads, shear, normal, stops), eq = loads, self._equilibrium
        allowed = float(self.allowed(arrays)[h])
        for i, name in enumerate(FINGERS):
            finger = COUNT * h + i
            own = np.flatnonzero(self.known.places.finger == finger)
            said = ClaimedFinger(
                arrays.loads[own],
                arrays.points[own],
                arrays.axes[own],
                float(arrays.tensions[finger]),
            )
            check = check_finger(hand, i, said, wrist, float(preloads[finger]), shear[own])
            shear[own], normal[own] = check.shear, check.normal
            mine = eq.stop_fingers == finger
            stops[mine] = check.stop[eq.stop_joints[mine]]
            found.extend(f"{limb}: {name}: {sentence}" for sentence in check.wrong)
            off = float(np.abs(check.lateral - said.loads[:, 2]).max())
            if not max(off, abs(check.tension - said.tension)) <= allowed:
                found.append(f"{limb}: {name} does not hold what the plan says")
        found.extend(check_palm(hand, limb, arrays.palms[h], wrist, allowed))
