"""Options that commands share: own hands and robots, pictures, folders, JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click
import msgspec
from click.shell_completion import CompletionItem

from hand_models.base import InvalidInputError
from service.commands.stances import bundled, limbs_of
from service.requests import Draw, PlanRequest, RouteRequest, Want
from service.serving import TIMEOUT

if TYPE_CHECKING:
    from hand_models.parameters import ParameterTable
    from planner import RobotFile

__all__ = [
    "PICTURES",
    "FiniteRange",
    "asked",
    "beginning_so",
    "dask_option",
    "draws_option",
    "explain_option",
    "folder_option",
    "hand_option",
    "json_option",
    "limb_option",
    "output_in",
    "plot_option",
    "robot_option",
    "routes_argument",
    "spread_option",
    "stance_argument",
    "timeout_option",
    "wait_option",
    "with_extras",
    "workers_option",
]

R = TypeVar("R", PlanRequest, RouteRequest)

PICTURES: Final = (".png", ".pdf", ".svg")
TABLES: Final = (".csv", ".parquet", ".json", ".jsonl")
HAND_FILE: Final = ".toml"
EXTRAS: Final[tuple[Want, ...]] = ("load_factor", "prices")
"""What the command line asks for besides the plan."""

LONGEST: Final = 1e6
"""Of what may be waited for [s]; the longest deadline of a request."""


class FiniteRange(click.FloatRange):
    """A range of numbers, of which nan is none."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number, or refuse it."""
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{number} is not in the range {self._describe_range()}.", param, ctx)
        return number


def asked(request: R, hand: ParameterTable | None, robot: RobotFile | None) -> R:
    """Return a request for a hand and a robot of the caller's own."""
    from service.answering import with_hand, with_robot

    return with_robot(with_hand(request, hand), robot)


def with_extras(request: PlanRequest, *further: Want, whole: bool = True) -> PlanRequest:
    """Return a request that wants what the command line shows besides the plan, and more, too.

    ``whole``: whether a person reads the reply, who gets all of it.
    """
    want = dict.fromkeys([*request.want, *EXTRAS, *further])
    more = {"detail": "full", "max_reply_bytes": None} if whole else {}
    return msgspec.structs.replace(request, want=list(want), **more)


