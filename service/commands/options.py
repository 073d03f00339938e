"""Define options that several commands share, and turn their values into typed objects."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import click
import msgspec
from click.shell_completion import CompletionItem

import planner
from hand_models.base import InvalidInputError, installed_version, to_install
from service import answering, bulk, processes, requests, serving, tables
from service.commands import stances
from service.commands.declaring import argument, flag, group, option

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable

__all__ = [
    "ANY_PATH",
    "FOLDER_PATH",
    "PICTURE_ENDINGS",
    "FiniteRange",
    "OutputFile",
    "Own",
    "Wanted",
    "WorkersOption",
    "draws_option",
    "explain_option",
    "folder_option",
    "hand_option",
    "json_option",
    "limb_option",
    "own_options",
    "page_option",
    "plot_option",
    "robot_option",
    "routes_argument",
    "spread_option",
    "stance_argument",
    "timeout_option",
    "wait_option",
    "with_extras",
    "workers_options",
]

RequestT = TypeVar("RequestT", requests.PlanRequest, requests.RouteRequest, requests.ClimbRequest)

PICTURE_ENDINGS: Final = (".png", ".pdf", ".svg")

ANY_PATH: Final = click.Path(path_type=Path)
"""Type of the path of a file or a folder."""

FOLDER_PATH: Final = click.Path(path_type=Path, file_okay=False)
"""Type of the path of a folder."""

# Types of values ----------------------------------------------------------------------------------


class FiniteRange(click.FloatRange):
    """Click type of a number within a range; not a number (nan) is refused."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number of an option's text, or end the command with a usage error."""
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{number} is not in the range {self._describe_range()}.", param, ctx)
        return number


class OutputFile(click.Path):
    """Click type of an output file; an impossible path is refused before any work is done.

    Parameters
    ----------
    *endings : str
        Valid file endings, such as ``.png``.
    """

    def __init__(self, *endings: str) -> None:
        super().__init__(path_type=Path, dir_okay=endings == PICTURE_ENDINGS)
        self._endings = endings

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path of an option's text, or end the command with a usage error."""
        path = Path(str(super().convert(value, param, ctx)))
        if path.suffix.lower() not in self._endings:
            several = f"valid endings are {', '.join(self._endings)}"
            valid = several if len(self._endings) > 1 else f"must end in {self._endings[0]}"
            self.fail(f"{path}: {valid}", param, ctx)
        if not path.parent.is_dir():
            self.fail(f"{path}: no such folder", param, ctx)
        return path


class InputFile(click.Path):
    """Click type of an input file that is read while options are parsed.

    Parameters
    ----------
    reader : str
        Name of the function of `service.answering` that reads the file.
    """

    def __init__(self, reader: str) -> None:
        super().__init__(path_type=Path)
        self._reader = reader

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the content of the file; raise the errors of the reader."""
        return getattr(answering, self._reader)(super().convert(value, param, ctx))


# Options that commands have in common -------------------------------------------------------------


class Own(NamedTuple):
    """Hand (``--hand``) and robot (``--robot``) of the caller; None stands for the bundled ones."""

    hand: ParameterTable | None
    robot: planner.RobotFile | None

    def asked(self, request: RequestT) -> RequestT:
        """Return a copy of a plan or route request for this hand and this robot."""
        return answering.with_robot(answering.with_hand(request, self.hand), self.robot)

    @property
    def robots(self) -> answering.Robots:
        """Builders of the robots that a request may be about, by the robots' names."""
        return answering.robots_of(self.robot)


class WorkersOption(NamedTuple):
    """Choice of the workers for many questions: local processes or a Dask cluster.

    ``workers``: number of processes, None for as many as are worth it; ``dask``: address of the
    scheduler, None without Dask.
    """

    workers: int | None
    dask: str | None

    def place(self, plans: int) -> tuple[str, int | None]:
        """Return where to do work that takes as long as so many ``plans`` of stances.

        Returns
        -------
        on : str
            ``here``, ``processes``, or a Dask cluster, for `service.bulk.answer_all`.
        workers : int or None
            Number of worker processes; None for the default.
        """
        if self.dask is not None:
            return (bulk.LOCAL_CLUSTER if self.dask == "local" else self.dask), self.workers
        count = processes.worth(plans, self.workers)
        return ("here", None) if count == 1 else ("processes", count)


class Wanted(NamedTuple):
    """Options of a plan: ``--spread`` over samples, samples (``--draws``), and ``--no-explain``.

    The spread is a Monte Carlo study over uncertain parameters; ``draws`` None means the bundled
    samples; ``unexplained`` leaves out the certificate of a stance without a plan within its
    limits.
    """

    spread: bool = False
    draws: list[requests.Draw] | None = None
    unexplained: bool = False

    def of(self, request: RequestT) -> RequestT:
        """Return a copy of a plan or route request with these options."""
        more: dict[str, Any] = {"draws": self.draws} if self.draws else {}
        if self.spread or self.draws:
            more["want"] = list(dict.fromkeys([*request.want, "spread"]))
        more |= {"explain": False} if self.unexplained else {}
        return msgspec.structs.replace(request, **more)


def with_extras(
    request: requests.PlanRequest, *further: planner.Want, whole: bool = True
) -> requests.PlanRequest:
    """Return a copy of a plan request that also wants the load factor, shadow prices and more.

    ``further`` names more results for ``want``; ``whole`` asks for the full reply, of any size.
    """
    want = dict.fromkeys([*request.want, "load_factor", "prices", *further])
    more = {"detail": "full", "max_reply_bytes": None} if whole else {}
    return msgspec.structs.replace(request, want=list(want), **more)


