"""Check a floating or compliant hand: recompute its loads from the wrist's pose, law by law.

Nothing is shared with the computation of the plan, which settles every finger in closed form and
distinguishes the tendon's regimes. The postures in the plan are compared with the chain of
phalanges and with the rock. Slips are measured along the rock between a tile's contacts before and
after, and the pressure of its spring bed between them is integrated. Stick and slip of the tendon
are solved as one complementarity problem (`FingerTendon.held`), the normals by the balance of the
free joints (`JointBalance.solved`). Lateral loads of tiles and the force of the palm are compared
with their laws (Section 5.3).
"""

from __future__ import annotations

import cmath
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, FingerFrame, SettledHand
from hand_models.tendon import FingerTendon, TendonState, shear_stiffness
from planner.prepare import HandBatch
from planner.result import PlanArrays, WristPlan
from planner.verification.joint_balance import Fingers, JointBalance
from planner.verification.residuals import FINGER_COUNT, TOLERANCES, PartNames, allowed_errors
from planner.verification.rolling_contacts import RestingContact, TileFace

__all__ = ["recompute_floating"]


def moved(place: Array, wrist: WristPlan) -> Array:
    """Return the displacement of a point of the hand under a wrist's twist, shape (3,) [m].

    The rotation counts to second order, as in the model.

    Parameters
    ----------
    place : ndarray, shape (3,)
        Point in H at rest [m].
    wrist : WristPlan
        The twist of the wrist.
    """
    x, y, z = wrist.twist[3:]
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(wrist.twist[:3] + turn @ place + turn @ turn @ place / 2.0)


def recompute_floating(
    found: list[str], names: PartNames, balance: JointBalance, arrays: PlanArrays, wound: Array
) -> tuple[Array, Array, Array]:
    """Recompute the tile loads of floating or compliant hands, and check their postures.

    Parameters
    ----------
    found : list of str
        Error messages so far; further ones are appended.
    names : PartNames
        Names of the hands' parts.
    balance : JointBalance
        Balance of the fingers' joints.
    arrays : PlanArrays
        The plan's numbers.
    wound : ndarray, shape (F,)
        Tensions to which the winches have drawn the tendons [N].

    Returns
    -------
    shear, normal : ndarray, shape (T,)
        Loads of each tile [N]; of nails zero.
    left : ndarray, shape (F, 3)
        Residual of each joint's balance, which a stop must carry, positive if closing [N·m].
    """
    known = names.known
    allowed = allowed_errors(known, arrays).tolist()
    fingers = Fingers(*(part.copy() for part in balance.fingers(wound)))
    # of some only the model knows how far their tiles slip
    unknown: list[int] = []
    for h, wrist in enumerate(arrays.wrists):
        if wrist is not None:
            for i in range(FINGER_COUNT):
                finger = FINGER_COUNT * h + i
                at = f"{names.limbs[h]}: {FINGERS[i]}"
                if not _move(found, at, known, finger, arrays, wrist, wound, fingers, allowed[h]):
                    unknown.append(finger)
            _check_palm(found, names.limbs[h], known.hands[h], arrays.palms[h], wrist, allowed[h])
    normal, left = balance.solved(fingers)
    taken = known.places.phalanges[unknown]
    normal[taken], left[unknown] = arrays.loads[taken, 1], 0.0
    return fingers.shear, normal, left


