"""Tables of structs: what a column shows of a row, and how wide a table is."""

from __future__ import annotations

import io
from types import SimpleNamespace

import click
import pytest
from rich.console import Console

from service.tables import (
    VERBOSITY_KEY,
    console,
    counted,
    in_order,
    name,
    number,
    print_rows,
    text,
)

ROWS = [
    ("front_left", SimpleNamespace(distance=0.2714, between=["body", "rock [of a hand]"])),
    ("front_left", SimpleNamespace(distance=None, between=None)),
    ("rear_left", SimpleNamespace(distance=-1.0, between=["hand", "hand"])),
]
COLUMNS = (
    name("hand", "0"),
    number("mm", "1.distance", ".0f", scale=1e3),
    text("and", "1.between.1"),
)


def printed(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return [line.strip() for line in capsys.readouterr().out.splitlines()]


def test_a_column_shows_what_is_at_the_end_of_its_path_in_its_unit(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_rows(ROWS, COLUMNS, console(), "least distances [mm]", groups=True)
    _, title, _, head, _, first, second, apart, third, *_ = printed(capsys)
    assert title == "least distances [mm]"
    assert head.split() == ["hand", "mm", "and"]
    # words are no markup, and what is not there is a dash
    assert first.split() == ["front_left", "271", "rock", "[of", "a", "hand]"]
    assert second.split() == ["front_left", "-", "-"]
    assert apart == ""
    assert third.split() == ["rear_left", "-1000", "hand"]


def test_a_table_of_numbers_is_narrowed_before_it_is_broken(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    row = ["rear_right", *range(10000, 100000, 10000)]
    print_rows([row], in_order(["hand"], map(str, range(9))), console())
    lines = capsys.readouterr().out.splitlines()
    assert [str(each) for each in row] in [line.split() for line in lines]
    assert max(map(len, lines)) <= 80


def test_a_row_may_be_bold_and_a_table_without_heads(capsys: pytest.CaptureFixture[str]) -> None:
    print_rows([("a", 1)], in_order(["x"], ["y"]), console(), heads=False, style=lambda _: "bold")
    assert [line.split() for line in printed(capsys) if line] == [["a", "1"]]


def test_a_quiet_command_prints_no_table_but_lines_of_a_result() -> None:
    rows, said = [("all hold", 0.5), ("none", None)], io.StringIO()
    out = Console(file=said, width=80)
    columns = (name("simulated", "0"), number("share", "1", ".2f"))
    with click.Context(click.Command("plan")) as context:
        context.meta[VERBOSITY_KEY] = -1
        print_rows(rows, columns, out, "title", legend=["a legend"])
        assert said.getvalue() == ""
        print_rows(rows, columns, out, "title", legend=["a legend"], result=True)
    assert said.getvalue().splitlines() == [
        "simulated all hold, share 0.50",
        "simulated none, share -",
    ]


def test_numbers_of_things_read_well_for_none_and_one():
    said = [counted(count, "body", "bodies") for count in (0, 1, 2, 1200)]
    assert said == ["no bodies", "1 body", "2 bodies", "1,200 bodies"]
    assert [counted(count, "move") for count in (1, 3)] == ["1 move", "3 moves"]


@pytest.mark.parametrize(("width", "whole"), [(28, True), (27, False)])
def test_heads_are_parted_between_words_where_there_is_room(width: int, whole: bool) -> None:
    out = Console(file=io.StringIO(), width=width)
    columns = in_order(["hand"], ["support N", "share %"])
    print_rows([("front_left", 1.0, 2.0)], columns, out)
    lines = out.file.getvalue().splitlines()
    assert any("support" in line for line in lines) is whole
    # no cell is cut, whatever becomes of the heads
    assert any("front_left" in line for line in lines)
