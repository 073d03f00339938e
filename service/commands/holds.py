"""Define ``crux holds``: try a hand at a grid of places on a scan, and sort the holds found."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Literal

import click
import msgspec

from hand_models.base import CruxError, InvalidInputError, whole_file
from service import processes, tables
from service.commands import options
from service.commands.declaring import argument, command, option

if TYPE_CHECKING:
    from hand_models import fixed_wrist
    from hand_models.hand import Placing
    from hand_models.parameters import ParameterTable

    Outcome = fixed_wrist.FoundHold | InvalidInputError

__all__ = ["holds_command"]


@command("holds")
def holds_command(
    rock: Path = argument(options.ANY_PATH),
    output: Path = option(
        "Where the holds go, the best first, in metres and radians.",
        options.OutputFile(".json"),
        usage="-o --output JSON",
        required=True,
    ),
    spacing: float = option(
        "Of the grid of points across z of the rock's frame [m].", default=0.05
    ),
    angles: int = option(
        "Angles of the wrist at each point, evenly over a whole turn.",
        click.IntRange(1, 360),
        default=4,
    ),
    rotations: tuple[float, ...] = option(
        "Of the outer fingers; may be given more than once, and each is tried.",
        options.FiniteRange(0.0, math.pi + 5e-4),
        usage="--outer-rotation RAD",
        multiple=True,
        default=(0.0, math.pi),
        show_default="0 and π",
    ),
    surface: str = option("A preset's name.", default="rock"),
    seat: Literal["rest", "best"] = option(
        "How a hand is seated at a point; best takes some forty times as long.",
        click.Choice(["rest", "best"]),
        default="rest",
    ),
    placing: Placing = option(
        "contact moves a hand from its seat to where, closed, it rests on the rock; takes some "
        "forty times as long.",
        click.Choice(["given", "contact"]),
        default="given",
    ),
    samples: int = option(
        "Places about each one at which the hand is tried, too; 0 leaves them out.",
        click.IntRange(0, 1024),
        default=8,
        usage="N",
    ),
    robust: int = option(
        "Of the N places that are best without samples, samples are tried.",
        click.IntRange(0),
        default=100,
        usage="N",
    ),
    direction: str = option(
        "Of the force on the rock that is wanted, in the hand's frame H; -fz pulls the hand off.",
        click.Choice(["-fz", "-fx", "+fx", "-fy", "+fy"]),
        default="-fz",
    ),
    force: float = option(
        "Wanted force along the direction alone, for the share of samples that hold it.",
        options.FiniteRange(0.0, 1e6, min_open=True),
        default=0.1,
        usage="N",
    ),
    by: fixed_wrist.HoldRank | None = option(
        "robust: the force along the direction alone that nine in ten samples hold; share: the "
        "samples that hold --force; pure: the force alone where the hand is put; support: with "
        "whatever other forces and moments.",
        click.Choice(["robust", "share", "pure", "support"]),
        usage="--sort",
        show_default="robust; pure without samples",
    ),
    parallel: options.WorkersOption = options.workers_options,
    hand: ParameterTable | None = options.hand_option,
    picture: Path | None = options.plot_option(
        "Draw the rock there, and on it the largest pull-off at each point."
    ),
    page: Path | None = options.page_option,
    as_json: bool = options.json_option,
) -> int:
    """Propose holds on ROCK, a mesh in metres (of a scan, `crux rock` makes one).

    In place of a file, ROCK may be a generated wall: leaning-wall, blocked-wall, small-wall or
    knob-wall, each also with a seed (leaning-wall:3).

    A hand is closed at every point of a grid, at several angles of its wrist; it approaches against
    the mean normal of the rock under its palm. Holds are sorted by the pull-off, with every other
    force and moment zero, that is held in nine of ten samples of where the hand comes to the rock.
    Each hold has a `place`, for the hand of a request whose rock this is.

    Exit status: 3 if nothing holds.
    """
    from hand_models import fixed_wrist, parameters
    from hand_models.rock import Mesh
    from hand_models.scans import read_rock
    from hand_models.tile import Surface

    samples = samples if robust else 0
    if by in ("robust", "share") and not samples:
        raise InvalidInputError(
            f"{by} requires samples: give --samples above 0, or sort by pure or support",
            field="--sort",
        )
    sort = by or ("robust" if samples else "pure")
    Surface.named(surface)
    tables.write_alone(output)
    numbers = parameters.hand_table() if hand is None else parameters.own_hand(hand)
    source = read_rock(rock)
    mesh = Mesh(source.vertices, source.faces, numbers, anywhere=True)
    radius = 0.5 * numbers.scalar("palm", "length")
    # some four hours of one core, forty times that with seat best or placing contact
    most = 100_000
    with tables.progress("laying the grid") as report:
        trials = fixed_wrist.grid_of_trials(
            mesh,
            spacing,
            angles,
            tuple(dict.fromkeys(rotations)),
            radius=radius,
            most=most,
            report=report,
        )
    if not trials:
        raise InvalidInputError(
            "no grid point is on rock that faces −z of its frame; is the mesh flipped, or "
            "smaller than the spacing?",
            field="--spacing",
        )
    # fail before the work is done
    with tables.writing(output, "--output"):
        TemporaryFile(dir=output.parent).close()

    outcomes: dict[int, Outcome] = {}
    sampled: dict[int, Outcome] = {}
    best: list[int] = []
    broken: processes.Interrupted | CruxError | None = None
    # a trial takes as long as 15 plans, with a search for the seat or the rest 40 times that; a
    # sample takes as long as one to two trials
    searches = (seat == "best") + (placing == "contact")
    closings = len(trials) + samples * min(robust, len(trials))
    on, count = parallel.place(15 * (40 * searches or 1) * closings)
    try:
        with processes.HoldTrials(
            mesh, surface, numbers, seat=seat, placing=placing, force=force, on=on, workers=count
        ) as tried:
            _keep(f"trying {len(trials):,} places", trials, tried.each(trials), outcomes)
            best = _ranked(outcomes, sort, direction)[: robust if samples else 0]
            again = [trials[i] for i in best]
            title = f"sampling the best {len(best)}"
            _keep(title, again, tried.each(again, samples=samples), sampled)
    except (processes.Interrupted, CruxError) as error:
        if not outcomes:
            raise
        broken = error
    for k, each in sampled.items():
        # after a lost worker the hold keeps its first result
        outcomes[best[k]] = outcomes[best[k]] if isinstance(each, InvalidInputError) else each
    found = [
        (trials[i], each)
        for i in _ranked(outcomes, sort, direction)
        if not isinstance(each := outcomes[i], InvalidInputError)
    ]
    result = {
        "v": 1,
        "rock": str(rock),
        "units": {"length": "m", "angle": "rad", "force": "N", "share": "1"},
        "trials": len(trials),
        "tried": len(outcomes),
        "samples": samples,
        "direction": direction,
        "force": force,
        "sort": sort,
        **tables.refusals_json(trials, outcomes),
        "warnings": list(mesh.oddities),
        "holds": [tables.hold_json(trial, each, placing) for trial, each in found],
    }
    with tables.writing(output, "--output"), whole_file(output) as part:
        part.write_bytes(msgspec.json.format(msgspec.json.encode(result)))
    drawings = (picture, "--plot"), (page, "--html")
    if broken is not None:
        kept = (
            f"{len(outcomes):,} of {len(trials):,} places were tried, {len(sampled)} of the best "
            f"sampled; what they hold is in {output}"
        )
        missing = [field for path, field in drawings if path is not None]
        if missing:
            kept += f"; {' and '.join(missing)} {'was' if len(missing) == 1 else 'were'} not drawn"
        if isinstance(broken, CruxError):
            raise CruxError(f"{broken.message}; {kept}")
        raise processes.Interrupted(kept)
    for path, field in drawings:
        if path is not None:
            with tables.writing(path, field):
                tables.draw_holds(mesh, trials, outcomes, found, result, path)
    if as_json:
        summary = {name: value for name, value in result.items() if name != "refusals"}
        tables.say({**summary, "holds": len(found), "file": str(output)})
    else:
        out = tables.console()
        tables.print_holds(result, trials, found, out)
        out.print(f"{output} (in m, rad, N)", soft_wrap=True)
    return tables.ExitStatus.DONE if found else tables.ExitStatus.OVERLOADED


def _keep(
    title: str,
    trials: Sequence[fixed_wrist.HoldTrial],
    tried: Generator[tuple[int, Outcome], None, None],
    outcomes: dict[int, Outcome],
) -> None:
    """Store the outcome of each place at once, so that an interruption loses none of them."""
    if not trials:
        return
    with tables.progress(title) as report, closing(tried) as found:
        report(0, len(trials))
        for i, each in found:
            outcomes[i] = each
            report(len(outcomes), len(trials))


def _ranked(outcomes: Mapping[int, Outcome], by: fixed_wrist.HoldRank, direction: str) -> list[int]:
    """Return the indices of trials that hold something, the best first."""
    from hand_models.fixed_wrist import ranked_holds

    tried = sorted(outcomes)
    return [tried[k] for k in ranked_holds([outcomes[i] for i in tried], by, direction)]