def output_in(
    *endings: str,
) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
    """Return what refuses a file that cannot be written, before any work is done."""
    valid = f"valid endings are {', '.join(endings)}"
    if len(endings) == 1:
        valid = f"must end in {endings[0]}"

    def check(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in endings:
            raise click.BadParameter(f"{path}: {valid}")
        if path is not None and not path.parent.is_dir():
            raise click.BadParameter(f"{path}: no such folder")
        return path

    return check


def _read_hand(
    _: click.Context, __: click.Parameter, paths: tuple[Path, ...]
) -> ParameterTable | None:
    if not paths:
        return None
    if len(paths) > 1:
        raise click.BadParameter(f"one FILE at most, got {', '.join(map(str, paths))}")
    if paths[0].suffix != HAND_FILE and not paths[0].exists():
        raise click.BadParameter(
            f"{paths[0]}: no such file; a FILE with numbers of a hand is wanted, not a LIMB"
        )
    from service.answering import read_hand

    return read_hand(paths[0])


def _read_draws(_: click.Context, __: click.Parameter, path: Path | None) -> list[Draw] | None:
    if path is None:
        return None
    from service.answering import read_draws

    return read_draws(path)


def _read_robot(_: click.Context, __: click.Parameter, path: Path | None) -> RobotFile | None:
    if path is None:
        return None
    from service.answering import read_robot

    return read_robot(path)


def _limb_and_hand(
    _: click.Context, __: click.Parameter, given: tuple[str, ...]
) -> tuple[str, ParameterTable | None]:
    """Tell the limb, which the contract calls a hand, from the file of one."""
    files = [value for value in given if value.endswith(HAND_FILE)]
    limbs = [value for value in given if not value.endswith(HAND_FILE)]
    if len(limbs) != 1 or len(files) > 1:
        raise click.BadParameter(
            f"one LIMB and at most one FILE that ends in {HAND_FILE}, got {', '.join(given)}"
        )
    if not files:
        return limbs[0], None
    from service.answering import read_hand

    return limbs[0], read_hand(Path(files[0]))


def beginning_so(
    names: Iterable[str], *, files: bool = False
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """Return what completes one of these names in a shell, or the path of a file if that may be."""

    def complete(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in names if name.startswith(begun)]
        # last, click's function for bash would forget the names for it
        return [CompletionItem(begun, type="file"), *found] if files else found

    return complete


def _limbs(context: click.Context, _: click.Parameter, begun: str) -> list[CompletionItem]:
    """Complete the limbs that hold on in the stance, as far as it is given and can be read."""
    # what stands before an option that lacks its value is not yet told apart
    given = [context.params.get("stance"), *context.args]
    return beginning_so(limbs_of(next(filter(None, given), None)), files=True)(context, _, begun)


stance_argument = click.argument("stance", shell_complete=beginning_so(bundled(), files=True))
routes_argument = click.argument(
    "routes",
    nargs=-1,
    required=True,
    metavar="ROUTE...",
    shell_complete=beginning_so(bundled(RouteRequest), files=True),
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
hand_option = click.option(
    "--hand",
    type=click.Path(path_type=Path),
    multiple=True,
    callback=_read_hand,
    metavar="FILE",
    help="TOML with numbers of a hand of your own; all others are the bundled hand's.",
)
explain_option = click.option(
    "--no-explain",
    "unexplained",
    is_flag=True,
    help="Leave out the proof of what is in the way where a stance is overloaded or infeasible.",
)
spread_option = click.option(
    "--spread",
    is_flag=True,
    help="And how far utilisation and load factor spread over what is not known of hand and rock.",
)
draws_option = click.option(
    "--draws",
    type=click.Path(path_type=Path),
    callback=_read_draws,
    metavar="FILE",
    help="TOML with draws of your own, over which the spread is told; --spread is then meant.",
)
limb_option = click.option(
    "--hand",
    "limb_and_hand",
    required=True,
    multiple=True,
    callback=_limb_and_hand,
    shell_complete=_limbs,
    metavar="LIMB",
    help="Whose wrench space. A second --hand FILE, ending in .toml, has numbers of a hand of your "
    "own; all others are the bundled hand's.",
)
robot_option = click.option(
    "--robot",
    type=click.Path(path_type=Path),
    callback=_read_robot,
    metavar="FILE",
    help="TOML that describes a robot of your own, and names its URDF.",
)
timeout_option = click.option(
    "--timeout",
    type=FiniteRange(0.01, LONGEST),
    help=f"[s]; by default {TIMEOUT:g}, or what the deadline of the request takes.",
)
wait_option = click.option(
    "--wait",
    type=FiniteRange(0.0, LONGEST),
    metavar="SECONDS",
    help="Wait so long for a service that is not there yet.",
)

workers_option = click.option(
    "--workers", type=click.IntRange(min=1), help="Processes; by default as many as are worth it."
)


def _place(_: click.Context, __: click.Parameter, address: str | None) -> str | None:
    """Refuse what is no address of a scheduler."""
    if address not in (None, "local"):
        from service.bulk import check_address

        try:
            check_address(address)
        except InvalidInputError:
            raise InvalidInputError(
                f"must be local, or tcp://HOST:PORT of a Dask scheduler, got {address!r}",
                field="--dask",
            ) from None
    return address


dask_option = click.option(
    "--dask",
    metavar="ADDRESS",
    callback=_place,
    help="Plan on the Dask cluster whose scheduler is at tcp://HOST:PORT; local is one of this "
    "machine's own.",
)


def plot_option(text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return an option that names a picture, which is passed on as ``picture``."""
    return click.option(
        "--plot",
        "picture",
        type=click.Path(path_type=Path),
        callback=output_in(*PICTURES),
        metavar="FILE",
        help=text,
    )


def _folder_in(_: click.Context, __: click.Parameter, path: Path) -> Path:
    """Refuse a folder that is named as a table or a picture is."""
    if path.suffix.lower() in (*TABLES, *PICTURES) and not path.is_dir():
        raise click.BadParameter(f"{path}: names a folder, into which several files go")
    return path


def folder_option(text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return an option that names where files go, which is passed on as ``folder``."""
    return click.option(
        "-o",
        "--output",
        "folder",
        type=click.Path(path_type=Path, file_okay=False),
        callback=_folder_in,
        required=True,
        metavar="DIR",
        help=text,
    )
