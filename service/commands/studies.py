"""Define ``crux study``, ``check`` and ``replay``: claims and answers, computed again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import planner
from hand_models.base import InvalidInputError
from service import answering, operating, recording, tables
from service.commands import options, stances
from service.commands.declaring import argument, command, group, option

if TYPE_CHECKING:
    from rich.console import Console

    from hand_models import experiments, studies
    from hand_models.parameters import ParameterTable


__all__ = ["STUDY_NAMES", "SURFACE_NAMES", "check_command", "replay_command", "study_command"]

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


@command("study", epilog=f"NAME is one of {', '.join(STUDY_NAMES)}.")
def study_command(
    name: str = argument(shell_complete=stances.beginning_so(STUDY_NAMES)),
    folder: Path = options.folder_option("Where result.json and the pictures go."),
    wanted: dict[str, Any] = group(
        dict,
        x=option(
            "Of a sweep: a number of the gripper's, [i] if it is one of a list, and N values "
            "from LOW to HIGH in SI units, such as finger.pulley_radii[1]=0.001:0.005:21; by "
            "default Fig. 16's.",
            usage="SECTION.NAME[i]=LOW:HIGH:N",
        ),
        y=option(
            "Of a sweep: the other number, as --x; by default Fig. 16's.",
            usage="SECTION.NAME[i]=LOW:HIGH:N",
        ),
        diameter=option("Of a sweep: of the rock [m]; by default Fig. 16's A.", float),
        tension=option("Of a sweep: of both tendons [N]; by default Fig. 16's.", float),
        surface=option(
            f"Of a sweep: {', '.join(SURFACE_NAMES)}; by default that of Fig. 16.", usage="NAME"
        ),
        measures=option(
            "Of a sweep: shear, normal, moment or volume, again for more than one map; by "
            "default shear and normal.",
            usage="--measure NAME",
            multiple=True,
        ),
    ),
    hand: ParameterTable | None = options.hand_option,
    as_json: bool = options.json_option,
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


@command("check")
def check_command(
    certificate: Path = argument(options.ANY_PATH),
    as_json: bool = options.json_option,
) -> int:
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


@command("replay")
def replay_command(
    file: Path = argument(options.ANY_PATH, metavar="FILE"),
    own: options.Own = options.own_options,
    as_json: bool = options.json_option,
) -> int:
    """Ask all questions of a recording again, here, and say what has moved in the answers.

    FILE is one of crux serve --record. Answers are compared to the digit, without identifiers and
    times on a clock. The exit status is 3 if an answer has moved. The hand is the recorded
    service's unless --hand gives another; of a robot of your own, give --robot again.
    """
    recorded = recording.Recording(file)
    replay = recording.Replay(recorded, own.robots, own.hand)
    with tables.progress("replaying", line=f"replaying {file}") as step:
        for _ in replay.run(recorded.questions(step)):
            pass
    operating.note_losses(recorded, file)
    if as_json:
        tables.say(operating.replay_json(replay))
    else:
        operating.print_replay(replay, tables.console())
    if replay.moved:
        return tables.ExitStatus.OVERLOADED
    lost = recorded.damaged or (recorded.whole is False and not replay.asked)
    return tables.ExitStatus.FAILED if lost else tables.ExitStatus.DONE
