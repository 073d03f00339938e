"""Define ``crux study`` and ``crux check``: claims of the paper, and of a climb, recomputed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

import planner
from hand_models.base import InvalidInputError
from service import answering, tables
from service.commands import options, stances

if TYPE_CHECKING:
    from rich.console import Console

    from hand_models import experiments, studies
    from hand_models.parameters import ParameterTable


__all__ = ["STUDY_NAMES", "SURFACE_NAMES", "check_command", "study_command"]

STUDY_NAMES: Final = (
    "fig06",
    "fig07",
    "fig10",
    "fig12",
    "fig13",
    "fig14",
    "fig15",
    "fig16",
    "calibrate",
    "sweep",
    "measure",
)
"""Names of all studies; repeated here so that shell completion need not load the studies."""

SURFACE_NAMES: Final = ("sandpaper-36", "concrete-fine", "concrete-coarse", "rock")
"""Names of the bundled surfaces; repeated here so that help need not load the surfaces."""


def _chosen_study(name: str, **wanted: Any) -> str | studies.Study:
    """Return a study by its name, or the sweep that the options describe.

    Raises
    ------
    InvalidInputError
        If a study other than the sweep is given options.
    """
    given = {key: value for key, value in wanted.items() if value not in (None, ())}
    if name not in STUDY_NAMES:
        known = ", ".join(STUDY_NAMES)
        raise InvalidInputError(f"unknown study {name!r}; known are {known}", field="NAME")
    if name != "sweep" or not given:
        if given:
            option = "--measure" if "measures" in given else f"--{min(given)}"
            raise InvalidInputError(
                f"only the study sweep takes this option, not {name}", field=option
            )
        # it asks the planner, and so is not among those of one hand
        return _measurements() if name == "measure" else name

    from hand_models import experiments

    of_rock = {key: given.pop(key) for key in ("diameter", "tension", "surface") if key in given}
    if "measures" in given:
        given["measures"] = tuple(dict.fromkeys(given["measures"]))
    return experiments.GripperSweep(
        conditions=replace(experiments.Conditions.of_fig16()[0], **of_rock), **given
    )


def _measurements() -> studies.Study:
    """Return the study of measurements, over all bundled stances whose wrists are fixed."""
    asked = {name: answering.question(stances.read_request(name)) for name in stances.bundled()}
    fixed = {
        name: each
        for name, each in asked.items()
        if all(hand.wrist == "fixed" for hand in each.stance.hands)
    }
    return planner.MeasurementStudy(fixed)


@click.command("study", epilog=f"NAME is one of {', '.join(STUDY_NAMES)}.")
@click.argument("name", shell_complete=stances.beginning_so(STUDY_NAMES))
@options.folder_option("Where result.json and the pictures go.")
@click.option(
    "--x",
    metavar="SECTION.NAME[i]=LOW:HIGH:N",
    help="Of a sweep: a number of the gripper's, [i] if it is one of a list, and N values "
    "from LOW to HIGH in SI units, such as finger.pulley_radii[1]=0.001:0.005:21; by "
    "default Fig. 16's.",
)
@click.option(
    "--y",
    metavar="SECTION.NAME[i]=LOW:HIGH:N",
    help="Of a sweep: the other number, as --x; by default Fig. 16's.",
)
@click.option("--diameter", type=float, help="Of a sweep: of the rock [m]; by default Fig. 16's A.")
@click.option(
    "--tension", type=float, help="Of a sweep: of both tendons [N]; by default Fig. 16's."
)
@click.option(
    "--surface",
    metavar="NAME",
    help=f"Of a sweep: {', '.join(SURFACE_NAMES)}; by default that of Fig. 16.",
)
@click.option(
    "--measure",
    "measures",
    multiple=True,
    metavar="NAME",
    help="Of a sweep: shear, normal, moment or volume, again for more than one map; by "
    "default shear and normal.",
)
@options.hand_option
@options.json_option
def study_command(
    name: str, folder: Path, hand: ParameterTable | None, as_json: bool, **wanted: Any
) -> None:
    """Run an experiment of the paper again, and compare its claims with the model.

    The study sweep has no claims: it draws what the test gripper holds over any two of its numbers.
    The exit status is 0 whatever the claims say.
    """
    from hand_models import parameters, studies

    chosen = _chosen_study(name, **wanted)
    numbers = None if hand is None else parameters.own_hand(hand)
    line = None if as_json else f"study {name}: started; it may take minutes"
    tables.fill_alone(folder)
    with tables.filling_folder(), tables.progress(name, line=line) as report:
        result, files = studies.run_study(chosen, folder, report, numbers)
    if as_json:
        tables.say(studies.as_json(result) | {"files": [str(path) for path in files]})
    else:
        _print_study(result, files, tables.console())


def _print_study(result: experiments.StudyResult, files: Sequence[Path], out: Console) -> None:
    """Print the claims, the results and the paths of the files."""
    out.print(f"{result.name}: {result.title}", style="bold")
    for line in result.data.get("summary", ()):
        out.print(line)
    if result.claims:
        _print_claims(result, out)
    for what in result.data.get("not_tested", ()):
        out.print(f"not tested: {what}")
    for path in files:
        out.print(str(path), soft_wrap=True)


def _print_claims(result: experiments.StudyResult, out: Console) -> None:
    """Print the claims, and whether each holds."""
    columns = (
        tables.text("", _verdict),
        tables.text("claim"),
        tables.text("claimed", form=_shown),
        tables.text("got", form=_shown),
    )
    tables.print_rows(
        result.claims,
        columns,
        out,
        style=lambda claim: "" if claim.holds else "bold",
        legend=["fitted: a parameter was calibrated to the claim"]
        if any(claim.role == "calibration" for claim in result.claims)
        else [],
    )
    held = sum(claim.holds for claim in result.claims)
    out.print(f"{held} of {len(result.claims)} claims hold")


def _verdict(claim: experiments.Claim) -> str:
    """Return the word for a claim that holds, or does not."""
    if not claim.holds:
        return "missed"
    return "fitted" if claim.role == "calibration" else "holds"


def _shown(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


@click.command("check")
@click.argument("certificate", type=click.Path(path_type=Path))
@options.json_option
def check_command(certificate: Path, as_json: bool) -> int:
    """Recompute what the certificate of a climb claims, without the search.

    CERTIFICATE is the file that was written with the climb. The check recomputes the supports of
    all hands from their vertices, rules states out with the certificate's directions, and goes from
    the start over all states that are left. It solves a linear program for each state of the route.

    Exit status: 0 if the bound is proven and the route is right, 3 if not, 2 if the file cannot be
    read.
    """
    claimed = planner.ClimbCertificate.read(certificate)
    with tables.working(f"checking {certificate}"):
        bound, route = planner.check_bound(claimed), planner.check_route(claimed)
    if as_json:
        tables.say(tables.certificate_json(claimed, bound, route))
    else:
        tables.print_certificate(claimed, bound, route, tables.console())
    right = bound.proven and route.fault is None
    return tables.ExitStatus.DONE if right else tables.ExitStatus.OVERLOADED
