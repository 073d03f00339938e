"""Numbers of a plan as tables of a page: hands, tiles, tendons, joints, limits that bind."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from planner.explanation import constraint_words, part_words
from planner.pictures import joint_utilisations
from planner.question import Question
from planner.result import LimitName, Plan

__all__ = ["PageTable", "plan_tables", "sample_table"]


class PageTable(NamedTuple):
    """A table that a page's reader can sort.

    Attributes
    ----------
    title : str
        What its rows are.
    columns : str
        Headings with units, with commas between.
    rows : list of list
        A text, a number or None for each column.
    """

    title: str
    columns: str
    rows: list[list[Any]]


def plan_tables(plan: Plan, question: Question) -> list[PageTable]:
    """Return the tables of a plan that have rows.

    Parameters
    ----------
    plan : Plan
        Any status; without loads there are none but the constraints in the way.
    question : Question
        Question that the plan answers.
    """
    hands: list[list[Any]] = []
    tiles: list[list[Any]] = []
    tendons: list[list[Any]] = []
    for hand in plan.hands or ():
        limb = _said(hand.limb)
        hands.append([limb, hand.utilisation, *hand.wrench.tolist(), hand.palm.utilisation])
        for finger in hand.finger_by_finger(model=False):
            name = _said(finger.name)
            drive = finger.motor_torque, finger.motor_current, finger.winch_angle
            tendons.append([limb, name, finger.tendon_tension, *drive])
            for tile in finger.tiles:
                loads = tile.utilisation, tile.shear, tile.normal, tile.lateral
                tiles.append([limb, name, tile.phalanx, tile.contact, *loads])
    proof = plan.certificate
    names = () if proof is None else proof.irreducible or proof.blocking
    prices = [
        [*_owned(each), each.price, f"1/({each.unit})" if "·" in each.unit else f"1/{each.unit}"]
        for each in plan.prices or ()
    ]
    barriers = [[*_owned(each), constraint_words(each)] for each in names]
    wrench = "fx [N],fy [N],fz [N],mx [N·m],my [N·m],mz [N·m]"
    tables = [
        ("Hands: wrench on the rock, in H", f"limb,utilisation,{wrench},palm utilisation", hands),
        (
            "Tiles: load on the rock",
            "limb,finger,phalanx,contact,utilisation,shear [N],normal [N],lateral [N]",
            tiles,
        ),
        (
            "Tendons and their motors",
            "limb,finger,tension [N],torque [N·m],current [A],winch [rad]",
            tendons,
        ),
        (
            "Joints, from the body outward: rad and N·m; prismatic ones m and N",
            "limb,joint,utilisation,angle,torque,limit",
            list(_joints(plan, question)),
        ),
        ("What a unit more of a limit takes off the utilisation", "limb,part,limit,price,unit",
         prices),
        ("In the way of a balance", "limb,part,limit,constraint", barriers),
    ]  # fmt: skip
    return [PageTable(*table) for table in tables if table[2]]


def _joints(plan: Plan, question: Question) -> Iterator[list[Any]]:
    """Yield a row for each joint of a plan whose torques are known."""
    torques, limits = plan.joint_torque, plan.joint_torque_limit
    if plan.joints is None or torques is None or limits is None:
        return
    for limb, used in joint_utilisations(plan, question.stance).items():
        columns = (each.tolist() for each in (used, plan.joints[limb], torques[limb], limits[limb]))
        for i, numbers in enumerate(zip(*columns, strict=True), 1):
            yield [_said(limb), i, *numbers]


def sample_table(plan: Plan) -> PageTable | None:
    """Return how many samples hold, planned anew and with what is done with this plan, if any.

    Parameters
    ----------
    plan : Plan
        With or without a spread.
    """
    spread = plan.spread
    if spread is None:
        return None
    rows: list[list[Any]] = []
    for words, each in spread.answers.items():
        counts = each.holds, spread.draws - each.holds - each.without, each.without
        used = each.utilisation
        rows.append([words, *counts, *((None, None) if used is None else (used.low, used.high))])
    columns = f"tensions,feasible,{spread.failing},no balance,utilisation from,utilisation to"
    return PageTable("Samples of what is not known of hand and rock", columns, rows)


def _owned(name: LimitName) -> list[str]:
    """Return the limb, the part and the name of a limit."""
    return [_said(name.limb), part_words(name), _said(name.limit)]


def _said(name: str) -> str:
    return name.replace("_", " ")
