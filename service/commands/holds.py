"""Define ``crux holds``: try a hand at a grid of places on a scan, and sort the holds found."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any, Literal

import click
import msgspec

from hand_models.base import CruxError, InvalidInputError, whole_file
from service import processes, tables
from service.commands import options

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Console

    from hand_models import fixed_wrist
    from hand_models.hand import Placing
    from hand_models.parameters import ParameterTable

    Outcome = fixed_wrist.FoundHold | InvalidInputError
    Pair = tuple[fixed_wrist.HoldTrial, fixed_wrist.FoundHold]

__all__ = ["holds_command"]


@click.command("holds")
@click.argument("rock", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=options.OutputFile(".json"),
    required=True,
    metavar="JSON",
    help="Where the holds go, the best first, in metres and radians.",
)
@click.option(
    "--spacing",
    type=float,
    default=0.05,
    show_default=True,
    help="Of the grid of points across z of the rock's frame [m].",
)
@click.option(
    "--angles",
    type=click.IntRange(1, 360),
    default=4,
    show_default=True,
    help="Angles of the wrist at each point, evenly over a whole turn.",
)
@click.option(
    "--outer-rotation",
    "rotations",
    type=options.FiniteRange(0.0, math.pi + 5e-4),
    multiple=True,
    default=(0.0, math.pi),
    show_default="0 and π",
    metavar="RAD",
    help="Of the outer fingers; may be given more than once, and each is tried.",
)
@click.option("--surface", default="rock", show_default=True, help="A preset's name.")
@click.option(
    "--seat",
    type=click.Choice(["rest", "best"]),
    default="rest",
    show_default=True,
    help="How a hand is seated at a point; best takes some forty times as long.",
)
@click.option(
    "--placing",
    type=click.Choice(["given", "contact"]),
    default="given",
    show_default=True,
    help="contact moves a hand from its seat to where, closed, it rests on the rock; takes some "
    "forty times as long.",
)
@click.option(
    "--robust",
    type=click.IntRange(0),
    default=10,
    show_default=True,
    metavar="N",
    help="Of the best N tell also what is left where the hand is a little elsewhere.",
)
@options.workers_options
@options.hand_option
@options.plot_option("Draw the rock there, and on it the largest pull-off at each point.")
@options.json_option
def holds_command(
    rock: Path,
    output: Path,
    spacing: float,
    angles: int,
    rotations: tuple[float, ...],
    surface: str,
    seat: Literal["rest", "best"],
    placing: Placing,
    robust: int,
    parallel: options.WorkersOption,
    hand: ParameterTable | None,
    picture: Path | None,
    as_json: bool,
) -> None:
    """Propose holds on ROCK, a mesh in metres (of a scan, `crux rock` makes one).

    A hand is closed at every point of a grid, at several angles of its wrist; it approaches against
    the mean normal of the rock under its palm. Holds are sorted by their largest pull-off. Each has
    a `place` for a request's hand whose hold is this rock.
    """
    from hand_models import fixed_wrist, parameters
    from hand_models.rock import Mesh, read_mesh
    from hand_models.tile import Surface

    Surface.named(surface)
    tables.write_alone(output)
    numbers = parameters.hand_table() if hand is None else parameters.own_hand(hand)
    mesh = Mesh(*read_mesh(rock), numbers, anywhere=True)
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
    scattered: dict[int, Outcome] = {}
    best: list[int] = []
    broken: processes.Interrupted | CruxError | None = None
    # a trial takes as long as 15 plans, and with a search for the seat or the rest 40 times that
    searches = (seat == "best") + (placing == "contact")
    on, count = parallel.place(15 * (40 * searches or 1) * len(trials))
    try:
        with processes.HoldTrials(
            mesh, surface, numbers, seat=seat, placing=placing, on=on, workers=count
        ) as tried:
            _keep(f"trying {len(trials):,} places", trials, tried.each(trials), outcomes)
            best = [i for i, _ in _sorted(outcomes)[:robust]]
            again = [trials[i] for i in best]
            title = f"scattering the best {len(best)}"
            _keep(title, again, tried.each(again, robust=True), scattered)
    except (processes.Interrupted, CruxError) as error:
        if not outcomes:
            raise
        broken = error
    for k, each in scattered.items():
        # after a lost worker the hold keeps its first result
        outcomes[best[k]] = outcomes[best[k]] if isinstance(each, InvalidInputError) else each
    found = [(trials[i], each) for i, each in _sorted(outcomes)]
    errors = [each for each in outcomes.values() if isinstance(each, InvalidInputError)]
    refused = Counter(map(_reason, errors))
    result = {
        "v": 1,
        "rock": str(rock),
        "units": {"length": "m", "angle": "rad", "force": "N"},
        "trials": len(trials),
        "tried": len(outcomes),
        "refused": refused.total(),
        "reasons": dict(refused.most_common()),
        "refusals": _refusals(trials, outcomes),
        "warnings": list(mesh.oddities),
        "holds": [_entry(trial, each, placing) for trial, each in found],
    }
    with tables.writing(output, "--output"), whole_file(output) as part:
        part.write_bytes(msgspec.json.format(msgspec.json.encode(result)))
    if broken is not None:
        kept = (
            f"{len(outcomes):,} of {len(trials):,} places were tried, {len(scattered)} of the best "
            f"scattered; what they hold is in {output}"
        )
        if isinstance(broken, CruxError):
            raise CruxError(f"{broken.message}; {kept}")
        raise processes.Interrupted(kept)
    if picture is not None:
        _draw(mesh, trials, found, picture, rock.name)
    if as_json:
        summary = {name: value for name, value in result.items() if name != "refusals"}
        tables.say({**summary, "holds": len(found), "file": str(output)})
    else:
        restless = sum(each.field == "placing" for each in errors)
        _print(trials, found, refused, restless, mesh.oddities, output, tables.console())


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


def _sorted(outcomes: Mapping[int, Outcome]) -> list[tuple[int, fixed_wrist.FoundHold]]:
    """Return indices and holds of trials that hold something, the largest pull-off first."""
    # [N] a smaller force is nothing
    least = 0.1
    pairs = [
        (i, each)
        for i, each in sorted(outcomes.items())
        if not isinstance(each, InvalidInputError) and each.support.max() >= least
    ]
    return sorted(pairs, key=lambda pair: -pair[1].support[0])


def _reason(error: InvalidInputError) -> str:
    """Return why a hand cannot be at a place, without the numbers."""
    words = str(error).split(":")[-1] if error.field is None else error.message
    return " ".join("…" if any(map(str.isdigit, word)) else word for word in words.split())


def _refusals(
    trials: Sequence[fixed_wrist.HoldTrial], outcomes: Mapping[int, Outcome]
) -> list[dict[str, Any]]:
    """Return the points where hands cannot be, with the number of trials for each reason."""
    found: dict[tuple[float, float, float], Counter[str]] = {}
    for i, each in sorted(outcomes.items()):
        if isinstance(each, InvalidInputError):
            found.setdefault(trials[i].point, Counter())[_reason(each)] += 1
    return [{"point": point, "reasons": dict(reasons)} for point, reasons in found.items()]


def _entry(
    trial: fixed_wrist.HoldTrial, found: fixed_wrist.FoundHold, placing: Placing
) -> dict[str, Any]:
    """Return a hold as JSON values."""
    from hand_models import fixed_wrist

    def by_way(values: np.ndarray | None) -> dict[str, float | None] | None:
        if values is None:
            return None
        return {
            way: value if math.isfinite(value) else None
            for way, value in zip(fixed_wrist.TRIAL_WAYS, values.tolist(), strict=True)
        }

    return {
        "place": {
            "point": trial.point,
            "approach": trial.approach,
            "wrist_angle": trial.wrist_angle,
            "frame": "rock",
        },
        "placing": placing,
        "grasp": {"outer_rotation": trial.outer_rotation},
        "pose": {
            "position": found.pose.position.tolist(),
            "orientation": found.pose.quaternion().tolist(),
        },
        "seating": {"rule": found.rule, "backed_off": found.backed_off},
        "support": by_way(found.support),
        "pure_pull_off": found.pure if math.isfinite(found.pure) else None,
        "worst": by_way(found.worst),
        "tenth": by_way(found.tenth),
        "hundredth": by_way(found.hundredth),
    }


def _draw(
    mesh: Any, trials: list[fixed_wrist.HoldTrial], found: list[Pair], path: Path, name: str
) -> None:
    import numpy as np

    from hand_models.scans import plot_holds

    most: dict[tuple[float, float, float], float] = {}
    for trial, each in found:
        most.setdefault(trial.point, each.support[0])
    none = np.array(
        [point for point in dict.fromkeys(t.point for t in trials) if point not in most]
    )
    points, values = np.array(list(most)).reshape(-1, 3), np.array(list(most.values()))
    best = [each.pose for _, each in _shown(found)]
    with tables.writing(path):
        plot_holds(
            mesh.triangles, points, values, none.reshape(-1, 3), best, path, f"holds on {name}"
        )


def _shown(found: list[Pair]) -> list[Pair]:
    """Return the best holds: those that are printed, and drawn."""
    return found[:10]


def _finite(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "-"


def _print(
    trials: list[fixed_wrist.HoldTrial],
    found: list[Pair],
    refused: Counter[str],
    restless: int,
    oddities: Sequence[str],
    output: Path,
    out: Console,
) -> None:
    """Print the best holds, and why hands cannot be at other places.

    ``restless``: at how many places a closed hand comes to no rest.
    """
    from hand_models.fixed_wrist import AT_BORDER
    from service.tables import name

    degree = 180.0 / math.pi
    columns = (
        name("x, y, z mm", "0.point", lambda at: ", ".join(f"{1e3 * x:z.0f}" for x in at)),
        tables.number("wrist °", "0.wrist_angle", ".0f", scale=degree),
        tables.number("outer °", "0.outer_rotation", ".0f", scale=degree),
        tables.number("pull N", "1.support.0", "z.1f"),
        tables.number("alone", "1.pure", _finite),
        tables.number("shear N", lambda row: row[1].support[1:].min(), "z.1f"),
        tables.number("9 in 10", "1.tenth.0", _finite),
        tables.number("99 in 100", "1.hundredth.0", _finite),
    )
    tables.print_rows(_shown(found), columns, out)
    points = len({trial.point for trial in trials})
    pulled = sum(each.support[0] > 0.0 for _, each in found)
    out.print(
        f"{len(trials):,} trials at {points:,} points: {len(found):,} hold something, {pulled:,} "
        "of them also where they are pulled off (pull; shear is the least to any side)"
    )
    if not found:
        hint = "does z of the file point into the rock, as `crux rock` writes it?"
        if [reason for reason, _ in refused.most_common(1)] == [AT_BORDER]:
            hint = "is the scan full of holes? `crux rock` says what helps against them"
        elif 2 * restless > refused.total():
            hint = (
                "closed hands come to rest nowhere; with --placing given they are tried at their "
                "seats"
            )
        out.print(f"nothing holds: {hint}")
    tables.print_warnings(oddities, out)
    for reason, count in refused.most_common(3):
        out.print(f"{count:,} refused: {reason}")
    out.print(f"{output} (in m, rad, N)", soft_wrap=True)
