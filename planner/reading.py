"""From a hand's loads y to what each tile, tendon, motor and the palm carry."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.compliant_hand import CompliantHand
from hand_models.finger import PHALANGES
from hand_models.frames import Array
from hand_models.hand import FINGERS, NAIL, SettledHand
from hand_models.row_layout import PALM_PRESSING, PALM_SHEAR
from hand_models.wrench_space import WrenchSpace
from planner.plan import FingerPlan, HandPlan, PalmPlan, TileLoad, WristPlan

__all__ = ["read_floating_hand", "read_hand"]


def read_hand(limb: str, settled: SettledHand, space: WrenchSpace, y: Array) -> HandPlan:
    """Turn one hand's loads y into tile loads and forces.

    What may not be negative and is, by rounding, counts as zero.

    Parameters
    ----------
    limb : str
    settled : SettledHand
    space : WrenchSpace
        Its set.
    y : ndarray, shape (m,)
        A load for each of the set's columns [N].
    """
    column = {name: i for i, name in enumerate(space.columns)}
    signed = np.array([name.endswith(("/lateral", "/nail")) for name in space.columns])
    y = np.where(signed, y, np.maximum(y, 0.0))

    def load(name: str) -> float:
        return float(y[column[name]]) if name in column else 0.0

    tensions = np.array([load(f"{finger}/tension") for finger in FINGERS])
    laterals = np.array([load(f"{finger}/lateral") for finger in FINGERS])
    axials = np.array([load(f"{finger}/nail") for finger in FINGERS])
    carried = _Carried(
        tiles=settled.tile_loads(tensions, laterals, axials),
        positions=settled.positions,
        axes=settled.axes,
        tensions=tensions,
        wound=tensions,
        palm=(load(PALM_SHEAR), load(PALM_PRESSING)),
    )
    return _read(limb, settled, space, y, carried, None)


def read_floating_hand(
    limb: str, settled: SettledHand, hand: CompliantHand, space: WrenchSpace, wrist: WristPlan
) -> HandPlan:
    """Turn the pose of a floating hand's wrist into tile loads and forces, by the model itself.

    Parameters
    ----------
    limb : str
    settled : SettledHand
        At rest.
    hand : CompliantHand
    space : WrenchSpace
        Its set, linearised at that pose.
    wrist : WristPlan
    """
    loads = hand.loads(wrist.twist[None])
    shear, pressing = (max(float(load), 0.0) for load in loads.palm[0])
    carried = _Carried(
        tiles=loads.tile_loads[0],
        positions=loads.positions[0],
        axes=loads.axes[0],
        tensions=loads.tensions[0],
        wound=hand.preload,
        palm=(shear, pressing),
    )
    return _read(limb, settled, space, wrist.twist, carried, wrist)


class _Carried(NamedTuple):
    """What tiles (n, 3), tendons (4,) and the palm carry, and where the tiles are [N, m].

    ``wound``: the tension to which each motor tightened its tendon, whose winch stands still from
    there on if the wrist floats.
    """

    tiles: Array
    positions: Array
    axes: Array
    tensions: Array
    wound: Array
    palm: tuple[float, float]


def _read(
    limb: str,
    settled: SettledHand,
    space: WrenchSpace,
    y: Array,
    carried: _Carried,
    wrist: WristPlan | None,
) -> HandPlan:
    loads, positions, tensions = carried.tiles, carried.positions, carried.tensions
    forces = np.einsum("tk,tkx->tx", loads, carried.axes)
    pieces = settled.surface.pieces()
    planes = np.array([(p.a_shear, p.a_normal, p.a_lateral) for p in pieces])
    capacities = np.array([p.capacity for p in pieces])
    magnitudes = np.column_stack([loads[:, :2], np.abs(loads[:, 2])])
    used = np.where(settled.touching, (magnitudes @ planes.T / capacities).max(axis=1), 0.0)
    limits = {int(t): settled.nail_limits(int(t)) for t in np.flatnonzero(settled.nails)}
    for t, own_limits in limits.items():
        used[t] = max(
            (limit.a_shear * loads[t, 0] + limit.a_normal * loads[t, 1]) / limit.capacity
            for limit in own_limits
        )
    used = np.maximum(used, 0.0)
    drive = settled.hand.drive
    losses = (1.0 - settled.hand.finger.friction) ** np.arange(len(PHALANGES) + 1.0)
    fingers = []
    for i, finger in enumerate(FINGERS):
        own = np.flatnonzero(settled.finger_of == i)
        dragged = [t for t in own if settled.tiles[t].phalanx != NAIL]
        tension, wound = float(tensions[i]), float(carried.wound[i])
        at_rest = settled.loads[:, 0] @ np.array([1.0, wound])
        tiles = tuple(
            TileLoad(
                phalanx=settled.tiles[t].phalanx,
                contact=settled.tiles[t].contact,
                position=positions[t],
                force=forces[t],
                shear=float(loads[t, 0]),
                normal=float(loads[t, 1]),
                lateral=float(loads[t, 2]),
                shear_axis=carried.axes[t, 0],
                normal_axis=carried.axes[t, 1],
                lateral_axis=carried.axes[t, 2],
                utilisation=float(used[t]),
                load_at_zero=settled.loads[t, :, 0] if wrist is None else None,
                load_per_newton=settled.loads[t, :, 1] if wrist is None else None,
                half_planes=limits.get(int(t), pieces),
            )
            for t in own
        )
        fingers.append(
            FingerPlan(
                name=finger,
                tendon_tension=tension,
                motor_torque=drive.torque(tension),
                motor_current=drive.current(tension),
                winch_angle=drive.winch_angle(
                    settled.fingers[i],
                    wound,
                    at_rest[dragged] if wrist is not None else loads[dragged, 0],
                    losses[: len(dragged)],
                    settled.hand.nail.pulley_radius * float(settled.nail_angles[i]),
                ),
                tiles=tiles,
            )
        )
    shear, pressing = carried.palm
    palm = PalmPlan(
        position=settled.palm.centre,
        force=np.array([-shear, 0.0, pressing]),
        moment=np.zeros(3),
        engaged=settled.palm.engaged,
        utilisation=(
            max(shear / settled.palm.shear_limit, pressing / settled.palm.pressing_limit)
            if settled.palm.engaged
            else 0.0
        ),
    )
    wrench = np.concatenate([palm.force, np.cross(palm.position, palm.force)])
    wrench = wrench + np.concatenate([forces.sum(axis=0), np.cross(positions, forces).sum(axis=0)])
    return HandPlan(
        limb=limb,
        wrench=wrench,
        fingers=tuple(fingers),
        palm=palm,
        utilisation=max(0.0, float(space.utilisations(y).max())),
        seating=settled.seating,
        space=space,
        wrist=wrist,
    )