def _move(
    found: list[str],
    name: str,
    known: HandBatch,
    finger: int,
    arrays: PlanArrays,
    wrist: WristPlan,
    wound: Array,
    fingers: Fingers,
    allowed: float,
) -> bool:
    """Move a finger with its wrist, and check what a plan says of it but for its normals.

    Of ``fingers`` its shears, torques and places become those that it has there. Its loads may be
    off by ``allowed`` [N]. Returns whether it is known how far its tiles slip.
    """
    h, index = divmod(finger, FINGER_COUNT)
    hand = known.hands[h]
    model, rest = hand.fingers[index].model, _resting(hand, index)
    frame, own, tiles = rest.frame, rest.own, known.places.phalanges[finger]
    rows = np.flatnonzero(known.places.finger == finger)
    fingers.points[rows], fingers.axes[rows] = arrays.points[rows], arrays.axes[rows]
    outer = len(own) > len(PHALANGES)
    step = moved(frame.joint, wrist)
    joint = np.array([step @ frame.along, step[2]])
    angles, slips, exact = [], [], True
    parts = zip(tiles, rest.faces, rest.contacts, strict=True)
    for j, (tile, face, contact) in enumerate(parts):
        drag, place = arrays.axes[tile, 0], arrays.points[tile] - frame.joint
        way = np.array([-drag @ frame.along, -drag[2]])
        point = np.array([place @ frame.along, place[2]])
        arm = point - joint
        rise = way[0] * arm[1] - way[1] * arm[0]
        if not abs(rise - face.height) <= 1e-9:  # [m] rounding
            found.append(f"{name}: {PHALANGES[j]} contact is {rise:.6g} m above its joint")
        dragged = complex(way[0], way[1]) * cmath.rect(1.0, -rest.tilts[j])
        angles.append(cmath.phase(dragged))
        fingers.joints[finger, j] = joint
        slip: float | None = 0.0
        if contact is not None:
            slip, off = contact.slip(point, float(arm @ way), way)
            exact &= slip is not None
            if not abs(off) <= TOLERANCES.contact:
                found.append(
                    f"{name}: {PHALANGES[j]} contact is {off:.3g} m from where its tile bears"
                )
        slips.append(slip or 0.0)
        joint = joint + model.joint_spacing * np.array([dragged.real, dragged.imag])
    change = np.array(angles) - rest.angles
    change = change - math.tau * np.round(change / math.tau)
    turns = np.diff(change, prepend=-float(wrist.twist[3:] @ frame.across))
    _check_stretches(found, name, rest, wrist, arrays.loads[rows, 0])
    off = np.abs(_laterals(rest, wrist) - arrays.loads[rows, 2]).max()
    if exact:
        tension, tendon = float(wound[finger]), rest.tendon
        state = TendonState(tension, tension * rest.losses, fingers.shear[rows])
        base = -float(moved(hand.positions[own[0]], wrist) @ frame.along)
        held = (tendon.kept if wrist.driven else tendon.held)(
            state,
            [base, *slips] if outer else slips,
            [0.0, *turns] if outer else turns,
        )
        fingers.shear[rows] = held.shears
        springs = np.array(model.joint_stiffness) * (np.diff(rest.angles, prepend=0.0) + turns)
        torques = held.tensions[-len(PHALANGES) :] * model.pulley_radii
        fingers.torques[finger] = torques - (np.array(model.joint_preload) + springs)
        off = max(off, abs(held.tensions[0] - arrays.tensions[finger]))
    else:
        fingers.shear[rows] = arrays.loads[rows, 0]
    if not off <= allowed:
        found.append(f"{name} does not hold what the plan says")
    return exact


class _RestingFinger(NamedTuple):
    """A finger of a settled hand at rest: what does not change where its wrist goes.

    Attributes
    ----------
    frame : FingerFrame
    own : ndarray of int, shape (n,)
        Its tiles among those of the hand.
    faces : tuple of TileFace
        Face of the tile of each phalanx.
    contacts : tuple of RestingContact or None
        Contact of each tile with the rock; None of one that touches none.
    angles, tilts : ndarray, shape (3,)
        Angle of each phalanx, and of its tile's contact to it [rad].
    tendon : FingerTendon
    losses : ndarray, shape (n,)
        Tension at each tile over that at the motor.
    laterals : ndarray of int
        Which of its tiles resist sideways.
    places : ndarray, shape (len(laterals), 3)
        Positions of these in H [m].
    compliance : ndarray, shape (len(laterals), len(laterals))
        Displacement of these sideways by their loads [m/N].
    """

    frame: FingerFrame
    own: Indices
    faces: tuple[TileFace, ...]
    contacts: tuple[RestingContact | None, ...]
    angles: Array
    tilts: tuple[float, ...]
    tendon: FingerTendon
    losses: Array
    laterals: Indices
    places: Array
    compliance: Array


@lru_cache(maxsize=256)  # the fingers of as many hands as `SETTLED_LIMITS` keeps stances
def _resting(hand: SettledHand, index: int) -> _RestingFinger:
    """Return a finger of a settled hand at rest, by its index among `FINGERS`."""
    settled, model = hand.fingers[index], hand.fingers[index].model
    frame = hand.hand.frames(hand.grasp.outer_rotation)[index]
    own = np.flatnonzero(hand.finger_of == index)
    section = hand.hand.section(FINGERS[index], hand.hold, hand.grasp, hand.seating.pose)
    depths = model.depths(len(own) > len(PHALANGES)) * hand.closing_tension
    faces, contacts = [], list[RestingContact | None]()
    for contact, depth in zip(settled.contacts, depths, strict=True):
        faces.append(face := TileFace.of(contact, model, float(depth)))
        at = np.array(contact.point(model.tile_height))
        if section is None or contact.kind not in ("face", "edge"):
            contacts.append(None)
        else:
            contacts.append(RestingContact.of(section, face, at))
    held = np.flatnonzero(hand.engagement[own])
    held = held if hand.grasp.lateral else held[:0]
    places = hand.positions[own[held]]
    return _RestingFinger(
        frame=frame,
        own=own,
        faces=tuple(faces),
        contacts=tuple(contacts),
        angles=np.array([contact.angle for contact in settled.contacts]),
        tilts=tuple([contact.tilt for contact in settled.contacts]),
        tendon=_tendon(hand, own),
        losses=np.asarray((1.0 - hand.hand.finger.friction) ** np.arange(len(own), dtype=float)),
        laterals=held,
        places=places,
        compliance=_lateral_compliance(hand, frame, own[held], places),
    )


