"""Page of a plan: the robot on the rock, wrench spaces of its hands, tables and advice."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hand_models.base import CruxError
from planner.pages.advice_data import advice_data
from planner.pages.documents import write_document
from planner.pages.plan_rows import plan_tables, sample_table
from planner.pages.scenes import Meshes, scene_data
from planner.pages.wrench_slices import wrench_slice
from planner.pictures import PICTURE_SETTINGS, joint_utilisations
from planner.question import Question
from planner.result import HandPlan, Plan, Quantiles

__all__ = ["shown_plan", "write_plan_page"]


def write_plan_page(
    plan: Plan, question: Question, path: Path, title: str, sure: Sequence[str] = ()
) -> None:
    """Write a plan as a page for a browser: one file, which loads nothing else.

    Parameters
    ----------
    plan : Plan
        Any status; without loads only hands, holds and limbs are drawn.
    question : Question
        Question that the plan answers.
    path : Path
        File of HTML to write.
    title : str
        Title of the page.
    sure : sequence of str, optional
        Sentences that say how sure the plan is.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    meshes = Meshes()
    shown = shown_plan(plan, question, meshes) | {"sure": list(sure)}
    write_document(title, {"stages": [shown], "meshes": meshes.packed, "said": meshes.said}, path)


def shown_plan(
    plan: Plan, question: Question, meshes: Meshes, *, brief: bool = False
) -> dict[str, Any]:
    """Return what a page shows of a plan, as plain data.

    Parameters
    ----------
    plan : Plan
        Any status.
    question : Question
        Question that the plan answers.
    meshes : Meshes
        Meshes of the page, to which those of the plan are added.
    brief : bool, optional
        True to leave out the rock, slices, tables and advice, which take most of the time.
    """
    cap = question.limits.utilisation
    found = {
        "status": plan.status,
        "sentence": plan.reason,
        "tied": _tied(plan, question),
        "utilisation": plan.utilisation,
        "limit": cap,
        "load_factor": plan.load_factor,
        "load_factor_status": plan.load_factor_status,
        "scene": scene_data(plan, question, meshes, rock=not brief),
        "warnings": list(plan.warnings),
    }
    if brief:
        return found
    spread, samples = plan.spread, sample_table(plan)
    return found | {
        "spread": spread
        and {
            "utilisation": _ends(spread.utilisation),
            "load_factor": _ends(spread.load_factor),
        },
        "samples": samples and samples._asdict(),
        "slices": [_slice(hand) for hand in plan.hands or ()],
        "tables": [each._asdict() for each in plan_tables(plan, question)],
        "advice": advice_data(plan, question),
    }


def _ends(quantiles: Quantiles | None) -> list[float] | None:
    """Return the ends of an interval over samples; None without one."""
    return None if quantiles is None else [quantiles.low, quantiles.high]


def _tied(plan: Plan, question: Question) -> str:
    """Return in words which hands, and joints of limbs, tie for the largest utilisation, if any."""
    used = {hand.limb: hand.utilisation for hand in plan.hands or ()}
    bent = {limb: max(each) for limb, each in joint_utilisations(plan, question.stance).items()}
    part = PICTURE_SETTINGS.tie
    least = (1.0 - part) * max([*used.values(), *bent.values()], default=0.0)
    hands, joints = ([limb for limb in each if each[limb] >= least] for each in (used, bent))
    if len(hands) + len(joints) < 2:
        return ""
    counts = {2: "both", 3: "all three", 4: "all four"}
    said = [_listed(hands)] * bool(hands)
    if len(hands) == len(used) > 1:
        said = [f"{counts.get(len(hands), 'all')} hands"]
    if joints:
        said.append(f"joints of {_listed(joints)}")
    return f"{' and '.join(said)} tie for the largest utilisation, within {100.0 * part:g} %"


def _listed(limbs: Sequence[str]) -> str:
    *first, last = (limb.replace("_", " ") for limb in limbs)
    return f"{', '.join(first)} and {last}" if first else last


def _slice(hand: HandPlan) -> dict[str, Any]:
    """Return the slice of a hand's wrench space; without corners if the space has none."""
    found: dict[str, Any] = {"limb": hand.limb, "utilisation": hand.utilisation}
    try:
        held, whole, used = wrench_slice(hand.space, hand.wrench)
    except CruxError:
        return found | {"held": None, "whole": [], "used": hand.wrench[[0, 2]].tolist()}
    corners = None if held is None else held.round(2).tolist()
    return found | {"held": corners, "whole": whole.round(2).tolist(), "used": used.tolist()}
