"""What a plan's numbers mean, in sentences that a climber understands."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.fixed_wrist import HAND_LOAD
from hand_models.hand import FINGERS, NAIL, SettledHand
from planner.explanation.active_limits import LimitUse
from planner.explanation.infeasibility import HELD_WRENCH
from planner.prepare import FORCE_CAP, PASSIVE_JOINT, TENSION_CHANGE, HandBatch, Posture
from planner.programs import JOINT_FORCE, JOINT_TORQUE, WRENCH_UNIT
from planner.question import Question, Stance
from planner.result import Certificate, HandPlan, LimitName

__all__ = [
    "LEAST_FACTOR",
    "NO_FACTOR",
    "UNPROVEN",
    "blocking_sentence",
    "constraint_words",
    "joint_sentences",
    "limit_sentence",
    "off_sentences",
    "overload_sentence",
    "shortfall_sentence",
    "warnings",
]

NOTABLE: Final = 0.3
"""Components of what is missing are told from this part of the largest on."""

OFF_CENTRE: Final = 0.05
"""Distance of the centre of mass from where it is taken, from which on that is a warning [m]: on a
vertical wall 0.12 m changed the load factor of four hands by a sixth."""

SWINGS: Final = 1e-3
"""Torque from which on a joint without a motor is said to move [N·m]: a smaller one is nothing but
the rounding of angles."""

FOREMOST: Final = 2
"""So many of the constraints that leave no loads are told; the rest are counted."""

MANNERS: Final = {
    "shear": " in shear",
    "pull_off": " toward pull-off",
    "palm_shear": " in shear",
    "palm_pressing": " in pressing",
    "finger_shear": " in shear together",
    "finger_lateral": " sideways together",
    "nail_shear": " along its finger",
    "fingertip_force": " in pressing",
    FORCE_CAP: " allowed",
}
"""How a limit is loaded."""

BEARERS: Final = {
    "motor_torque": "motor",
    "motor_current": "motor",
    "finger_shear": "tiles",
    "finger_lateral": "tiles",
}
"""What of a finger a limit is about; its tendon by default."""

WHOLES: Final = {
    HAND_LOAD: "the hand",
    FORCE_CAP: "the hand",
    HELD_WRENCH: "the hand",
    JOINT_TORQUE: "its joints",
    JOINT_FORCE: "its joints",
    "wrist_range": "the wrist",
}
"""What of a hand or its limb a limit is about; its palm by default."""

AXES: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""Components of a body wrench."""

VERBS: Final = {
    "motor_torque": ("gives", "give"),
    "motor_current": ("draws", "draw"),
    "finger_shear": ("carry", "carry"),
    "finger_lateral": ("carry", "carry"),
    HAND_LOAD: ("holds", "hold"),
    FORCE_CAP: ("exerts", "exert"),
    JOINT_TORQUE: ("bears", "bear"),
    JOINT_FORCE: ("bears", "bear"),
}
"""What is done to a limit: it does, it would do; `CARRIES` by default."""

CARRIES: Final = ("carries", "carry")

BARRIERS: Final = {
    "slack_tendon": "cannot push",
    "dragged_backwards": "cannot be dragged away from the finger's base",
    "joint_stop": "cannot leave its joint's stop",
    "frame_pulled": "rests beside its spines, which cannot pull there",
    "nail_lifts": "cannot pull",
    "nail_slips": "would slip",
    "tendon_sticks": "would stick if it were slackened",
    "palm_shear_reversed": "cannot drag the rock along +x of the hand",
    "palm_pressing_reversed": "cannot pull",
    "wrist_range": "goes no farther",
    FORCE_CAP: "may exert no more that way",
    TENSION_CHANGE: "may not change that much",
    PASSIVE_JOINT: "has no motor and bears no torque",
    HELD_WRENCH: "must exert the wrench that it is given",
}
"""What a hard row or a cap forbids, or a given wrench demands."""


UNPROVEN: Final = (
    "the floating wrists are where their hands' stiffness jumps or the search ended: the loads are "
    "exact, but that no other pose uses less is not proven"
)
"""Of a plan that its search could not prove to be the least."""


LEAST_FACTOR: Final = (
    "the load factor is a lower bound: beyond it no plan was found, nor proven away"
)
"""Of a load factor that a search ends which found no plan, not a limit."""