def _tendon(hand: SettledHand, own: Indices) -> FingerTendon:
    table = hand.hand.table
    known = FingerTendon.from_table(table, base_tile=len(own) > len(PHALANGES))
    stiffness = _contact_stiffness(hand, own, known)
    return FingerTendon(
        known.pulley_ratio,
        tuple(stiffness.tolist()),
        known.spring_stiffness,
        known.pulley_radii,
        max(known.friction, hand.hand.tendon_friction),
        known.entry_friction,
    )


def _contact_stiffness(hand: SettledHand, own: Indices, known: FingerTendon) -> Array:
    """Return the contact stiffness of a finger's tiles, by their spines on rock, shape (n,)."""
    springs, strands, of_each = (
        known.spring_stiffness,
        known.pulley_ratio,
        hand.hand.finger.shear_gain,
    )
    gains = np.array((*of_each[: len(own) - len(PHALANGES)], *of_each))
    whole = hand.stiffness_ratio * springs * gains / (strands - gains)
    # a tile whose spines alone gave as these and its spring do would have φ g of shear per newton
    some = hand.engagement[own] * strands * whole / (whole + springs)
    return np.asarray(springs * some / (strands - some))


def _check_stretches(
    found: list[str],
    name: str,
    rest: _RestingFinger,
    wrist: WristPlan,
    shears: Array,
) -> None:
    """Check how far a plan stretches a finger's tiles, by their returned shears (n,) [N]."""
    # the force that would stretch each tile as far as the plan says
    stiffness = np.array(rest.tendon.contact_stiffness)
    held = stiffness > 0.0
    if wrist.stretches is None or not rest.own.max() < len(wrist.stretches):
        found.append(f"{name}: the plan does not say how far its tiles are stretched")
        return
    said = wrist.stretches[rest.own]
    off = np.abs(np.where(held, stiffness * said - np.abs(shears), said)).max()
    if not off <= 1e-9 * max(1.0, float(np.abs(shears).max())):  # [N], of idle tiles [m]: rounding
        found.append(f"{name}: tiles are not stretched by what the plan says")


def _lateral_compliance(
    hand: SettledHand, frame: FingerFrame, tiles: Indices, places: Array
) -> Array:
    """Return how far spines and beam give sideways at each tile's place by the loads of all."""
    body = hand.hand
    out = np.maximum((places - frame.joint) @ frame.along, 0.0)
    high = places[:, 2] - frame.joint[2]
    near, far = np.minimum.outer(out, out), np.maximum.outer(out, out)
    give = np.diag(1.0 / (hand.engagement[tiles] * body.lateral_stiffness))
    give += near**2 * (3.0 * far - near) / (6.0 * body.bending_stiffness)
    give += np.outer(high, high) * near / body.torsional_stiffness
    return np.asarray(give)


def _laterals(rest: _RestingFinger, wrist: WristPlan) -> Array:
    """Return the lateral loads for which spines and beam give what the wrist asks, shape (n,)."""
    found = np.zeros(len(rest.own))
    if len(rest.laterals):
        away = [float(moved(place, wrist) @ rest.frame.across) for place in rest.places]
        found[rest.laterals] = np.linalg.solve(rest.compliance, away)
    return found


def _check_palm(
    found: list[str],
    limb: str,
    hand: SettledHand,
    force: Array,
    wrist: WristPlan,
    allowed: float,
) -> None:
    """Check the force of the palm of a floating hand."""
    if not hand.palm.engaged:
        return
    body, stiffness = hand.hand, 0.0
    for share, engaged in hand.palm.layers:
        stiffness += share * shear_stiffness(
            tuple(body.palm_contact[i] for i in engaged),
            body.palm_spring,
            body.palm_friction,
            body.palm_own_friction,
        )
    step = moved(hand.palm.centre, wrist)

    # the integral of a stiffness that rises from zero to its whole over the onset [m]
    def pressed(travel: float, onset: float) -> float:
        rising, whole = min(max(travel, 0.0), onset), max(travel - onset, 0.0)
        return rising**2 / (2.0 * onset) + whole

    shear = stiffness * pressed(-float(step[0]), 1e-4)
    pressing = sum(
        share * body.palm_pressing_stiffness * pressed(float(step[2]) - max(gap, 0.0), 2e-5)
        for share, gap in zip(
            hand.palm.engagement, np.array(hand.palm.gaps)[list(hand.palm.engaged)], strict=True
        )
    )
    off = np.abs(force - np.array([-shear, 0.0, pressing])).max()
    if not off <= allowed:
        found.append(
            f"{limb}: the palm carries {shear:.6g} and {pressing:.6g} N, not what is planned"
        )