def _read_hand(
    _: click.Context, __: click.Parameter, paths: tuple[Path, ...]
) -> ParameterTable | None:
    """Return the numbers of a hand's file; at most one may be given."""
    if not paths:
        return None
    if len(paths) > 1:
        raise click.BadParameter(f"one FILE at most may be given, got {', '.join(map(str, paths))}")
    if paths[0].suffix != ".toml" and not paths[0].exists():
        raise click.BadParameter(
            f"{paths[0]}: no such file; a FILE with numbers of a hand is wanted, not a LIMB"
        )

    return answering.read_hand(paths[0])


def _limb_and_hand(
    context: click.Context, option: click.Parameter, given: tuple[str, ...]
) -> tuple[str, ParameterTable | None]:
    """Return the limb, which the contract calls a hand, and the numbers of a hand's file."""
    files = tuple(Path(value) for value in given if value.endswith(".toml"))
    limbs = [value for value in given if not value.endswith(".toml")]
    if len(limbs) != 1 or len(files) > 1:
        raise click.BadParameter(
            f"one LIMB and at most one FILE that ends in .toml, got {', '.join(given)}"
        )
    return limbs[0], _read_hand(context, option, files)


def _check_dask(_: click.Context, __: click.Parameter, address: str | None) -> str | None:
    """Refuse anything but an address of a scheduler."""
    if address not in (None, "local"):
        try:
            bulk.check_address(address)
        except InvalidInputError:
            raise InvalidInputError(
                f"must be local, or tcp://HOST:PORT of a Dask scheduler, got {address!r}",
                field="--dask",
            ) from None
    return address


def _check_folder(_: click.Context, __: click.Parameter, path: Path) -> Path:
    """Refuse a folder with the file ending of a table or a picture."""
    files = (".csv", ".parquet", ".json", ".jsonl", *PICTURE_ENDINGS)
    if path.suffix.lower() in files and not path.is_dir():
        raise click.BadParameter(f"{path}: must be a folder for several files, not a {path.suffix}")
    return path


def _check_output(_: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """Lock a picture or page until the command ends; refuse a page that nothing here can draw."""
    option = parameter.opts[-1]
    if path and option == "--html" and installed_version("plotly") is None:
        message = f"needs plotly, which is not installed: {to_install('view')}"
        raise InvalidInputError(message, field=option)
    if path:
        tables.write_alone(path, option=option)
    return path


def _limbs(context: click.Context, _: click.Parameter, begun: str) -> list[CompletionItem]:
    """Complete the limbs whose hands hold in the stance, if it is given and can be read."""
    # click has not yet parsed arguments before an option that lacks its value
    given = [context.params.get("stance"), *context.args]
    return stances.beginning_so(stances.limbs_of(next(filter(None, given), None)), files=True)(
        context, _, begun
    )


_route_or_file = stances.beginning_so(stances.bundled(requests.RouteRequest), files=True)

stance_argument = argument(shell_complete=stances.beginning_so(stances.bundled(), files=True))
routes_argument = argument(
    nargs=-1, required=True, metavar="ROUTE...", shell_complete=_route_or_file
)
json_option = flag("Print JSON, and nothing else.", usage="--json")
page_option = option(
    "Page for a browser to write: one file, which loads nothing else.",
    OutputFile(".html"),
    usage="--html FILE",
    callback=_check_output,
)
hand_option = option(
    "TOML with numbers of a hand of your own; all others are the bundled hand's.",
    ANY_PATH,
    multiple=True,
    callback=_read_hand,
    usage="FILE",
)
limb_option = option(
    "Whose wrench space. A second --hand FILE, ending in .toml, has numbers of a hand of your "
    "own; all others are the bundled hand's.",
    usage="--hand LIMB",
    required=True,
    multiple=True,
    callback=_limb_and_hand,
    shell_complete=_limbs,
)
robot_option = option(
    "TOML that describes a robot of your own, and names its URDF.",
    InputFile("read_robot"),
    usage="FILE",
)
own_options = group(Own, hand=hand_option, robot=robot_option)

explain_option = flag(
    "Leave out the proof of what is in the way where a stance is overloaded or infeasible.",
    usage="--no-explain",
)
spread_option = flag(
    "And how far utilisation and load factor spread over what is not known of hand and rock."
)
draws_option = option(
    "TOML with samples of your own for the spread; with it, --spread need not be given.",
    InputFile("read_draws"),
    usage="FILE",
)

timeout_option = option(
    f"[s]; by default {serving.SERVING_SETTINGS.client_timeout:g}, or what the deadline of "
    "the request takes.",
    FiniteRange(0.01, 1e6),
)
wait_option = option(
    "Wait so long for a service that is not there yet.", FiniteRange(0.0, 1e6), usage="SECONDS"
)
workers_options = group(
    WorkersOption,
    workers=option("Processes; by default as many as are worth it.", click.IntRange(min=1)),
    dask=option(
        "Plan on the Dask cluster whose scheduler is at tcp://HOST:PORT; local is one of this "
        "machine's own.",
        usage="ADDRESS",
        callback=_check_dask,
    ),
)


def plot_option(text: str) -> Any:
    """Return the option ``--plot`` with a help text, for the parameter of a picture's path."""
    kind, check = OutputFile(*PICTURE_ENDINGS), _check_output
    return option(text, kind, usage="--plot FILE", callback=check)


def folder_option(text: str) -> Any:
    """Return the option ``--output`` of a folder, with a help text."""
    return option(
        text,
        FOLDER_PATH,
        usage="-o --output DIR",
        callback=_check_folder,
        required=True,
    )