NO_FACTOR: Final = "no load factor was found; with floating wrists that is no proof of none"
"""Of a question for it that ends without one."""


def _bearer(name: LimitName) -> str:
    """Say what a limit is about: ``tile``."""
    if name.limit == "fingertip_force":
        return "fingertip"
    if name.phalanx is not None:
        return name.phalanx if name.phalanx == NAIL else "tile"
    if name.joint is not None:
        return "joint"
    if name.finger is not None:
        return BEARERS.get(name.limit, "tendon")
    return WHOLES.get(name.limit, "palm")


def _spoken(name: LimitName) -> str:
    """Say whose limit it is: ``front_left: proximal tile of inner_right``."""
    bearer = _bearer(name)
    if bearer == "tile":
        bearer = f"{name.phalanx} tile"
    if bearer == "joint":
        bearer = f"joint {name.joint}"
    return f"{name.limb}: {bearer}" + ("" if name.finger is None else f" of {name.finger}")


def _verb(limit: str, held: bool) -> str:
    """Say what is done to a limit, or would be."""
    does, would_do = VERBS.get(limit, CARRIES)
    return does if held else f"would {would_do}"


def _barrier(limit: str) -> str:
    """Say what a constraint forbids."""
    if limit in BARRIERS:
        return BARRIERS[limit]
    return f"cannot {VERBS.get(limit, CARRIES)[1]} more{MANNERS.get(limit, '')}"


def _spoken_load(limit: str, load: float) -> str:
    if limit == "motor_torque":
        return f"{1e3 * load:.3g} mN·m"
    if limit == JOINT_TORQUE:
        return f"{load:.3g} N·m"
    if limit == "motor_current":
        return f"{load:.3g} A"
    return f"{load:.0f} N" if abs(load) >= 10.0 else f"{load:.2g} N"


def limit_sentence(used: LimitUse, hand: HandPlan | None, *, held: bool) -> str:
    """Say how much of a limit is used.

    A tile's force is told with what the tile would hold in that direction, not with the distances
    to its half-plane; the force that a hand holds likewise.

    Parameters
    ----------
    used : LimitUse
        Load and capacity of its row [N], [N·m] or [A].
    hand : HandPlan or None
        Whose limit it is; None for a limb without a hand.
    held : bool
        Whether the plan is within its limits.
    """
    name, load, capacity = used
    force = 0.0
    if name.limit == HAND_LOAD and hand is not None:
        fx, fy, fz = hand.wrench[:3]
        force = math.hypot(fx, fy, min(fz, 0.0))
    elif name.limit in ("shear", "pull_off") and hand is not None:
        shear, normal, lateral = hand.loads[hand.tile(name.finger, name.phalanx)].tolist()
        force = math.hypot(shear, normal if name.limit == "pull_off" else 0.0, lateral)
    if force > 0.0 and load > 0.0:
        load, capacity = force, force * capacity / load
    carried, most = (_spoken_load(name.limit, value) for value in (load, capacity))
    if carried == most and not held:
        # so near that only further digits tell
        carried = f"{_spoken_load(name.limit, capacity)} and a little more"
    manner = MANNERS.get(name.limit, "")
    return f"{_spoken(name)} {_verb(name.limit, held)} {carried} of {most}{manner}"


def constraint_words(name: LimitName) -> str:
    """Say what a constraint is about and what it forbids: ``palm cannot pull``."""
    return f"{_bearer(name)} {_barrier(name.limit)}"


def shortfall_sentence(
    certificate: Certificate, touching: bool, *, floating: Collection[str] = ()
) -> str:
    """Say what no plan can supply, and what is in the way.

    Parameters
    ----------
    certificate : Certificate
        Of a body wrench that cannot be had at any utilisation.
    touching : bool
        Whether a spine of any hand is on rock.
    floating : collection of str, optional
        Limbs whose hands float.
    """
    names = certificate.irreducible
    constraints = blocking_sentence(_blamed(certificate))
    note = ""
    if _floats(certificate, floating):
        note = "; floating hands as they give way where the search for a plan ended"
    if not certificate.direction.any():
        return f"no loads at any utilisation, whatever the body needs: {constraints}{note}"
    sentence = "no loads balance the body at any utilisation"
    if certificate.shortfall is not None:
        sentence += f": missing {_missing(certificate.shortfall)} (in B)"
    if not touching:
        return f"{sentence}; no spine of any hand is on rock"
    if names == ():
        return f"{sentence}; these hands have no loads at all, of any sign, that give it{note}"
    return (f"{sentence}; {constraints}" if constraints else sentence) + note


