"""A command that plans a stance over varied fields."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import click
from click.core import ParameterSource

from hand_models.base import InvalidInputError
from service.commands.batch import answer_rest, writing_answers
from service.commands.options import (
    FiniteRange,
    asked,
    dask_option,
    folder_option,
    hand_option,
    json_option,
    robot_option,
    stance_argument,
    workers_option,
)
from service.commands.stances import read_request
from service.processes import Interrupted
from service.sweeping import TOLERANCE
from service.tables import (
    BAD_INPUT,
    DONE,
    FAILED,
    filling_folder,
    note,
    say,
    verbosity,
    write_alone,
)

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable
    from planner import RobotFile
    from service.sweeping import Design, PointRows, Sweep

__all__ = ["sweep"]

TABLE: Final = "sweep.csv"
PICTURE: Final = "sweep.png"


@click.command()
@stance_argument
@click.option(
    "--vary",
    "variations",
    multiple=True,
    required=True,
    metavar="PATH=VALUES",
    help="A field of the request and its values: LOW:HIGH:COUNT, or a,b,c of numbers or words. "
    "Once for each field.",
)
@click.option(
    "--samples",
    type=click.IntRange(min=1),
    help="Points of a Latin hypercube over the ranges, in place of the grid of all values.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Of the samples; by default 0.")
@click.option(
    "--over",
    metavar="PATH,PATH",
    help="Which two fields the picture is over, across and up, where more than two vary.",
)
@click.option(
    "--tolerance",
    type=FiniteRange(1e-9, 0.5),
    default=TOLERANCE,
    show_default=True,
    help="Of where it stops holding, if one number varies: a share of the range.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on where this sweep was broken off: points that the table of DIR has are kept.",
)
@workers_option
@dask_option
@folder_option("Where the table and the picture go.")
@hand_option
@robot_option
@json_option
def sweep(
    stance: str,
    variations: tuple[str, ...],
    samples: int | None,
    seed: int | None,
    over: str | None,
    tolerance: float,
    resume: bool,
    workers: int | None,
    dask: str | None,
    folder: Path,
    hand: ParameterTable | None,
    robot: RobotFile | None,
    as_json: bool,
) -> int:
    """Plan a stance over varied fields: a table, a picture, and where it stops holding.

    A PATH has the names of the request with dots between them, as load.mass, gravity.2 or
    hands.front_left.surface.shear_limit; hands are named by their limbs, entries of lists by their
    index, and * is all of them. Nothing is explained, and what else a request wants is left out.
    The table grows as points are answered; one that is broken off goes on with --resume.

    Exit status: 0 whatever holds, 2 bad input, also where no point can be answered for it, 1 where
    a point failed or was lost.
    """
    from service.answering import robots_of
    from service.bulk import new_header
    from service.sweeping import (
        Design,
        PointRows,
        Variation,
        about,
        columns_of,
        has_borders,
        plot_sweep,
    )
    from service.tables import console, print_sweep

    if seed is not None and samples is None:
        raise InvalidInputError("is of samples: give --samples, too", field="--seed")
    request = asked(read_request(stance), hand, robot)
    try:
        chosen = [Variation.parse(each, sampled=samples is not None) for each in variations]
        design = Design.of(request, chosen, samples, seed or 0, robots_of(robot))
    except InvalidInputError as error:
        where = "--vary" if error.field is None else f"--vary {error.field}"
        raise InvalidInputError(error.message, field=where) from None
    given = click.get_current_context().get_parameter_source("tolerance")
    if given is ParameterSource.COMMANDLINE and not has_borders(design):
        raise InvalidInputError("is of one number that varies alone", field="--tolerance")
    pair = _pair(over, design)
    with filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
    files = {"table": folder / TABLE, "picture": folder / PICTURE}
    write_alone(files["table"], folder)
    with writing_answers(files["table"]):
        what = about(request, design, seed or 0)
        header = new_header(columns_of(design), False, hand, robot, what)
        sink = PointRows(design, files["table"], header, resume)
    result = _answered(design, sink, files["table"], stance, workers, dask, robot, tolerance)
    with filling_folder():
        plot_sweep(result, files["picture"], Path(stance).stem, pair)
    if as_json:
        say(result.summary() | {"files": {name: str(file) for name, file in files.items()}})
    else:
        out = console()
        if verbosity() >= 0:
            print_sweep(result, out)
        for name, file in files.items():
            out.print(f"{name}: {file}", markup=False, soft_wrap=True)
    return _status(result)


def _pair(over: str | None, design: Design) -> tuple[str, str] | None:
    """Return the paths that the picture is over, checked before anything is planned."""
    if over is None:
        return None
    paths = [each.path for each in design.variations]
    first, _, second = over.partition(",")
    if first == second or not {first, second} <= {*paths}:
        raise InvalidInputError(
            f"two different ones of {', '.join(paths)} are wanted, got {over}", field="--over"
        )
    return first, second


def _answered(
    design: Design,
    sink: PointRows,
    table: Path,
    stance: str,
    workers: int | None,
    dask: str | None,
    robot: RobotFile | None,
    tolerance: float,
) -> Sweep:
    """Return the sweep: of points that the table does not have yet, and of its borders."""
    from service.bulk import LOCAL
    from service.sweeping import Points, asking, swept

    asked = Points(design)
    on = LOCAL if dask == "local" else dask
    with asking(asked.count - sink.tally.count, workers, robot, on) as ask:
        answer_rest(asked, ask, sink, table, f"sweeping {stance}", "points")
        try:
            return swept(design, sink.points, ask, tolerance)
        except Interrupted:
            raise Interrupted(f"all points are answered in {table}; --resume goes on") from None


def _status(result: Sweep) -> int:
    """Return the exit status, and tell what it is about where that is not told yet."""
    if not all(row.answered for row in result.rows):
        return FAILED
    if all(row.error is not None for row in result.rows):
        note(f"no point can be answered: {result.rows[0].complaint}")
        return BAD_INPUT
    return DONE
