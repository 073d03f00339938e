"""Define ``crux sweep``: plan one stance over ranges of varied fields."""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

from hand_models.base import InvalidInputError, errors_under
from service import processes, sweeping, tables
from service.commands import options, stances
from service.commands.batch import answer_rest, writing_answers

__all__ = ["sweep_command"]


@click.command("sweep")
@options.stance_argument
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
    type=options.FiniteRange(1e-9, 0.5),
    default=sweeping.BORDER_TOLERANCE,
    show_default=True,
    help="Of where it stops holding, if one number varies: a share of the range.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on where this sweep was broken off: points that the table of DIR has are kept.",
)
@options.workers_options
@options.folder_option("Where the table and the picture go.")
@options.own_options
@options.json_option
def sweep_command(
    stance: str,
    variations: tuple[str, ...],
    samples: int | None,
    seed: int | None,
    over: str | None,
    tolerance: float,
    resume: bool,
    parallel: options.WorkersOption,
    folder: Path,
    own: options.Own,
    as_json: bool,
) -> int:
    """Plan a stance over varied fields: a table, a picture, and where it stops holding.

    A PATH has the names of the request with dots between them, as load.mass, gravity.2 or
    hands.front_left.surface.shear_limit; hands are named by their limbs, entries of lists by their
    index, and * is all of them. Certificates and all extras but the load factor are left out.
    The table grows as points are answered; a sweep that is broken off goes on with --resume.

    Exit status: 0 whatever holds, 2 bad input, also where no point can be answered for it, 1 where
    a point failed or was lost.
    """
    if seed is not None and samples is None:
        raise InvalidInputError("requires --samples; give it, or leave --seed out", field="--seed")
    request = own.asked(stances.read_request(stance))
    try:
        chosen = [
            sweeping.Variation.parse(each, sampled=samples is not None) for each in variations
        ]
        design = sweeping.Design.of(request, chosen, samples, seed or 0, own.robots)
    except InvalidInputError as error:
        where = "--vary" if error.field is None else f"--vary {error.field}"
        raise InvalidInputError(error.message, field=where) from None
    given = click.get_current_context().get_parameter_source("tolerance")
    if given is ParameterSource.COMMANDLINE and design.number is None:
        paths = ", ".join(design.variations[i].path for i in design.varying)
        raise InvalidInputError(
            "requires exactly one varied field, and numbers as its values; varied: "
            f"{paths}; vary one number only, or remove --tolerance",
            field="--tolerance",
        )
    pair = None if over is None else over.split(",")
    if pair is not None:
        with errors_under("--over"):
            design.places_of(pair)
    with tables.filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
    table, picture = folder / "sweep.csv", folder / "sweep.png"
    tables.write_alone(table, folder)
    with writing_answers(table):
        sink = sweeping.PointRows(request, design, seed or 0, table, resume, *own)
    left = design.count - sink.tally.count
    ask = sweeping.asking(left, parallel.workers, own.robot, parallel.dask)
    answer_rest(design, ask, sink, table, f"sweeping {stance}", "points")
    try:
        result = sweeping.with_borders(design, sink.points, own.robot, tolerance)
    except processes.Interrupted:
        raise processes.Interrupted(
            f"all points are answered in {table}, but not all borders of what is feasible are "
            "found; --resume goes on"
        ) from None
    with tables.filling_folder():
        sweeping.plot_sweep(result, picture, Path(stance).stem, pair)
    if as_json:
        tables.say(result.summary() | {"files": {"table": str(table), "picture": str(picture)}})
    else:
        out = tables.console()
        if tables.verbosity() >= 0:
            tables.print_sweep(result, out)
        out.print(f"table: {table}\npicture: {picture}", markup=False, soft_wrap=True)
    return _status(result)


def _status(result: sweeping.Sweep) -> int:
    """Return the exit status, and print the first error if no point can be answered."""
    if not all(row.answered for row in result.rows):
        return tables.ExitStatus.FAILED
    if all(row.error is not None for row in result.rows):
        tables.note(f"no point can be answered: {result.rows[0].complaint}")
        return tables.ExitStatus.BAD_INPUT
    return tables.ExitStatus.DONE
