"""From where a floating hand's wrist goes to what each tile, tendon, motor and palm carries."""

from __future__ import annotations

import numpy as np

from hand_models.compliance import CompliantHand
from hand_models.hand import SettledHand
from hand_models.tile import inner_half_planes
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import HandBatch
from planner.result.hand_plan import HandPlan, PalmPlan, WristPlan
from planner.result.load_recovery import drawn_tendons

__all__ = ["recover_floating_hand"]


def recover_floating_hand(
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
    found = hand.loads(wrist.twist[None])
    loads, positions, axes = found.tile_loads[0], found.positions[0], found.axes[0]
    tensions = found.tensions[0]
    forces = np.einsum("tk,tkx->tx", loads, axes)
    pieces = inner_half_planes(settled.surface)
    planes = np.array([(p.a_shear, p.a_normal, p.a_lateral) for p in pieces])
    capacities = np.array([p.capacity for p in pieces])
    magnitudes = np.column_stack([loads[:, :2], np.abs(loads[:, 2])])
    used = (magnitudes @ planes.T / capacities).max(axis=1)
    used /= np.where(settled.touching, settled.engagement, np.inf)
    known, drive = HandBatch.of((settled,)), settled.hand.drive
    # the winch stands still from the preload on
    at_rest = settled.loads[:, 0, 0] + settled.loads[:, 0, 1] * hand.preload[settled.finger_of]
    drawn = np.add.reduceat(at_rest, known.places.first_of_finger)
    joints, losses, nails = drawn_tendons(known)
    turned = drive.winch_angle(joints, hand.preload, drawn, losses, nails)
    shear, pressing = (max(float(load), 0.0) for load in found.palm[0])
    palm = PalmPlan(
        position=settled.palm.centre,
        force=np.array([-shear, 0.0, pressing]),
        moment=np.zeros(3),
        engaged=settled.palm.engaged,
        utilisation=float((np.array([shear, pressing]) / known.palm_limits[0]).max()),
    )
    wrench = np.concatenate([palm.force, np.cross(palm.position, palm.force)])
    wrench = wrench + np.concatenate([forces.sum(axis=0), np.cross(positions, forces).sum(axis=0)])
    return HandPlan(
        limb=limb,
        wrench=wrench,
        tensions=tensions,
        drives=np.array([drive.torque(tensions), drive.current(tensions), turned]),
        loads=loads,
        forces=forces,
        positions=positions,
        axes=axes,
        engagement=settled.engagement,
        tile_utilisations=np.maximum(used, 0.0),
        tiles=settled.tiles,
        half_planes=pieces,
        palm=palm,
        utilisation=max(0.0, float(space.utilisations(wrist.twist).max())),
        seating=settled.seating,
        closures=settled.closures,
        space=space,
        wrist=wrist,
    )
