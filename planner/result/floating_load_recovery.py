"""From where a floating hand's wrist goes to what each tile, tendon, motor and palm carries."""

from __future__ import annotations

import numpy as np

from hand_models.compliance import CompliantHand
from hand_models.fixed_wrist import layout_of
from hand_models.hand import SettledHand
from hand_models.tile import inner_half_planes
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare import HandBatch
from planner.result.hand_plan import HandPlan, WristPlan
from planner.result.load_recovery import drawn_tendons
from planner.result.plain_parts import Palm

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
    rows, of_tiles = space.utilisations(wrist.twist), layout_of(settled, sticking=False).plane_tiles
    used = np.zeros(len(loads))
    np.maximum.at(used, of_tiles, rows[: len(of_tiles)])
    known, drive = HandBatch.of((settled,)), settled.hand.drive
    # the winch stands still from the preload on
    at_rest = settled.loads[:, 0, 0] + settled.loads[:, 0, 1] * hand.preload[settled.finger_of]
    drawn = np.add.reduceat(at_rest, known.places.first_of_finger)
    joints, losses, nails = drawn_tendons(known)
    shear, pressing = found.palm[0]
    palm = Palm(
        position=settled.palm.centre,
        force=np.array([-shear, 0.0, pressing]),
        moment=np.zeros(3),
        engaged=settled.palm.engaged,
        utilisation=float((found.palm[0] / known.palm_limits[0]).max()),
    )
    return HandPlan(
        limb=limb,
        wrench=hand.wrenches(found)[0],
        tensions=tensions,
        drives=drive.driven(tensions, (joints, hand.preload, drawn, losses, nails)),
        loads=loads,
        forces=np.einsum("tk,tkx->tx", loads, axes),
        positions=positions,
        axes=axes,
        engagement=settled.engagement,
        limit_shares=settled.limit_shares,
        tile_utilisations=used,
        tiles=settled.tiles,
        half_planes=inner_half_planes(settled.surface),
        palm=palm,
        utilisation=max(0.0, float(rows.max())),
        seating=settled.seating,
        closures=settled.closures,
        space=space,
        wrist=wrist,
    )
