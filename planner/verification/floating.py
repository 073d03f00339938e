"""Check a floating or compliant hand: recompute its loads from the wrist's pose, law by law.

Nothing is shared with the computation of the plan, which settles every finger in closed form and
distinguishes the tendon's regimes. The postures in the plan are compared with the chain of
phalanges and with the rock. Slips are measured along the rock between a tile's contacts before and
after, and the pressure of its spring bed between them is integrated. Stick and slip of the tendon
are solved as one complementarity problem (`TendonBatch`), the normals by the balance of the
free joints (`JointBalance.solved`). Lateral loads of tiles and the force of the palm are compared
with their laws (Section 5.3).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hand_models.base import SKEW_MATRICES, Array, Indices
from hand_models.finger import PHALANGES, FingerModel
from hand_models.hand import FINGERS, FingerFrame, SettledHand
from hand_models.sections import Complexes, Flags
from hand_models.tendon import FingerTendon, TendonBatch, pad_tiles, shear_stiffness
from planner.result import PlanArrays, WristPlan
from planner.verification.joint_balance import Fingers, JointBalance
from planner.verification.residuals import FINGER_COUNT, TOLERANCES, PartNames, allowed_errors
from planner.verification.rolling_contacts import RestingContact, finger_contacts

__all__ = ["FloatingFingers", "floating_fingers", "recompute_floating"]


def moved(places: Array, twists: Array) -> Array:
    """Return the displacements of n points of k hands under their wrists' twists, (k, n, 3) [m].

    Rotations count to second order, as in the model.

    Parameters
    ----------
    places : ndarray, shape (k, n, 3)
        Points in each H at rest [m].
    twists : ndarray, shape (k, 6)
        Twists of the wrists [m, rad].
    """
    turns = (twists[:, 3:] @ SKEW_MATRICES.reshape(3, 9)).reshape(-1, 3, 3)
    turns = turns + turns @ turns / 2.0
    return np.asarray(twists[:, None, :3] + places @ turns.swapaxes(1, 2))


def recompute_floating(
    found: list[str],
    names: PartNames,
    balance: JointBalance,
    rest: FloatingFingers,
    arrays: PlanArrays,
    wound: Array,
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
    rest : FloatingFingers
        Fingers of the floating and compliant hands.
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
    fingers = Fingers(*(part.copy() for part in balance.fingers(wound)))
    allowed, hands = allowed_errors(known, arrays), rest.which[::FINGER_COUNT] // FINGER_COUNT
    wrong, exact = _move(rest, arrays, wound, fingers, allowed)
    for k, h in enumerate(hands.tolist()):
        for i, name in enumerate(FINGERS):
            texts = wrong.get(FINGER_COUNT * k + i, ())
            found.extend([f"{names.limbs[h]}: {name}{text}" for text in texts])
        wrist = arrays.wrists[h]
        assert wrist is not None
        _check_palm(found, names.limbs[h], known.hands[h], arrays.palms[h], wrist, allowed[h])
    normal, left = balance.solved(fingers)
    # of some only the model knows how far their tiles slip
    unknown = rest.which[~exact]
    taken = known.places.phalanges[unknown]
    normal[taken], left[unknown] = arrays.loads[taken, 1], 0.0
    return fingers.shear, normal, left


def _move(
    rest: FloatingFingers, arrays: PlanArrays, wound: Array, fingers: Fingers, allowed: Array
) -> tuple[dict[int, list[str]], Flags]:
    """Move fingers with their wrists, and check what a plan says of them but for their normals.

    Of ``fingers`` their shears, torques and places become those that they have there. The loads of
    each hand may be off by ``allowed`` [N]. Returns what is wrong with some of the k fingers, and
    of which it is known how far their tiles slip.
    """
    wrong: dict[int, list[str]] = defaultdict(list)
    which, own, rows, columns = rest.which, rest.own, rest.rows, rest.columns
    every, tiles = rows[own], np.take_along_axis(rows, columns, axis=1)
    fingers.points[every], fingers.axes[every] = arrays.points[every], arrays.axes[every]
    twists = np.array([wrist.twist for wrist in arrays.wrists if wrist is not None])
    twists = twists.repeat(FINGER_COUNT, axis=0)
    steps, places = moved(rest.places, twists), arrays.points[tiles] - rest.places[:, :1]
    base = (steps[:, :2] @ rest.planes)[..., 0]
    ways, points = -(arrays.axes[tiles, 0] @ rest.planes)[..., 0], (places @ rest.planes)[..., 0]
    dragged = ways * rest.tilts
    bones = np.column_stack((base[:, 0], rest.model.joint_spacing * dragged[:, :-1]))
    joints = bones.cumsum(axis=1)
    fingers.joints[which] = np.stack((joints.real, joints.imag), axis=2)
    arms, beside = (points - joints) * ways.conj(), (places @ rest.across)[..., 0]
    misplaced = ~(np.abs((arms.imag - rest.heights, beside - rest.besides)) <= 1e-9)  # [m] rounding
    for k, j in np.argwhere(misplaced.any(axis=0)).tolist():
        at = f": {PHALANGES[j]} contact is"
        if misplaced[0, k, j]:
            wrong[k].append(f"{at} {arms.imag[k, j]:.6g} m above its joint")
        if misplaced[1, k, j]:
            wrong[k].append(f"{at} {beside[k, j]:.6g} m beside its finger")
    turns = np.angle(dragged) - rest.angles
    turns -= math.tau * np.round(turns / math.tau)
    turns[:, 1:] -= turns[:, :-1].copy()
    turns[:, 0] += (twists[:, None, 3:] @ rest.across)[:, 0, 0]
    # what is no number is wrong, and moves nothing
    finite = np.isfinite(arms + turns).all(axis=1)
    slips, exact = _slips(rest, wrong, points, arms.real, ways, finite)
    shift, turn = np.zeros((2, *rows.shape))
    shift[:, 0] = -base[:, 1].real
    np.put_along_axis(shift, columns, slips, axis=1)
    np.put_along_axis(turn, columns, turns, axis=1)
    shift[~finite], turn[~finite] = 0.0, 0.0
    tension, loads = wound[which], arrays.loads[rows]
    state = tension, tension[:, None] * rest.losses, np.where(own, fingers.shear[rows], 0.0)
    tensions, shears = rest.tendons.changed(state, shift, turn, 0.0)
    shears[~finite] = np.nan
    fingers.shear[every] = np.where(exact[:, None], shears, loads[..., 0])[own]
    torques = np.take_along_axis(tensions, columns, axis=1) * rest.model.pulley_radii
    torques -= rest.springs + np.array(rest.model.joint_stiffness) * turns
    fingers.torques[which[exact]] = torques[exact]
    _check_stretches(wrong, rest, arrays)
    # the lateral loads for which spines and beam give what the wrist asks
    aside = np.where(rest.resists[..., None], steps[:, 2:] @ rest.across, 0.0)
    aside = np.linalg.solve(rest.compliance, aside)[..., 0]
    off = np.where(own, np.abs(aside - loads[..., 2]), 0.0).max(axis=1)
    tendon = np.where(exact, np.abs(tensions[:, 0] - arrays.tensions[which]), 0.0)
    held = (np.maximum(off, tendon) <= allowed[which // FINGER_COUNT]) & finite
    for k in np.flatnonzero(~held).tolist():
        wrong[k].append(" does not hold what the plan says")
    return wrong, exact


def _slips(
    rest: FloatingFingers,
    wrong: dict[int, list[str]],
    points: Complexes,
    along: Array,
    ways: Complexes,
    finite: Flags,
) -> tuple[Array, Flags]:
    """Return the slip of each tile (k, 3) [m], and of which fingers it is known; check contacts."""
    slips, exact = np.zeros(along.shape), np.ones(len(along), dtype=bool)
    for k in np.flatnonzero(finite).tolist():
        numbers = zip(points[k].tolist(), along[k].tolist(), ways[k].tolist(), strict=True)
        for j, (contact, at) in enumerate(zip(rest.contacts[k], numbers, strict=True)):
            if contact is not None:
                slip, off = contact.slip(*at)
                slips[k, j], exact[k] = slip or 0.0, exact[k] and slip is not None
                if not abs(off) <= TOLERANCES.contact:
                    text = f"{PHALANGES[j]} contact is {off:.3g} m from where its tile bears"
                    wrong[k].append(f": {text}")
    return slips, exact


class FloatingFingers(NamedTuple):
    """The k fingers of settled hands whose wrists give, at rest: what does not change as they do.

    Fingers have up to n tiles; what is of fewer is padded at its end.

    Attributes
    ----------
    which : ndarray of int, shape (k,)
        The fingers, counted through all hands.
    rows : ndarray of int, shape (k, n)
        Their tiles, counted through all hands.
    own : ndarray of bool, shape (k, n)
        Where these are no padding.
    columns : ndarray of int, shape (k, 3)
        Which of them are on the phalanges.
    places : ndarray, shape (k, 2 + n, 3)
        Places of the proximal joint, the first tile, and all tiles in H [m].
    planes : ndarray of complex, shape (k, 3, 1)
        What makes x + i z of the finger's plane from vectors in H.
    across : ndarray, shape (k, 3, 1)
        Unit vector across the plane.
    heights, besides, angles : ndarray, shape (k, 3)
        Height of each contact above its joint, and how far beside the plane it is [m]; angle of
        each phalanx [rad].
    tilts : ndarray of complex, shape (k, 3)
        Turn from the way along each contact to its phalanx.
    contacts : tuple of tuple of RestingContact or None
        Contact of each tile with the rock; None of one that touches none.
    tendons : TendonBatch
    stiffness, losses : ndarray, shape (k, n)
        Stiffness of each tile on the rock [N/m]; tension there over that at the motor.
    resists : ndarray of bool, shape (k, n)
        Which tiles resist sideways.
    compliance : ndarray, shape (k, n, n)
        Displacement of these sideways by their loads [m/N].
    model : FingerModel
    springs : ndarray, shape (k, 3)
        Torque of each joint's spring [N·m].
    tiles_of : tuple of slice
        Tiles of each hand whose wrist gives.
    """

    which: Indices
    rows: Indices
    own: Flags
    columns: Indices
    places: Array
    planes: Complexes
    across: Array
    heights: Array
    besides: Array
    angles: Array
    tilts: Complexes
    contacts: tuple[tuple[RestingContact | None, ...], ...]
    tendons: TendonBatch
    stiffness: Array
    losses: Array
    resists: Flags
    compliance: Array
    model: FingerModel
    springs: Array
    tiles_of: tuple[slice, ...]


def floating_fingers(hands: tuple[SettledHand, ...], driven: Mapping[int, bool]) -> FloatingFingers:
    """Return the fingers of the hands that are ``driven`` or not, by index; true if compliant."""
    starts = np.cumsum([0, *(len(hand.finger_of) for hand in hands)]).tolist()
    giving = list(driven)
    each = [(hands[h], i) for h in giving for i in range(FINGER_COUNT)]
    frames = [hand.hand.frames(hand.grasp.outer_rotation)[i] for hand, i in each]
    owns = [np.flatnonzero(hand.finger_of == i) for hand, i in each]
    faces, contacts = zip(*(finger_contacts(hand, i) for hand, i in each), strict=True)
    tendons = [_tendon(hand, own) for (hand, _), own in zip(each, owns, strict=True)]
    n, model = max(map(len, owns)), hands[0].hand.finger
    rows, resists = np.zeros((len(each), n), dtype=np.intp), np.zeros((len(each), n), dtype=bool)
    places, compliance = np.zeros((len(each), 2 + n, 3)), np.eye(n) * np.ones((len(each), 1, 1))
    for k, ((hand, _), frame, own) in enumerate(zip(each, frames, owns, strict=True)):
        rows[k, : len(own)] = starts[giving[k // FINGER_COUNT]] + own
        places[k, 0], places[k, 1] = frame.joint, hand.positions[own[0]]
        places[k, 2 : 2 + len(own)] = hand.positions[own]
        held = np.flatnonzero(hand.engagement[own]) if hand.grasp.lateral else own[:0]
        resists[k, held] = True
        give = _lateral_compliance(hand, frame, own[held], hand.positions[own[held]])
        compliance[k][np.ix_(held, held)] = give
    counts = np.array(list(map(len, owns)))[:, None]
    settled = [finger.contacts for h in giving for finger in hands[h].fingers]
    angles = np.array([[contact.angle for contact in of_finger] for of_finger in settled])
    tilts = np.array([[contact.tilt for contact in of_finger] for of_finger in settled])
    springs = np.array(model.joint_stiffness) * np.diff(angles, prepend=0.0, axis=1)
    losses = np.array([hand.hand.finger.friction for hand, _ in each])
    return FloatingFingers(
        which=np.concatenate([FINGER_COUNT * h + np.arange(FINGER_COUNT) for h in giving]),
        rows=rows,
        own=np.arange(n) < counts,
        columns=counts - len(PHALANGES) + np.arange(len(PHALANGES)),
        places=places,
        planes=np.array([frame.along + 1j * np.eye(3)[2] for frame in frames])[..., None],
        across=np.array([frame.across for frame in frames])[..., None],
        heights=np.array([[face.height for face in of_finger] for of_finger in faces]),
        besides=np.array([[contact.across for contact in of_finger] for of_finger in settled]),
        angles=angles,
        tilts=np.exp(-1j * tilts),
        contacts=contacts,
        tendons=TendonBatch(tendons, [driven[h] for h in giving for _ in FINGERS]),
        stiffness=pad_tiles([tendon.contact_stiffness for tendon in tendons]),
        losses=(1.0 - losses[:, None]) ** np.arange(n),
        resists=resists,
        compliance=compliance,
        model=model,
        springs=np.array(model.joint_preload) + springs,
        tiles_of=tuple([slice(*starts[h : h + 2]) for h in giving]),
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
    springs, strands = known.spring_stiffness, known.pulley_ratio
    of_each = hand.hand.finger.shear_gain
    gains = np.array((*of_each[: len(own) - len(PHALANGES)], *of_each))
    whole = hand.stiffness_ratio * springs * gains / (strands - gains)
    # a tile whose spines alone gave as these and its spring do would have φ g of shear per newton
    some = hand.engagement[own] * strands * whole / (whole + springs)
    return np.asarray(springs * some / (strands - some))


def _check_stretches(
    wrong: dict[int, list[str]], rest: FloatingFingers, arrays: PlanArrays
) -> None:
    """Check how far a plan stretches the fingers' tiles, by the shears that it returns."""
    said = np.full(len(arrays.loads), np.nan)
    has = np.zeros(len(said), dtype=bool)
    for own, wrist in zip(rest.tiles_of, filter(None, arrays.wrists), strict=True):
        if wrist.stretches is not None:
            given = wrist.stretches[: own.stop - own.start]
            those = slice(own.start, own.start + len(given))
            said[those], has[those] = given, True
    stretches, shears, k = said[rest.rows], np.abs(arrays.loads[rest.rows, 0]), rest.stiffness
    silent = np.any(rest.own & ~has[rest.rows], axis=1)
    # the force that would stretch each tile as far as the plan says
    off = np.abs(np.where(k > 0.0, k * stretches - shears, stretches))
    off, most = (np.where(rest.own, x, 0.0).max(axis=1) for x in (off, shears))
    # [N], of idle tiles [m]: rounding
    for i in np.flatnonzero(~(off <= 1e-9 * np.fmax(1.0, most)) | silent).tolist():
        if silent[i]:
            wrong[i].append(": the plan does not say how far its tiles are stretched")
        else:
            wrong[i].append(": tiles are not stretched by what the plan says")


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
    step = moved(hand.palm.centre[None, None], wrist.twist[None])[0, 0]

    # the integral of a stiffness that rises from zero to its whole over the onset [m]
    def pressed(travel: float, onset: float) -> float:
        rising, whole = min(max(travel, 0.0), onset), max(travel - onset, 0.0)
        return rising**2 / (2.0 * onset) + whole

    shear = stiffness * pressed(-float(step[0]), 1e-4)
    gaps = np.array(hand.palm.gaps)[list(hand.palm.engaged)]
    pressing = sum(
        share * body.palm_pressing_stiffness * pressed(float(step[2]) - max(gap, 0.0), 2e-5)
        for share, gap in zip(hand.palm.engagement, gaps, strict=True)
    )
    off = np.abs(force - np.array([-shear, 0.0, pressing])).max()
    if not off <= allowed:
        found.append(
            f"{limb}: the palm carries {shear:.6g} and {pressing:.6g} N, not what is planned"
        )
