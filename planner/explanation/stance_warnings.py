"""Warnings about a stance: idle fingers, joints, the centre of mass, floating wrists."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hand_models.hand import FINGERS, SettledHand
from hand_models.rock import Hold
from planner.explanation.active_limits import TOLERANCES
from planner.prepare import HandBatch, Posture, PreparedStance
from planner.question import Question, Stance
from planner.result import Finding, HandPlan
from planner.scene import findings, link_findings, scene_of, unit_findings

__all__ = [
    "far_wrists",
    "idle_preloads",
    "oddities",
    "scene_findings",
    "strained_preloads",
    "warnings",
]


def oddities(prepared: PreparedStance) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return all findings and warnings about a stance and its question.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.

    Returns
    -------
    findings : tuple of Finding
        Structured findings.
    words : tuple of str
        Sentences of all findings, then further warnings.

    Raises
    ------
    InvalidInputError
        If the stance is invalid; ``field`` is relative to the question.
    """
    question, where = prepared.question, prepared.where
    odd = (*scene_findings(prepared), *unit_findings(question), *_load_findings(question, where))
    words = (
        *(each.message for each in odd),
        *warnings(question.stance, prepared.batch),
        *_off_sentences(where),
        *_joint_sentences(question, where),
        *_unused_sentences(question, prepared.batch),
    )
    return odd, words


def warnings(stance: Stance, batch: HandBatch) -> tuple[str, ...]:
    """Return warnings about the hands and the rock of a stance, one sentence each.

    Idle fingers and palms, tiles stronger than their spines, rock that ends within a finger's
    reach, and odd holds are reported.

    Parameters
    ----------
    stance : Stance
        Poses of the body and of the hands on their holds.
    batch : HandBatch
        Settled hands of the stance, in its order.
    """
    found: list[str] = []
    settled, holding, count = batch.hands, batch.touch.holding, len(FINGERS)
    reach = settled[0].hand.finger.reach
    for h, (place, hand) in enumerate(zip(stance.hands, settled, strict=True)):
        most = hand.surface.strongest_tile
        if most is not None:
            found.append(
                f"{place.limb}: a tile is taken to hold {hand.surface.shear_limit:g} N in shear; "
                f"all its spines break at {most:g} N"
            )
        by_finger = holding[count * h : count * (h + 1)]
        if not all(by_finger) or (place.grasp.palm and not hand.palm.engaged):
            found.extend(f"{place.limb}: {words}" for words in _idle(hand, by_finger))
        end = min(hand.rock_ends)
        if end < reach:
            near, far = _apart(end, reach)
            found.append(
                f"{place.limb}: its rock ends {near} m from the base of a finger, which reaches "
                f"{far} m; the plan may depend on rock that is not given"
            )
    odd: set[Hold] = set()
    for i, place in enumerate(stance.hands):
        words = place.hold.oddities
        if words and place.hold not in odd:
            odd.add(place.hold)
            found.extend(f"hands[{i}].hold.{each}" for each in words)
    return tuple(found)


def _apart(one: float, other: float) -> tuple[str, str]:
    """Return two numbers with as many digits, two or more, as they need to differ."""
    for digits in range(2, 17):
        texts = f"{one:.{digits}g}", f"{other:.{digits}g}"
        if texts[0] != texts[1]:
            break
    return texts


def scene_findings(prepared: PreparedStance) -> tuple[Finding, ...]:
    """Return findings about a stance's geometry, and about its links where the joints are known.

    Raises
    ------
    InvalidInputError
        If the stance is invalid; ``field`` is relative to the question.
    """
    scene, where = scene_of(prepared.question.stance, prepared.batch.hands), prepared.where
    odd = findings(scene)
    return odd if where is None else (*odd, *link_findings(scene, where.angles))


def _unused_sentences(question: Question, batch: HandBatch) -> Iterator[str]:
    """Yield what the question has that no hand of the stance takes."""
    fixed = [hand.wrist == "fixed" for hand in question.stance.hands]
    pressing = zip(fixed, batch.hands, strict=True)
    if question.limits.palm_margin and not any(own and hand.palm.engaged for own, hand in pressing):
        yield (
            "limits.palm_margin: no hand with a fixed wrist has its palm on the rock, so that no "
            "palm has to press; see hold_margin"
        )
    if question.stance.limb_stiffness is not None and all(fixed):
        yield (
            "stance.limb_stiffness: all wrists are fixed, so that nothing depends on it; it is for "
            "compliant and floating wrists"
        )


