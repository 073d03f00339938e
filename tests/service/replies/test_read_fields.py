"""What is read of a message by itself, as a head or for a table, is a field of the message."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from msgspec import Struct
from msgspec.structs import fields

from planner import DecidingStage, LimitName
from service import replies, requests
from service.bulk import Column, chunks, climb_columns, columns_of, route_columns
from service.bulk.runs import _Reply
from service.climbs.naming import FIELD_OPTIONS
from service.publishing import published_wrenches
from service.recording.replaying import _Asks
from service.ros2 import markers
from service.serving.question import _Head
from service.wire.codec import _Bounded, _Named


def names(*kinds: type[Struct]) -> set[str]:
    return {each.name for kind in kinds for each in fields(kind)}


READ: list[tuple[type[Struct], tuple[type[Struct], ...]]] = [
    (_Head, (requests.PlanRequest,)),
    (_Named, (requests.Query,)),
    (_Bounded, (requests.Query,)),
    (_Asks, (requests.SetPointsRequest,)),
    (published_wrenches._Head, (requests.WrenchRequest,)),
    (published_wrenches._Status, (replies.SetPointsReply,)),
    (chunks._Request, (requests.PlanRequest,)),
    (chunks._Stance, (requests.StanceMessage,)),
    (chunks._Hand, (requests.Hand,)),
    (markers._Request, (requests.PlanRequest,)),
    (markers._Stance, (requests.StanceMessage,)),
    (markers._Hand, (requests.Hand,)),
    (_Reply, (replies.PlanReply, replies.ErrorReply)),
]


@pytest.mark.parametrize(("part", "wholes"), READ)
def test_a_head_has_fields_of_its_message(
    part: type[Struct], wholes: tuple[type[Struct], ...]
) -> None:
    assert names(part) <= names(*wholes)


def test_an_option_of_a_climb_stands_for_a_field_of_its_request() -> None:
    assert FIELD_OPTIONS.keys() <= names(requests.ClimbRequest)


MADE = {"index", "moves", "hardest", "irreducible", "sufficient"}
"""Columns, and heads of their paths, that are made of more than one field."""

PARTS: dict[str | int, tuple[type[Struct], ...]] = {
    "deciding": (DecidingStage,),
    "error": (replies.ErrorDetail,),
    "hardest": (replies.RouteStageReply,),
    "limb": (replies.HandReply, replies.HandSetPoints),
    "limiting": (LimitName,),
    "wrist": (replies.Wrist,),
}
"""Messages that fields hold; "limb" stands for the hand of a limb."""


@pytest.mark.parametrize(
    ("columns", "reply"),
    [
        (columns_of(["limb"], explained=True), replies.PlanReply),
        (route_columns(), replies.RouteReply),
        (climb_columns(), replies.ClimbReply),
    ],
)
def test_a_column_of_a_table_has_a_field_of_its_reply(
    columns: Iterable[Column], reply: type[Struct]
) -> None:
    for column in columns:
        path = list(column.path or (column.name,))
        known = names(reply, replies.ErrorReply) | MADE
        for step in [each for each in path if isinstance(each, str)]:
            assert step in known, column
            known = {"limb"} if step == "hands" else names(*PARTS.get(step, ()))
