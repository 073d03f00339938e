"""Sentences about a plan: which limit is used most, and why no plan is feasible."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.fixed_wrist import FINGER_TWIST, HAND_LOAD
from hand_models.hand import NAIL
from planner.explanation.active_limits import LimitUse
from planner.explanation.infeasibility import HELD_WRENCH
from planner.prepare import FORCE_CAP, PASSIVE_JOINT, TENSION_CHANGE
from planner.programs import JOINT_FORCE, JOINT_TORQUE, WRENCH_UNIT
from planner.result import Certificate, HandPlan, LimitName

__all__ = [
    "blocking_sentence",
    "constraint_words",
    "limit_sentence",
    "overload_sentence",
    "part_words",
    "shortfall_sentence",
]


class _Words(NamedTuple):
    """Words for a limit, or for a hard row, a cap or a given wrench.

    Attributes
    ----------
    bearer : str
        Part of a finger, a hand or its limb that it is about; by default its tendon or palm.
    does, would_do : str
    manner : str
        How the load of a limit acts.
    barrier : str
        What it forbids or demands; by default more than a limit.
    """

    bearer: str = ""
    does: str = "carries"
    would_do: str = "carry"
    manner: str = ""
    barrier: str = ""


LIMIT_WORDS: Final = {
    "motor_torque": _Words("motor", "gives", "give"),
    "motor_current": _Words("motor", "draws", "draw"),
    "finger_shear": _Words("tiles", "carry", manner=" in shear together"),
    "finger_lateral": _Words("tiles", "carry", manner=" sideways together"),
    "shear": _Words(manner=" in shear"),
    "pull_off": _Words(manner=" toward pull-off"),
    "palm_shear": _Words(manner=" in shear"),
    "palm_pressing": _Words(manner=" in pressing"),
    "nail_shear": _Words(manner=" along its finger"),
    "fingertip_force": _Words(manner=" in pressing"),
    FINGER_TWIST: _Words(manner=" about its phalanx"),
    HAND_LOAD: _Words("the hand", "holds", "hold"),
    FORCE_CAP: _Words("the hand", "exerts", "exert", " allowed", "may exert no more that way"),
    HELD_WRENCH: _Words("the hand", barrier="must exert the wrench that it is given"),
    JOINT_TORQUE: _Words("its joints", "bears", "bear"),
    JOINT_FORCE: _Words("its joints", "bears", "bear"),
    "wrist_range": _Words("the wrist", barrier="goes no farther"),
    "wrist_travel": _Words("the wrist", barrier="settles no farther"),
    "slack_tendon": _Words(barrier="cannot push"),
    "dragged_backwards": _Words(barrier="cannot be dragged away from the finger's base"),
    "joint_stop": _Words(barrier="cannot leave its joint's stop"),
    "frame_pulled": _Words(barrier="rests beside its spines, which cannot pull there"),
    "nail_lifts": _Words(barrier="cannot pull"),
    "nail_slips": _Words(barrier="would slip"),
    "tendon_sticks": _Words(barrier="would stick if it were slackened"),
    "palm_shear_reversed": _Words(barrier="cannot drag the rock along +x of the hand"),
    "palm_pressing_reversed": _Words(barrier="cannot pull"),
    TENSION_CHANGE: _Words(barrier="may not change that much"),
    PASSIVE_JOINT: _Words(barrier="has no motor and bears be torque"),
}


def _words(limit: str) -> _Words:
    return LIMIT_WORDS.get(limit, _Words())


def _bearer(name: LimitName) -> str:
    """Say what a limit is about: ``tile``."""
    if name.limit == "fingertip_force":
        return "fingertip"
    if name.limit == FINGER_TWIST:
        return f"{name.phalanx} joint"
    if name.phalanx is not None:
        return name.phalanx if name.phalanx == NAIL else "tile"
    if name.joint is not None:
        return "joint"
    return _words(name.limit).bearer or ("palm" if name.finger is None else "tendon")


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
    words = _words(limit)
    return words.does if held else f"would {words.would_do}"


def _barrier(limit: str) -> str:
    """Say what a constraint forbids."""
    words = _words(limit)
    return words.barrier or f"cannot {words.would_do} more{words.manner}"


def _spoken_load(limit: str, load: float) -> str:
    if limit == "motor_torque":
        return f"{1e3 * load:.3g} mN·m"
    if limit in (JOINT_TORQUE, FINGER_TWIST):
        return f"{load:.3g} N·m"
    if limit == "motor_current":
        return f"{load:.3g} A"
    return f"{load:.0f} N" if abs(load) >= 10.0 else f"{load:.2g} N"


def limit_sentence(used: LimitUse, hand: HandPlan | None, *, held: bool) -> str:
    """Return a sentence that gives the load and the capacity of a limit.

    For a tile, and for a whole hand, load and capacity are given as forces along the present
    direction, not as distances to the half-plane.

    Parameters
    ----------
    used : LimitUse
        Load and capacity of the limit [N], [N·m] or [A].
    hand : HandPlan or None
        Planned hand that the limit belongs to; None for a limb without a hand.
    held : bool
        Whether the plan is feasible: ``carries``, else ``would carry``.
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
    manner = _words(name.limit).manner
    return f"{_spoken(name)} {_verb(name.limit, held)} {carried} of {most}{manner}"


