"""Options that are declared as the defaults of a command's parameters."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import click
import pytest

from service.commands.declaring import argument, command, flag, group, option


class Place(NamedTuple):
    x: float
    y: float


def run(made: click.Command, *given: str) -> object:
    return made.main(list(given), standalone_mode=False)


def test_a_parameter_names_its_flag_and_its_default_is_shown():
    @command("go")
    def go(
        where: str = argument(),
        top_speed: float = option("Of the robot [m/s].", default=0.5),
        slowly: bool = flag("Take time."),
    ) -> tuple[object, ...]:
        """Go somewhere."""
        return where, top_speed, slowly

    assert run(go, "home") == ("home", 0.5, False)
    assert run(go, "--top-speed", "2", "--slowly", "home") == ("home", 2.0, True)
    page = go.get_help(click.Context(go, info_name="go"))
    assert "Go somewhere." in page
    assert "[default: 0.5]" in page
    assert page.index("--top-speed") < page.index("--slowly")


def test_a_usage_has_flags_and_the_word_for_the_value():
    @command("go")
    def go(times: int = option("How often.", int, usage="-n --count N", default=1)) -> int:
        return times

    assert run(go, "-n", "3") == run(go, "--count", "3") == 3
    (times,) = go.params
    assert (times.opts, times.metavar) == (["-n", "--count"], "N")
    with pytest.raises(click.NoSuchOption):
        run(go, "--times", "3")


def test_options_of_a_group_become_one_value_where_the_group_stands():
    @command("go")
    def go(
        first: bool = flag("First."),
        place: Place = group(Place, x=option("Across.", float), y=option("Up.", default=1.0)),
        last: bool = flag("Last."),
    ) -> Place:
        return place

    assert run(go, "--x", "2", "--last") == Place(2.0, 1.0)
    assert [each.name for each in go.params] == ["first", "x", "y", "last"]


def test_a_command_of_a_group_runs_within_its_context_manager():
    seen = []

    @contextmanager
    def noted(context: click.Context) -> Iterator[None]:
        seen.append(context.info_name)
        yield
        seen.append("end")

    robots = click.Group("robots")

    @command("go", of=robots, within=noted)
    def go(tag: str = option("Name.", default="a")) -> None:
        seen.append(tag)

    run(robots, "go", "--tag", "b")
    assert seen == ["go", "b", "end"]
