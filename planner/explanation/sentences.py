"""Say what a plan's numbers mean, in sentences that a climber understands."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np

from hand_models.base import Array
from hand_models.fixed_wrist import HAND_LOAD
from hand_models.hand import NAIL
from planner.explanation.active_limits import LimitUse
from planner.explanation.infeasibility import HELD_WRENCH
from planner.prepare import FORCE_CAP, PASSIVE_JOINT, TENSION_CHANGE
from planner.programs import JOINT_FORCE, JOINT_TORQUE, WRENCH_UNIT
from planner.result import Certificate, HandPlan, LimitName

__all__ = [
    "LEAST_FACTOR",
    "NO_FACTOR",
    "UNPROVEN",
    "blocking_sentence",
    "constraint_words",
    "limit_sentence",
    "overload_sentence",
    "shortfall_sentence",
]

NOTABLE: Final = 0.3
"""Least component of a missing wrench that is named, relative to the largest."""

FOREMOST: Final = 2
"""Number of constraints in the way that are named; the rest are counted."""

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
"""Words for the load of a limit."""

BEARERS: Final = {
    "motor_torque": "motor",
    "motor_current": "motor",
    "finger_shear": "tiles",
    "finger_lateral": "tiles",
}
"""Part of a finger that a limit is about; its tendon by default."""

WHOLES: Final = {
    HAND_LOAD: "the hand",
    FORCE_CAP: "the hand",
    HELD_WRENCH: "the hand",
    JOINT_TORQUE: "its joints",
    JOINT_FORCE: "its joints",
    "wrist_range": "the wrist",
}
"""Part of a hand or its limb that a limit is about; its palm by default."""

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
"""Verbs of a limit: it does, it would do; `CARRIES` by default."""

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
"""Words for what a hard row or a cap forbids, or a given wrench demands."""


UNPROVEN: Final = (
    "the loads are exact, but the utilisation is not proven minimal: at these poses of the "
    "floating wrists the stiffness jumps, or the search ended"
)
"""Warning for a plan that its search could not prove to be the least."""


LEAST_FACTOR: Final = (
    "the load factor is a lower bound: beyond it no plan was found, nor proven infeasible"
)
"""Warning for a load factor whose search ended for want of a plan, not at a limit."""

NO_FACTOR: Final = "no load factor found; with floating wrists there may be one all the same"
"""Warning for a search that ends without a load factor."""


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

    A tile's force is given with the force that the tile would hold in that direction, not with the
    distances to its half-plane; the force of a hand likewise.

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
        # so near that only further digits differ
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


def _blamed(certificate: Certificate) -> Sequence[LimitName]:
    """Return what a certificate puts the blame on."""
    return certificate.irreducible or certificate.blocking


def _floats(certificate: Certificate, floating: Collection[str]) -> bool:
    """Return whether a floating hand is to blame: one that is named, or any where nothing is."""
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
    words: list[str] = []
    for i, name in enumerate(names[:FOREMOST]):
        sentence = f"{_spoken(name)} {_barrier(name.limit)}"
        again = i > 0 and names[i - 1].limb == name.limb
        words.append(sentence.removeprefix(f"{name.limb}: ") if again else sentence)
    more = len(names) - len(words)
    if more:
        words.append(f"and {more} more")
    return ", ".join(words)
