"""Studies on the command line: what a sweep is asked, and claims as a table for a person."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from hand_models.base import InvalidInputError
from service.commands.options import beginning_so, folder_option, hand_option, json_option
from service.tables import filling_folder, progress, say, write_alone

if TYPE_CHECKING:
    from rich.console import Console

    from hand_models.experiments import Claim, StudyResult
    from hand_models.parameters import ParameterTable
    from hand_models.studies import Study

__all__ = ["NAMES", "chosen_study", "print_study", "study", "sweep_options"]

SWEEP: Final = "sweep"
"""The one study that takes options."""

MEASURE: Final = "measure"
"""The study that asks the planner, and so is not among those of one hand."""

NAMES: Final = (
    "fig06",
    "fig07",
    "fig10",
    "fig12",
    "fig13",
    "fig14",
    "fig15",
    "fig16",
    "calibrate",
    SWEEP,
    MEASURE,
)
"""Of all studies; here, so that completion need not load them."""

SURFACES: Final = ("sandpaper-36", "concrete-fine", "concrete-coarse", "rock")
"""Of the bundled surfaces; likewise."""

AXIS: Final = "SECTION.NAME[i]=LOW:HIGH:N"


def sweep_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of the study `SWEEP` to a command."""
    for option in (
        click.option(
            "--measure",
            "measures",
            multiple=True,
            metavar="NAME",
            help="Of a sweep: shear, normal, moment or volume, again for more than one map; by "
            "default shear and normal.",
        ),
        click.option(
            "--surface",
            metavar="NAME",
            help=f"Of a sweep: {', '.join(SURFACES)}; by default that of Fig. 16.",
        ),
        click.option(
            "--tension", type=float, help="Of a sweep: of both tendons [N]; by default Fig. 16's."
        ),
        click.option(
            "--diameter", type=float, help="Of a sweep: of the rock [m]; by default Fig. 16's A."
        ),
        click.option(
            "--y", metavar=AXIS, help="Of a sweep: the other number, as --x; by default Fig. 16's."
        ),
        click.option(
            "--x",
            metavar=AXIS,
            help="Of a sweep: a number of the gripper's, [i] if it is one of a list, and N values "
            "from LOW to HIGH in SI units, such as finger.pulley_radii[1]=0.001:0.005:21; by "
            "default Fig. 16's.",
        ),
    ):
        command = option(command)
    return command


def chosen_study(name: str, **options: Any) -> str | Study:
    """Return a study by its name, or a sweep of what the options ask for.

    Raises
    ------
    InvalidInputError
        If a study other than the sweep is given options.
    """
    given = {key: value for key, value in options.items() if value not in (None, ())}
    if name not in NAMES:
        raise InvalidInputError(f"{name!r}: valid are {', '.join(NAMES)}", field="NAME")
    if name != SWEEP or not given:
        if given:
            option = "--measure" if "measures" in given else f"--{min(given)}"
            raise InvalidInputError(f"only the study {SWEEP} takes it, not {name}", field=option)
        return _measurements() if name == MEASURE else name
    from hand_models.experiments import Conditions, Sweep

    of_rock = {key: given.pop(key) for key in ("diameter", "tension", "surface") if key in given}
    if "measures" in given:
        given["measures"] = tuple(dict.fromkeys(given["measures"]))
    return Sweep(conditions=replace(Conditions.of_fig16()[0], **of_rock), **given)


def _measurements() -> Study:
    """Return the study of measurements, over all bundled stances whose wrists are fixed."""
    from planner import MeasurementStudy
    from service.answering import question
    from service.commands.stances import bundled, read_request

    asked = {name: question(read_request(name)) for name in bundled()}
    fixed = {
        name: each
        for name, each in asked.items()
        if all(hand.wrist == "fixed" for hand in each.stance.hands)
    }
    return MeasurementStudy(fixed)


@click.command(epilog=f"NAME is one of {', '.join(NAMES)}.")
@click.argument("name", shell_complete=beginning_so(NAMES))
@folder_option("Where result.json and the pictures go.")
@sweep_options
@hand_option
@json_option
def study(
    name: str, folder: Path, hand: ParameterTable | None, as_json: bool, **options: Any
) -> None:
    """Run an experiment of the paper again, and hold its claims against the model.

    The study sweep has no claims: it draws what the test gripper holds over any two of its numbers.
    The exit status is 0 whatever the claims say.
    """
    from hand_models.parameters import own_hand
    from hand_models.studies import as_json as study_json, run_study
    from service.tables import console

    chosen = chosen_study(name, **options)
    numbers = None if hand is None else own_hand(hand)
    line = None if as_json else f"study {name}: started; it may take minutes"
    with filling_folder():
        folder.mkdir(parents=True, exist_ok=True)
    write_alone(folder / "result.json", folder)
    with filling_folder(), progress(name, line=line) as tell:
        result, files = run_study(chosen, folder, tell, numbers)
    if as_json:
        say(study_json(result) | {"files": [str(path) for path in files]})
    else:
        print_study(result, files, console())


def print_study(result: StudyResult, files: Sequence[Path], out: Console) -> None:
    """Print what was claimed, what came out, and where the files are."""
    out.print(f"{result.name}: {result.title}", style="bold", markup=False)
    for line in result.data.get("summary", ()):
        out.print(line, markup=False)
    if result.claims:
        _print_claims(result, out)
    for what in result.data.get("not_tested", ()):
        out.print(f"not tested: {what}", markup=False)
    for path in files:
        out.print(str(path), markup=False, soft_wrap=True)


def _print_claims(result: StudyResult, out: Console) -> None:
    """Print which claims hold."""
    from service.tables import print_rows, text

    columns = (
        text("", _verdict),
        text("claim"),
        text("claimed", form=_shown),
        text("got", form=_shown),
    )
    print_rows(result.claims, columns, out, style=lambda claim: "" if claim.holds else "bold")
    held = sum(claim.holds for claim in result.claims)
    out.print(f"{held} of {len(result.claims)} claims hold", markup=False)
    if any(claim.role == "calibration" for claim in result.claims):
        out.print("fitted: a parameter was calibrated to the claim", markup=False)


def _verdict(claim: Claim) -> str:
    """Return whether a claim holds, in a word."""
    if not claim.holds:
        return "missed"
    return "fitted" if claim.role == "calibration" else "holds"


def _shown(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"
