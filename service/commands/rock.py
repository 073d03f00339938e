"""A scan on the command line: read, meshed, written, and told as a table."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from hand_models.base import InvalidInputError, Pose
from hand_models.parameters import scan_table
from hand_models.scans import ENDINGS, UNITS, UPS
from service.commands.options import json_option, output_in, plot_option
from service.tables import progress, say, writing

if TYPE_CHECKING:
    from rich.console import Console

    from hand_models.scans import ScannedRock

__all__ = ["rock"]

OUTPUT: Final = ".ply"

STEEP: Final = 0.9
"""Vertical part of a view from which on the rock is ground, or a roof."""

SIEVE: Final = 100
"""Holes from which on it is said which `--hole` would bridge most."""

NINE_IN_TEN: Final = 0.9

NAMED: Final = 5
"""Holes whose width is told."""


def _triple(_: click.Context, __: click.Parameter, text: str | None) -> tuple[float, ...] | None:
    """Return three numbers with commas between them."""
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise click.BadParameter(f"three numbers with commas between are needed, got {text!r}")
    return numbers


@click.command(epilog=f"FILE ends in {', '.join(ENDINGS)}.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    callback=output_in(OUTPUT),
    metavar="PLY",
    help="Where the triangles go.",
)
@click.option(
    "--unit",
    type=click.Choice(list(UNITS)),
    default="m",
    show_default=True,
    help="Of the file's numbers.",
)
@click.option(
    "--width",
    type=float,
    metavar="W",
    help="In place of a unit: scale it so that its longest side is W [m].",
)
@click.option(
    "--cell",
    type=float,
    help="Distance between neighbours of a grid, in the file's unit; by default the file's own.",
)
@click.option(
    "--up",
    type=click.Choice(list(UPS)),
    default="z",
    show_default=True,
    help="The file's axis that points up; of a wall that was seen along z another is to be given.",
)
@click.option(
    "--view",
    callback=_triple,
    metavar="X,Y,Z",
    help="In which direction the scanner looked, in the file's axes; by default where the points "
    "vary least, away from the viewpoint; down a grid's heights.",
)
@click.option(
    "--viewpoint",
    callback=_triple,
    metavar="X,Y,Z",
    help="In place of a view: where the scanner was, in the file's axes and unit; by default what "
    "a PCD file says, else the file's origin.",
)
@click.option(
    "--origin",
    callback=_triple,
    metavar="X,Y,Z",
    help="Where the hold's frame begins, in the file's axes and unit; by default in the middle.",
)
@click.option(
    "--spacing",
    type=float,
    help="Keep one point a square of that side across the view [m]; by default half the points' "
    f"median distance, or as much more as leaves {scan_table().scalar('mesh', 'vertices'):,.0f}.",
)
@click.option(
    "--hole",
    type=float,
    default=scan_table().scalar("mesh", "hole"),
    show_default=True,
    help="The widest hole, and the highest step, that is bridged [m].",
)
@plot_option("Draw the rock there, as the scanner saw it.")
@json_option
def rock(
    file: Path,
    output: Path,
    spacing: float | None,
    hole: float,
    picture: Path | None,
    as_json: bool,
    **reading: Any,
) -> None:
    """Make a mesh hold of a scan: a point cloud, or a grid of heights.

    The triangles are in a frame on the rock, z into it along the view and x up, which is a hold's
    own; the table tells its pose in the file's axes, turned so that z is up, in metres.
    """
    from hand_models.scans import mesh_scan, plot_rock, read_scan, write_rock
    from service.tables import console

    if reading["view"] is not None and reading["viewpoint"] is not None:
        raise InvalidInputError("give a view or a viewpoint, not both", field="view")
    if output.exists() and output.samefile(file):
        raise InvalidInputError(f"{output} is the scan itself", field="--output")
    with progress(f"meshing {file.name}") as tell:
        scan = read_scan(file, **reading)
        made = mesh_scan(scan, spacing=spacing, hole=hole, tell=tell)
        with writing(output, "--output"):
            write_rock(made, output)
        if picture is not None:
            with writing(picture):
                plot_rock(made, picture, file.name)
    source = click.get_current_context().get_parameter_source("up")
    assumed = source is not ParameterSource.COMMANDLINE
    if as_json:
        told = {"up": reading["up"], "up_assumed": assumed, "file": str(output)}
        say(_summary(made) | told)
    else:
        _print_rock(made, hole, reading["up"], assumed, output, console())


def _summary(made: ScannedRock) -> dict[str, Any]:
    """Return what came out as JSON has it; the pose is in the form of a request's."""
    return {
        "read": made.read,
        "dropped": made.dropped,
        "vertices": len(made.vertices),
        "triangles": len(made.faces),
        "spacing": made.spacing,
        "extent": made.extent.tolist(),
        "holes": [{"width": hole.width, "place": hole.place.tolist()} for hole in made.holes],
        "filled": [
            {"axis": "xyz"[each.axis], "value": each.value, "points": each.cells}
            for each in made.filled
        ],
        "pose": {
            "position": made.pose.position.tolist(),
            "orientation": made.pose.quaternion().tolist(),
        },
    }