def _load_findings(question: Question, where: Posture | None) -> tuple[Finding, ...]:
    """Return what is odd about a load where joints are known: limbs weigh more, or it is elsewhere.

    The joints bear the limbs as the robot's file has them, whatever the load is.
    """
    load, robot = question.load, question.stance.robot
    if where is None or question.body_wrench is not None:
        return ()
    found = []
    if load.mass is not None and load.mass < robot.limb_mass:
        message = (
            f"load.mass: {load.mass:.4g} kg are less than the limbs and hands weigh, "
            f"{robot.limb_mass:.4g} of {robot.mass:.4g} kg: the body is taken to weigh "
            f"{load.mass - robot.limb_mass:.4g} kg, and the joints bear the limbs as they are; a "
            "lighter robot takes other masses in its URDF"
        )
        found.append(Finding("mass_below_limbs", "load.mass", message, load.mass, "kg"))
    if load.com is not None:
        com = where.weights.com
        away = float(np.linalg.norm(np.asarray(load.com) - com))
        if away > TOLERANCES.com_offset:
            place = ", ".join(f"{value:z.3f}" for value in com)
            message = (
                f"load.com: it is {away:.2g} m from the posture's centre of mass, ({place}) in B: "
                "all mass is taken where com says, and the joints bear the limbs where they are; "
                "leave com out to weigh the posture, or give a payload"
            )
            found.append(Finding("com_off_posture", "load.com", message, away, "m"))
    return tuple(found)


def _off_sentences(where: Posture | None) -> tuple[str, ...]:
    """Return which hands no joint angles put exactly where they hold, and how near some come."""
    off = {} if where is None else where.off
    return tuple(
        f"{limb}: no joint angles put its hand exactly there; the nearest, which are taken, put it "
        f"{way:.2g} m away and turn it by {turned:.2g} rad"
        for limb, (way, turned) in off.items()
    )


def _joint_sentences(question: Question, where: Posture | None) -> tuple[str, ...]:
    """Return what is taken from the URDF for want of a rating, and which limbs would swing.

    Where joints are not known, how far the centre of mass may be from where it is taken.
    """
    if where is None:
        return _com_sentences(question)
    found, robot, own = [], question.stance.robot, question.limits.joint_torque
    given = robot.limbs if own is not None and not isinstance(own, Mapping) else own or ()
    taken = [limb for limb in robot.limbs if not robot.chains[limb].rated and limb not in given]
    if taken:
        efforts = np.concatenate([robot.chains[limb].torque_limits for limb in taken])
        least, most = float(efforts.min()), float(efforts.max())
        range_ = f"{least:g}" if least == most else f"{least:g} to {most:g}"
        found.append(
            f"{', '.join(taken)}: what the joints bear is the effort of the robot's URDF, {range_} "
            "N·m; torque_limit in the robot's file, or limits.joint_torque, takes its place"
        )
    for limb, loads in where.idle(question.stance).items():
        passive = loads.passive
        for name, torque in zip(passive.names, passive.gravity.tolist(), strict=True):
            if abs(torque) > 1e-3:  # [N·m]; a smaller torque is nothing but the rounding of angles
                found.append(
                    f"{limb}: joint {name} has no motor and does not stay where it is, its limb's "
                    f"weight turns it with {abs(torque):.2g} N·m"
                )
    return tuple(found)


def _com_sentences(question: Question) -> tuple[str, ...]:
    stance = question.stance
    if question.body_wrench is not None or question.load.com is not None:
        return ()
    body, robot = stance.body.inverse(), stance.robot
    hands = {hand.limb: body.apply(hand.pose.position) for hand in stance.hands}
    away = float(np.linalg.norm(robot.com_reaching(hands) - robot.com))
    if away <= TOLERANCES.com_offset:
        return ()
    return (
        f"the joints are not known: the centre of mass is taken where the robot's file has it, and "
        f"may be some {away:.1f} m from there with the hands where they are, which can change a "
        "load factor by half; give stance.joints ('solve' finds them), or load.com",
    )


