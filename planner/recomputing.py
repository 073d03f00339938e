"""What a plan's tensions, or where its wrists go, do to the hands: recomputed for the check.

From the full equilibrium of Eq. 6 (`equilibrium`), the plan's half-planes, Eq. 21 itself
(`limit_curve`), the forces one by one and the published figures of motors and structure.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from hand_models.frames import Array
from hand_models.hand import FINGERS
from hand_models.structure import HELD
from planner.carried import Carried
from planner.equilibrium import equilibrium
from planner.limit_curve import LimitCurves
from planner.stacked import KEPT, Same, Stacked
from planner.verify_arrays import LOAD, UTILISATION, Limits, arms_of, limits_of, roles_of
from planner.verify_floating import Said, check_finger, check_palm
from planner.verify_nails import check_nails, nail_angles
from planner.verify_words import Recomputed

__all__ = ["Recomputing", "recomputing_of"]

COUNT: Final = len(FINGERS)

PALM_SIGNS: Final = np.array([-1.0, 1.0])
"""Which way a palm shears and presses along x and z."""


@lru_cache(maxsize=KEPT)
def recomputing_of(
    known: Stacked, limbs: tuple[str, ...], strength: float, preloads: Same
) -> Recomputing:
    """Return what recomputes plans of hands, made once for the same hands; see `Recomputing`."""
    return Recomputing(known, limbs, strength, preloads)


class Recomputing:
    """Recomputes plans of the same settled hands.

    Parameters
    ----------
    known : Stacked
    limbs : tuple of str
    strength : float
        What every tendon may hold [N].
    preloads : Same
        Tensions (4,) to which the motors of each hand have tightened its tendons if its wrist
        floats [N]; None for the closing tension.
    """

    def __init__(
        self, known: Stacked, limbs: tuple[str, ...], strength: float, preloads: Same
    ) -> None:
        self.known, self.limbs = known, limbs
        self._preloads: tuple[Array | None, ...] = preloads.each  # type: ignore[assignment]
        self._roles, self._body = roles_of(known.places), known.hands[0].hand
        self._equilibrium = equilibrium(known.hands)
        surfaces = [hand.surface for hand in known.hands]
        self._curves = LimitCurves(surfaces, known.places.hand)
        self._limits = limits_of(Same(*surfaces))
        self._planes = self._limits.on(known)
        self._arms = arms_of(known.points)
        # of each tendon: torque and current of its motor, then what its strength and these use
        drive = self._body.drive
        torque = drive.winch_radius / drive.gear_ratio / drive.efficiency
        current, idle = torque / drive.torque_constant, drive.no_load_current
        use = 1.0 / strength, torque / drive.maximum_torque, current / drive.maximum_current
        self._per_newton = np.array([torque, current, *use])[:, None]
        self._at_zero = np.array([0.0, idle, 0.0, 0.0, idle / drive.maximum_current])[:, None]

    def allowed(self, carried: Carried) -> Array:
        """Return the error that loads of each hand may have, shape (H,), at least `LOAD` [N]."""
        largest = np.fmax.reduceat(np.abs(carried.loads).ravel(), self._roles.first_component)
        most = np.fmax(largest, np.abs(carried.palms).max(axis=1))
        return np.asarray(LOAD * np.fmax(most, 1.0))

    def of(self, found: list[str], carried: Carried, bears: Array | None) -> Recomputed:
        """Return what a plan's numbers do to the hands.

        Parameters
        ----------
        found : list of str
            What is wrong so far; what is found on the way is appended.
        carried : Carried
        bears : ndarray, shape (H,), or None
            Utilisation of each hand by what its stance adds: joints, caps.
        """
        known, eq, f, loads = self.known, self._equilibrium, carried.tensions, carried.loads
        places, tiles, fingers = known.places, len(loads), len(f)
        # of a floating hand the motors stand still where they have tightened its tendons
        floats = [h for h, wrist in enumerate(carried.wrists) if wrist is not None]
        wound = self._wound(f, floats) if floats else f
        rows = eq.rows[1] * wound.take(eq.fingers)
        rows += eq.rows[0]
        shear, normal = planar = rows[: 2 * tiles].reshape(2, tiles)
        drawn, stops = rows[2 * tiles : 2 * tiles + fingers], rows[2 * tiles + fingers :]
        for h in floats:
            self._float(found, carried, h, (wound, shear, normal, stops))
        apart, aside = np.abs(loads[:, :2].T - planar), np.abs(loads[:, 2])

        same = carried.half_planes == self._limits.pieces
        planes = self._planes if same else Limits.of(carried.half_planes).on(known)
        used = np.einsum("pkt,kt->pt", planes, np.concatenate((planar, aside[None])))
        used = np.maximum.reduce(used)
        curve = self._curves.excess(shear, normal, aside, UTILISATION)
        curve[(used > 1.0) | known.touch.away] = -np.inf
        if len(places.nails):
            apart[:, places.nails] = 0.0
            used += check_nails(found, known, self.limbs, carried, self.allowed(carried))
        forces = carried.forces[:tiles] - np.einsum("tk,tkx->tx", loads, carried.axes)

        palm, force = carried.palms, carried.wrenches[:, :3]
        by_rows = np.maximum.reduce(HELD @ force.T)
        held = force.copy()
        np.minimum(force[:, 2], 0.0, out=held[:, 2])
        held = np.sqrt(np.einsum("hx,hx->h", held, held))
        pressed = palm[:, ::2] * PALM_SIGNS / known.palm_limits
        pressed = np.maximum(pressed[:, 0], pressed[:, 1])
        motors = self._per_newton * f
        motors += self._at_zero
        whole = self._hand_use(motors[2:], shear, normal, used)
        whole = np.maximum(np.maximum(whole, pressed), by_rows / self._body.structure.hand_load)
        if bears is not None:
            whole = np.maximum(whole, bears)
        wrenches = self._summed(carried) - carried.wrenches
        return Recomputed(
            self.limbs,
            known,
            carried,
            shear,
            normal,
            stops,
            eq.stop_fingers,
            held,
            by_rows,
            float(whole.max()),
            np.concatenate(
                (motors[0], motors[1], self._turned(carried, drawn), used, pressed, whole)
            ),
            np.concatenate(
                (
                    # NaN, and so off, where a tension is infinite
                    0.5 * (np.abs(f) - f),
                    apart.ravel(),
                    -shear,
                    -normal * known.touch.framed,
                    np.abs(forces).ravel(),
                    curve,
                    palm[:, 0],
                    -palm[:, 2],
                    np.abs(wrenches).ravel(),
                    held - by_rows,
                )
            ),
        )

    def _hand_use(self, motors: Array, shear: Array, normal: Array, used: Array) -> Array:
        """Return how much each hand's tendons, motors, fingers and tiles are used, shape (H,)."""
        structure, places = self._body.structure, self.known.places
        fingers = np.add.reduceat(shear, places.first_of_finger) / structure.finger_shear
        tips = normal.take(places.tips) / structure.fingertip_force
        fingers = np.maximum(np.maximum(fingers, tips), np.maximum.reduce(motors))
        by_finger = np.maximum.reduceat(fingers, places.first_finger)
        return np.maximum(by_finger, np.maximum.reduceat(used, places.first))

    def _turned(self, carried: Carried, drawn: Array) -> Array:
        """Return the winches' angles, by what tiles and joints draw in and where nails hook."""
        drive, nail = self._body.drive, self._body.nail
        angles: float | Array = nail.retraction
        if len(self.known.places.nails):
            angles = nail_angles(self.known, carried)
        return np.asarray((drawn + nail.pulley_radius * angles) / drive.winch_radius)

    def _summed(self, carried: Carried) -> Array:
        """Return the hands' wrenches, force by force, shape (H, 6)."""
        tiles, same = len(carried.loads), carried.points is self.known.points
        arms = self._arms if same else arms_of(carried.points)
        each = np.einsum("nwx,nx->nw", arms, carried.forces)
        found = np.add.reduceat(each[:tiles], self.known.places.first)
        found += each[tiles:]
        found[:, 3:] += carried.palm_moments
        return found

    # Floating wrists ----------------------------------------------------------------------------

    def _wound(self, tensions: Array, floats: Sequence[int]) -> Array:
        """Return to which tensions winches have drawn the tendons: of floating hands, preloads."""
        wound = tensions.copy()
        for h in floats:
            preload = self._preloads[h]
            own = wound[COUNT * h : COUNT * (h + 1)]
            own[:] = self.known.hands[h].closing_tension if preload is None else preload
        return wound

    def _float(
        self,
        found: list[str],
        carried: Carried,
        h: int,
        loads: tuple[Array, Array, Array, Array],
    ) -> None:
        """Put what a floating hand carries where its wrist goes in place of that at rest.

        ``loads``: the preloads, shears, normals and what presses on stops.
        """
        hand, limb, wrist = self.known.hands[h], self.limbs[h], carried.wrists[h]
        assert wrist is not None
        (preloads, shear, normal, stops), eq = loads, self._equilibrium
        allowed = float(self.allowed(carried)[h])
        for i, name in enumerate(FINGERS):
            finger = COUNT * h + i
            own = np.flatnonzero(self.known.places.finger == finger)
            said = Said(
                carried.loads[own],
                carried.points[own],
                carried.axes[own],
                float(carried.tensions[finger]),
            )
            check = check_finger(hand, i, said, wrist, float(preloads[finger]), shear[own])
            shear[own], normal[own] = check.shear, check.normal
            mine = eq.stop_fingers == finger
            stops[mine] = check.stop[eq.stop_joints[mine]]
            found.extend(f"{limb}: {name}: {sentence}" for sentence in check.wrong)
            off = float(np.abs(check.lateral - said.loads[:, 2]).max())
            if not max(off, abs(check.tension - said.tension)) <= allowed:
                found.append(f"{limb}: {name} does not hold what the plan says")
        found.extend(check_palm(hand, limb, carried.palms[h], wrist, allowed))