def _print_rock(
    made: ScannedRock, hole: float, up: str, assumed: bool, output: Path, out: Console
) -> None:
    """Print how many points and triangles there are, how large the rock is, and what is open."""
    from service.tables import table_of

    table = table_of("")
    table.show_header = False
    table.add_column("", justify="right")
    table.add_column("", overflow="fold")
    table.add_row("points read", f"{made.read:,}", "")
    table.add_row("dropped", f"{made.dropped:,}", "not finite")
    table.add_row("kept", f"{len(made.vertices):,}", f"{1e3 * made.spacing:.3g} mm apart")
    table.add_row("triangles", f"{len(made.faces):,}", "")
    table.add_row("extent", " × ".join(f"{size:.3f}" for size in made.extent), "m along x, y, z")
    ground = abs(float(made.pose.rotation[2, 2])) >= STEEP
    table.add_row("up", up, "of the file's axes" + (", assumed" if assumed else ""))
    widths = ", ".join(f"{1e3 * found.width:.0f}" for found in made.holes[:NAMED])
    more = ", …" if len(made.holes) > NAMED else ""
    told = f"wider than {1e3 * hole:g} mm" + (f": {widths}{more} mm" if widths else "")
    table.add_row("holes", str(len(made.holes)), told)
    out.print(table)
    out.print(f"pose {_pose(made.pose)}", markup=False, soft_wrap=True)
    if assumed and ground:
        out.print(
            f"warning: with {up} up this is ground, or a roof; of a wall that was seen along {up}, "
            "tell with --up which axis points up",
            markup=False,
        )
    if len(made.holes) > SIEVE:
        most = sorted(found.width for found in made.holes)[int(NINE_IN_TEN * len(made.holes))]
        out.print(
            f"warning: {len(made.holes)} holes leave hands little to hold: --hole "
            f"{math.ceil(1e3 * most) / 1e3:g} would bridge nine in ten",
            markup=False,
        )
    for each in made.filled:
        out.print(
            f"warning: {each.cells:,} points are at exactly {each.value:g} m, with cliffs around "
            "them; leave out cells that have no height",
            markup=False,
        )
    largest = scan_table().scalar("scan", "largest")
    if made.extent.max() > largest:
        out.print(
            f"warning: {made.extent.max():.4g} m across, and a hold may be {largest:g} m; "
            "is the unit right?",
            markup=False,
        )
    out.print(str(output), markup=False, soft_wrap=True)


def _pose(pose: Pose) -> str:
    place, turn = (
        ", ".join(f"{number:.6g}" for number in vector)
        for vector in (pose.position, pose.quaternion())
    )
    return f'{{"position": [{place}], "orientation": [{turn}]}}'