def overload_sentence(certificate: Certificate | None, *, floating: Collection[str] = ()) -> str:
    """Say what would be missing within the limits; nothing without a proof of it.

    Parameters
    ----------
    certificate : Certificate or None
        Of a body wrench that cannot be had within a cap on the utilisation.
    floating : collection of str, optional
        Limbs whose hands float.
    """
    if certificate is None:
        return ""
    if not certificate.spaces:
        return "; it holds nothing on, so no plan changes that"
    if not certificate.direction.any():
        constraints = blocking_sentence(_blamed(certificate))
        sentence = f"; whatever the body needs, no loads keep within all limits: {constraints}"
    elif certificate.shortfall is None:
        sentence = f"; no loads keep within all limits: {blocking_sentence(_blamed(certificate))}"
    else:
        cap = certificate.utilisation
        within = "within the limits" if cap == 1.0 else f"up to a utilisation of {cap:g}"
        sentence = f"; {within} {_missing(certificate.shortfall)} (in B) would be missing"
    if _floats(certificate, floating):
        sentence += ", with floating hands as they give way at this plan"
    return sentence


def _blamed(certificate: Certificate) -> tuple[LimitName, ...]:
    """Return what a certificate puts the blame on."""
    return certificate.irreducible or certificate.blocking


def _floats(certificate: Certificate, floating: Collection[str]) -> bool:
    """Whether a floating hand is to blame: one that is named, or any where nothing is."""
    if certificate.irreducible == ():
        return not certificate.spaces.keys().isdisjoint(floating)
    return any(name.limb in floating for name in _blamed(certificate))


def _missing(shortfall: Array) -> str:
    """Name the components of what is missing that matter, the largest first."""
    units = ("N",) * 3 + ("N·m",) * 3
    size = np.abs(shortfall / WRENCH_UNIT)
    order = [int(i) for i in np.argsort(-size) if size[i] >= NOTABLE * size.max()]
    # three digits, and no exponents
    values = [f"{x:+.0f}" if abs(x) >= 1000.0 else f"{x:+.3g}" for x in shortfall.tolist()]
    return ", ".join(f"{AXES[i]} {values[i]} {units[i]}" for i in order)


def blocking_sentence(names: Sequence[LimitName]) -> str:
    """Say what is in the way, the foremost first; a limb's name once in a row."""
    told: list[str] = []
    for i, name in enumerate(names[:FOREMOST]):
        sentence = f"{_spoken(name)} {_barrier(name.limit)}"
        again = i > 0 and names[i - 1].limb == name.limb
        told.append(sentence.removeprefix(f"{name.limb}: ") if again else sentence)
    more = len(names) - len(told)
    if more:
        told.append(f"and {more} more")
    return ", ".join(told)


def warnings(stance: Stance, batch: HandBatch) -> tuple[str, ...]:
    """Return what is odd about the hands and rock of a stance that is planned all the same."""
    found: list[str] = []
    settled, holding, count = batch.hands, batch.touch.holding, len(FINGERS)
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
        end, reach = min(hand.rock_ends), hand.hand.finger.reach
        if end < reach:
            found.append(
                f"{place.limb}: its rock ends {end:.2g} m from the base of a finger, which reaches "
                f"{reach:.2g} m; the plan may depend on rock that is not given"
            )
    first = {place.hold: i for i, place in reversed([*enumerate(stance.hands)])}
    for i in sorted(first.values()):
        found.extend(f"hands[{i}].hold.{words}" for words in stance.hands[i].hold.oddities)
    return tuple(found)


def off_sentences(where: Posture | None) -> tuple[str, ...]:
    """Return which hands no joint angles put exactly where they hold, and how near some come."""
    off = {} if where is None else where.off
    return tuple(
        f"{limb}: no joint angles put its hand exactly there; the nearest, which are taken, put it "
        f"{way:.2g} m away and turn it by {turned:.2g} rad"
        for limb, (way, turned) in off.items()
    )


def joint_sentences(question: Question, where: Posture | None) -> tuple[str, ...]:
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
            if abs(torque) > SWINGS:
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
    if away <= OFF_CENTRE:
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