def constraint_words(name: LimitName) -> str:
    """Return words for a constraint's part and what the part cannot do: ``palm cannot pull``."""
    return f"{_bearer(name)} {_barrier(name.limit)}"


def part_words(name: LimitName) -> str:
    """Return words for the part of a limb that a limit is of: ``distal of inner left``."""
    parts = (name.phalanx, name.finger, name.joint)
    return " of ".join(part.replace("_", " ") for part in parts if part is not None)


def shortfall_sentence(
    certificate: Certificate, touching: bool, *, floating: Collection[str] = ()
) -> str:
    """Return a sentence: which wrench is missing at any utilisation, and which limits block it.

    Parameters
    ----------
    certificate : Certificate
        Proof that the body wrench is infeasible at any utilisation.
    touching : bool
        Whether a spine of any hand is on rock.
    floating : collection of str, optional
        Limbs whose hands' wrists float.
    """
    names = certificate.irreducible
    constraints = blocking_sentence(_blamed(certificate))
    note = ""
    if _floats(certificate, floating):
        note = "; the wrists are where the search for a plan ended"
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
    """Return a clause that says which wrench is missing within the limits; empty without a proof.

    Parameters
    ----------
    certificate : Certificate or None
        Proof that the body wrench is infeasible within a cap on the utilisation.
    floating : collection of str, optional
        Limbs whose hands' wrists float.
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
        sentence += ", with the wrists where this plan puts them"
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
    axes, units = ("fx", "fy", "fz", "mx", "my", "mz"), ("N",) * 3 + ("N·m",) * 3
    size = np.abs(shortfall / WRENCH_UNIT)
    # components of less than 0.3 of the largest are not named
    order = [int(i) for i in np.argsort(-size) if size[i] >= 0.3 * size.max()]
    # three digits, and no exponents
    values = [f"{x:+.0f}" if abs(x) >= 1000.0 else f"{x:+.3g}" for x in shortfall.tolist()]
    return ", ".join(f"{axes[i]} {values[i]} {units[i]}" for i in order)


def blocking_sentence(names: Sequence[LimitName]) -> str:
    """Return words for what the first two of some constraints forbid, and how many follow.

    Parameters
    ----------
    names : sequence of LimitName
        Constraints, the foremost first.
    """
    words: list[str] = []
    for i, name in enumerate(names[:2]):  # the rest are counted
        sentence = f"{_spoken(name)} {_barrier(name.limit)}"
        again = i > 0 and names[i - 1].limb == name.limb
        words.append(sentence.removeprefix(f"{name.limb}: ") if again else sentence)
    more = len(names) - len(words)
    if more:
        words.append(f"and {more} more")
    return ", ".join(words)