def _idle(hand: SettledHand, by_finger: Sequence[int]) -> Iterator[str]:
    """Yield what of a hand holds no rock; ``by_finger``: how many tiles and nails hold it."""
    tiles = sum(by_finger)
    bare = {tile.finger for tile in hand.tiles if tile.contact == "frame"}
    without = [name for name, holds in zip(FINGERS, by_finger, strict=True) if not holds]
    pressing = [name for name in without if name in bare]
    idle = [name for name in without if name not in bare]
    if not tiles and not bare and not hand.palm.engaged:
        yield "touches nothing, so it carries nothing"
    elif not tiles and not bare:
        yield "no finger touches rock, only the palm does"
    if pressing:
        yield f"no spine of {', '.join(pressing)} is on rock, bare phalanges press on it"
    if (tiles or bare) and idle and not hand.grasp.fingernail:
        yield f"{', '.join(idle)} {'touch' if len(idle) > 1 else 'touches'} no rock"
    if hand.grasp.fingernail and 0 < tiles < len(FINGERS):
        yield f"{tiles} of {len(FINGERS)} nails hook"
    if hand.grasp.palm and not hand.palm.engaged and tiles:
        yield "no palm tile is within its spines' travel of the rock"


def idle_preloads(prepared: PreparedStance) -> tuple[str, ...]:
    """Return a sentence for each floating hand whose preload lets a tile slip backwards at rest.

    A tile's shear at rest is affine in its tendon's tension. Where the finger's springs push the
    tile away from the finger's base, a least tension is needed to hold the tile. Hands with
    compliant wrists are left out.
    """
    found = []
    hands, wrists = prepared.batch.hands, prepared.hands.wrists
    for limb, hand, wrist in zip(prepared.limbs, hands, wrists, strict=True):
        if wrist is None or wrist.driven:
            continue
        needs, allowances = [], hand.drag_allowances.tolist()
        for t in np.flatnonzero(hand.touching).tolist():
            finger = int(hand.finger_of[t])
            drag = hand.loads[t, 0] + hand.surface.friction * hand.loads[t, 1]
            at_zero, per_newton = (float(value) for value in drag)
            at_zero += allowances[t]
            shear = at_zero + per_newton * float(wrist.hand.preload[finger])
            if shear < -1e-3 and per_newton > 0.0:  # [N] less does not count
                needs.append((-at_zero / per_newton, finger, hand.tiles[t].phalanx))
        if needs:
            need, finger, phalanx = max(needs)
            found.append(
                f"{limb}: tendon_preload of {wrist.hand.preload[finger]:g} N lets the {phalanx} "
                f"tile of {FINGERS[finger]} be dragged backwards at rest; it needs about "
                f"{need:.0f} N"
            )
    return tuple(found)


def strained_preloads(prepared: PreparedStance) -> Iterator[str]:
    """Yield a sentence for each floating hand whose tendon preload alone exceeds a limit.

    Hands with compliant wrists are left out.
    """
    tension_limit = prepared.question.limits.tendon_tension
    for limb, wrist in zip(prepared.limbs, prepared.hands.wrists, strict=True):
        if wrist is None or wrist.driven:
            continue
        most = float(wrist.hand.preload.max())
        if tension_limit is not None and most > tension_limit:
            yield (
                f"{limb}: tendon_preload of {most:g} N is above the limit of {tension_limit:g} N "
                "on tendons"
            )
            continue
        verdict = wrist.evaluate(np.zeros((1, 6)))
        used, row = float(verdict.utilisation[0]), wrist.limits[int(verdict.limiting[0])]
        if used > 1.0 + 1e-6:
            where = " of ".join(part for part in (row.phalanx, row.finger) if part is not None)
            yield (
                f"{limb}: tendon_preload alone takes the hand to utilisation {used:.3g} at rest "
                f"({where or 'hand'}, {row.limit})"
            )


def far_wrists(hands: Sequence[HandPlan]) -> Iterator[str]:
    """Yield warnings about a plan's floating wrists that move or turn too far, or are unstable.

    Beyond 5 mm or 50 mrad the linear step from rest is uncertain; unstable is a wrist whose least
    stiffness is not above zero.

    Parameters
    ----------
    hands : sequence of HandPlan
        Hands of the plan, in the order of the stance.
    """
    for hand in hands:
        if hand.wrist is None:
            continue
        moved = float(np.linalg.norm(hand.wrist.twist[:3]))
        turned = float(np.linalg.norm(hand.wrist.twist[3:]))
        if moved > 5e-3 or turned > 50e-3:  # [m] and [rad]: so far one step from rest is right
            yield (
                f"{hand.limb}: the wrist moves {1e3 * moved:.0f} mm and turns "
                f"{1e3 * turned:.0f} mrad: loads are of one step from rest, contacts may have "
                "changed"
            )
        least = hand.wrist.least_stiffness
        if least is not None and not least > 0.0:
            yield (
                f"{hand.limb}: the wrist does not stay: hand and limb together have a least "
                f"stiffness of {least:.3g} N/m; make limb_stiffness larger"
            )
