"""Advice as a page shows it: the change in words, drawn, and in numbers before and after."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hand_models.base import CruxError
from planner import solving
from planner.advice import changed
from planner.climbs import FoundClimb
from planner.pages.plan_rows import PageTable
from planner.pictures import DrawnScene, drawn_scene
from planner.question import Question
from planner.result import Advice, HandPlan, Plan

__all__ = ["advice_data", "raise_data"]


def advice_data(plan: Plan, question: Question) -> list[dict[str, Any]] | None:
    """Return the advice of a plan, as plain data; None if no advice was asked for.

    Parameters
    ----------
    plan : Plan
        With or without advice.
    question : Question
        Question that the plan answers.

    Returns
    -------
    list of dict of str to object, or None
        ``sentence``, ``utilisation`` and ``holds`` of each `Advice`; ``moves``: corners of palms
        and the origin of B ``from`` and ``to``, in W [m], each with its ``text``; ``limbs``: the
        limbs' joints after it; ``table``: tensions and utilisations before and after. The last
        three are missing where the changed question cannot be planned again.
    """
    if plan.advice is None:
        return None
    return [
        {"sentence": each.sentence, "utilisation": each.utilisation, "holds": each.holds}
        | _changed(plan, question, each)
        for each in plan.advice
    ]


def raise_data(plan: Plan, question: Question, found: FoundClimb) -> list[dict[str, Any]]:
    """Return what raises the load factor of the stage that decides a climb, as advice.

    Changes of which no plan has a larger load factor are left out: that of another placement is
    known without limits of joint torques.

    Parameters
    ----------
    plan : Plan
        Of the stage.
    question : Question
        Of the stage.
    found : FoundClimb
        Whose changes of the stage are planned.

    Returns
    -------
    list of dict of str to object
        As of `advice_data`, the largest load factor first.
    """
    shown = list[tuple[float, dict[str, Any]]]()
    for change, after in zip(found.raises, found.raised, strict=True):
        try:
            planned = solving.plan(replace(after, deadline=None, explain=False))
            more = _difference(plan, question, planned, after)
        except CruxError:
            continue
        factor, used = planned.load_factor, planned.utilisation
        if factor is not None and used is not None and factor > (plan.load_factor or 0.0):
            words = f"load factor {factor:.3f} in this stage with {change.change}"
            holds = used <= question.limits.utilisation
            shown.append((factor, {"sentence": words, "utilisation": used, "holds": holds} | more))
    return [each for _, each in sorted(shown, key=lambda each: -each[0])]


def _changed(plan: Plan, question: Question, advice: Advice) -> dict[str, Any]:
    """Return what an advice changes, from a plan of the changed question; nothing without one."""
    plain = replace(question, want=frozenset(), deadline=None, open_loop=None, explain=False)
    try:
        after = changed(plain, advice.changes)
        return _difference(plan, question, solving.plan(after), after)
    except CruxError:
        return {}


def _difference(plan: Plan, question: Question, planned: Plan, after: Question) -> dict[str, Any]:
    """Return what is otherwise in a plan of a changed question."""
    scenes = [drawn_scene(*each, 2, rock=False) for each in ((plan, question), (planned, after))]
    old, new = ({hand.limb: hand for hand in each.hands or ()} for each in (plan, planned))
    places = [_places(scene) for scene in scenes]
    moves = []
    for limb in dict.fromkeys([*places[0], *places[1]]):
        start, end = (each.get(limb) for each in places)
        if start != end or limb != "B":
            used = (_said(hands.get(limb)) for hands in (old, new))
            words = "B" if limb == "B" else f"{limb.replace('_', ' ')} {' → '.join(used)}"
            moves.append({"from": start, "to": end, "text": words})
    tensions = [
        {(limb, f): tension for limb, hand in hands.items() for f, tension in _tensions(hand)}
        for hands in (old, new)
    ]
    rows = [
        [
            limb.replace("_", " "),
            finger.replace("_", " "),
            *(each.get((limb, finger)) for each in tensions),
            *(hands[limb].utilisation if limb in hands else None for hands in (old, new)),
        ]
        for limb, finger in dict.fromkeys([*tensions[0], *tensions[1]])
    ]
    columns = "limb,finger,tension before [N],tension after [N]"
    columns += ",utilisation of the hand before,utilisation of the hand after"
    limbs = [line.points.round(4).tolist() for line in scenes[1].lines if line.kind == "limb"]
    table = PageTable("Before and after the advice that is drawn", columns, rows)
    return {"moves": moves, "limbs": limbs, "table": table._asdict()}


def _places(scene: DrawnScene) -> dict[str, list[list[float]]]:
    """Return the corners of the palms, and as B the origin of the body, in W [m]."""
    palms = {each.name: each.vertices for each in scene.surfaces if each.kind == "palm"}
    return {
        name: np.round(at, 4).tolist() for name, at in (palms | {"B": scene.origin[None]}).items()
    }


def _tensions(hand: HandPlan) -> list[tuple[str, float]]:
    found = hand.finger_by_finger(model=False)
    return [(finger.name, finger.tendon_tension) for finger in found]


def _said(hand: HandPlan | None) -> str:
    return "–" if hand is None else f"{hand.utilisation:.2f}"
