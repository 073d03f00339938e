"""Define ``crux rock``: make a triangle mesh of a scan, write it, and print its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import click
from click.core import ParameterSource

from hand_models import parameters, scans
from hand_models.base import Array, InvalidInputError, Pose
from service import tables
from service.commands import options
from service.commands.declaring import argument, command, group, option

__all__ = ["rock_command"]

SCAN_NUMBERS: Final = parameters.scan_table()


def _triple(_: click.Context, __: click.Parameter, text: str | None) -> tuple[float, ...] | None:
    """Return three numbers with commas between them."""
    if text is None:
        return None
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise click.BadParameter(f"must be three numbers separated by commas, got {text!r}")
    return numbers


def _point_option(words: str) -> Any:
    """Return an option whose value is three numbers."""
    return option(words, callback=_triple, usage="X,Y,Z")


@command("rock", epilog=f"FILE ends in {', '.join(scans.SCAN_ENDINGS)}.")
def rock_command(
    file: Path = argument(options.ANY_PATH),
    output: Path = option(
        "Where the triangles go.",
        options.OutputFile(".ply"),
        usage="-o --output PLY",
        required=True,
    ),
    reading: dict[str, Any] = group(
        dict,
        unit=option("Of the file's numbers.", click.Choice(list(scans.UNIT_METRES)), default="m"),
        width=option(
            "In place of a unit: scale it so that its longest side is W [m].", float, usage="W"
        ),
        cell=option(
            "Distance between neighbours of a grid, in the file's unit; by default the file's own.",
            float,
        ),
        up=option(
            "The file's axis that points up; of a wall that was seen along z another is to be "
            "given.",
            click.Choice(list(scans.UP_ROTATIONS)),
            default="z",
        ),
        view=_point_option(
            "In which direction the scanner looked, in the file's axes; by default where the "
            "points vary least, away from the viewpoint; down a grid's heights; into triangles."
        ),
        viewpoint=_point_option(
            "In place of a view: where the scanner was, in the file's axes and unit; by default "
            "what a PCD file says, else the file's origin, unless that is too far away or too "
            "near."
        ),
        origin=_point_option(
            "Where the hold's frame begins, in the file's axes and unit; by default in the middle."
        ),
    ),
    spacing: float | None = option(
        "Keep one point a square of that side across the view [m]; by default half the points' "
        "median distance, or as much more as leaves "
        f"{SCAN_NUMBERS.scalar('mesh', 'vertices'):,.0f}, up to "
        f"{SCAN_NUMBERS.scalar('mesh', 'spacing'):g}, or if that is not enough, as leaves "
        f"{SCAN_NUMBERS.scalar('mesh', 'most'):,.0f}.",
        float,
    ),
    hole: float = option(
        "The widest hole, and the highest step, that is bridged [m].",
        float,
        default=SCAN_NUMBERS.scalar("mesh", "hole"),
    ),
    std_ratio: float | None = option(
        "Drop stray points (statistical outlier removal): those whose mean distance to their "
        "neighbours is above the mean by more than R standard deviations; 1 to 3 are usual.",
        float,
        usage="R",
    ),
    neighbours: int | None = option(
        "Whose mean distance that is; by default "
        f"{SCAN_NUMBERS.scalar('outliers', 'neighbours'):g}.",
        int,
    ),
    picture: Path | None = options.plot_option("Draw the rock there, as the scanner saw it."),
    as_json: bool = options.json_option,
) -> None:
    """Make a mesh hold of a scan: points, a grid of heights, or triangles.

    The triangles are in a frame on the rock, z into it along the view and x up, which is a hold's
    own; the table has its pose in the file's axes, turned so that z is up, in metres.
    """
    if reading["view"] is not None and reading["viewpoint"] is not None:
        raise InvalidInputError("give a view or a viewpoint, not both", field="view")
    if neighbours is not None and std_ratio is None:
        raise InvalidInputError(
            "requires --std-ratio; give it, or leave --neighbours out", field="neighbours"
        )
    if output.exists() and file.exists() and output.samefile(file):
        raise InvalidInputError(f"{output} is the scan itself; name another", field="--output")
    tables.write_alone(output)
    with tables.progress(f"meshing {file.name}") as report:
        scan = scans.read_scan(file, **reading)
        if std_ratio is not None:
            scan = scans.drop_outliers(scan, std_ratio, neighbours=neighbours)
        made = scans.mesh_scan(scan, spacing=spacing, hole=hole, report=report)
        with tables.writing(output, "--output"):
            scans.write_rock(made, output)
        if picture is not None:
            with tables.writing(picture):
                scans.plot_rock(made, picture, file.name)
        warnings = _warnings(scan, made, hole, spacing, reading)
    source = click.get_current_context().get_parameter_source("up")
    assumed = source is not ParameterSource.COMMANDLINE
    if as_json:
        assumptions = {"up": reading["up"], "up_assumed": assumed, "view_assumed": _assumed(scan)}
        tables.say(_summary(made) | assumptions | {"warnings": warnings, "file": str(output)})
        return
    closed = scan.faces is not None and scan.shown() is None
    # the vertical component of the view
    steep = abs(float(made.pose.rotation[2, 2])) >= 0.9
    if assumed and not closed and steep:
        warnings.insert(
            0,
            f"with {reading['up']} up this is ground, or a roof; of a wall that was seen along "
            f"{reading['up']}, tell with --up which axis points up",
        )
    out = tables.console()
    rows = _rows(scan, made, hole, reading["up"], assumed)
    tables.print_rows(rows, tables.in_order([""], [""], [""]), out, heads=False)
    out.print(f"pose {_pose(made.pose)}", soft_wrap=True)
    tables.print_warnings(warnings, out)
    out.print(str(output), soft_wrap=True)


def _assumed(scan: scans.Scan) -> bool:
    """Return True if the view is assumed: neither the scan nor its triangles give it."""
    return scan.assumed and scan.view is None and (scan.faces is None or scan.shown() is None)


def _summary(made: scans.ScannedRock) -> dict[str, Any]:
    """Return the result as JSON values; the pose has the form of a request's."""
    return {
        "read": made.read,
        "dropped": made.dropped,
        "outliers": made.outliers,
        "alone": made.alone,
        "triangles_kept": made.kept,
        "vertices": len(made.vertices),
        "triangles": len(made.faces),
        "spacing": made.spacing,
        "covered": made.covered,
        "extent": made.extent.tolist(),
        "view": made.pose.rotation[:, 2].tolist(),
        "holes": [{"width": hole.width, "place": hole.place.tolist()} for hole in made.holes],
        "steps": [{"height": step.height, "place": step.place.tolist()} for step in made.steps],
        "filled": [
            {"axis": "xyz"[each.axis], "value": each.value, "points": each.cells}
            for each in made.filled
        ],
        "pose": {
            "position": made.pose.position.tolist(),
            "orientation": made.pose.quaternion().tolist(),
        },
    }


def _warnings(
    scan: scans.Scan,
    made: scans.ScannedRock,
    hole: float,
    spacing: float | None,
    reading: Mapping[str, Any],
) -> list[str]:
    """Return warnings of what may not be meant, with the cause if it is known."""
    found = []
    if made.turned:
        found.append(
            "the triangles showed their backs to that view, and were turned over: is it meant?"
        )
    found += _open_warnings(scan, made, hole, spacing)
    found += [
        f"{each.cells:,} points are at exactly {each.value:g} m, with cliffs around them; leave "
        "out cells that have no height"
        for each in made.filled
    ]
    if not made.filled and made.extent.max() > SCAN_NUMBERS.scalar("scan", "largest"):
        found.append(_why_large(made))
    if small := scans.too_small(float(made.extent.max()), reading["unit"]):
        found.append(small)
    return [*found, *_far_away(made.pose)]


def _open_warnings(
    scan: scans.Scan, made: scans.ScannedRock, hole: float, spacing: float | None
) -> Iterator[str]:
    """Yield a warning of what is open between the points, with its cause and what was tried."""
    open_ = len(made.holes) + len(made.steps)
    pieces = made.covered < SCAN_NUMBERS.scalar("mesh", "least_covered")
    many = pieces or open_ > SCAN_NUMBERS.scalar("mesh", "many_holes")
    # so many are no exception
    strays = made.gaps is not None and 0 < 10 * made.alone <= len(made.gaps.points)
    if not (many or (strays and open_)):
        return
    if scan.heights and pieces and not strays and made.alone:
        yield (
            f"{made.alone:,} of {made.read:,} cells differ by more than {1e3 * hole:g} mm from "
            "all others beside them: is the cell in degrees, or in another unit than the heights?"
        )
        return
    some = [tables.counted(open_, "hole or step", "holes and steps")] if open_ else []
    if many and made.covered < 0.99:
        gaps = f"gaps over {100.0 * (1.0 - made.covered):.0f} % of the outline"
        wide = 0.0 if made.gaps is None else made.gaps.gap(hole)
        # so much farther apart than points at random, of which that is four times the distance
        if pieces and 5.0 * made.spacing < wide < 0.25 * made.extent.max():
            apart = f"{1e3 * made.spacing:.2g} mm apart"
            gaps += f" (points are {apart}, in lines or patches {1e3 * wide:.0f} mm apart)"
        some.append(gaps)
    found = " and ".join(some) + (" leave hands little to hold" if many else " left open")
    if strays:
        points = tables.counted(made.alone, "point")
        found = f"{points} before or behind the rock, joined to nothing, may be stray; {found}"
    advice = _advice(scan, made, hole, spacing)
    # what few such points leave open where none of the options helps are edges of the rock
    if many or advice.startswith(":"):
        yield found + advice


def _far_away(pose: Pose) -> Iterator[str]:
    """Yield advice about a pose that no request may have, as in map coordinates."""
    import numpy as np

    farthest = SCAN_NUMBERS.scalar("scan", "farthest")
    place = pose.position
    if np.abs(place).max() <= farthest:
        return
    start = np.where(np.abs(place) > farthest, np.round(place, -3), 0.0)
    yield (
        f"the pose is more than {farthest:,.0f} m from the file's origin, and a request's "
        f"positions go no farther: let the stance's world begin at ({_numbers(start, 0)}), and "
        "subtract that from all its positions; there the pose is "
        f"{_pose(Pose(place - start, pose.rotation))}"
    )


def _advice(scan: scans.Scan, made: scans.ScannedRock, hole: float, spacing: float | None) -> str:
    """Return in words which option leaves fewer holes, by trial, or that none does."""
    if made.kept:
        return ": fill them where the triangles were made"
    found = scans.remedy(scan, made, hole, spacing=spacing)
    if found is None:
        widest = SCAN_NUMBERS.scalar("mesh", "widest_bridge")
        return (
            f"; neither dropping stray points nor a --hole up to {widest:g}, nor both, helps: "
            "rock is to be scanned more closely, or from another side"
        )
    how = {"std_ratio": "without stray points, --std-ratio", "hole": "with --hole"}[found.option]
    if found.std_ratio is not None:
        how = f"without stray points, --std-ratio {found.std_ratio:g}, and {how}"
    left = "1 hole or step" if found.left == 1 else f"{found.left} holes and steps"
    if found.covered < 0.99:
        left += f", and gaps over {100.0 * (1.0 - found.covered):.0f} % of the outline,"
    return f": {how} {found.value:g}, {left} {'is' if found.left == 1 else 'are'} left"


def _why_large(made: scans.ScannedRock) -> str:
    """Return in words why the rock may be larger than a hold may be."""
    import numpy as np

    # a few stray points may reach farther
    low, high = 1.0, 99.0
    size, largest = float(made.extent.max()), SCAN_NUMBERS.scalar("scan", "largest")
    bulk = float(np.ptp(np.percentile(made.vertices, (low, high), axis=0), axis=0).max())
    if bulk <= largest:
        return (
            f"{size:.4g} m across, and a hold may be {largest:g} m; {high - low:g} in a "
            f"hundred points are within {bulk:.3g} m: drop the stray ones (--std-ratio)"
        )
    return scans.too_large(size)


def _rows(
    scan: scans.Scan, made: scans.ScannedRock, hole: float, up: str, assumed: bool
) -> list[tuple[str, str, str]]:
    """Return how many points and triangles there are, how large the rock is, and what is open."""
    view = ", ".join(f"{size:z.2f}" for size in made.pose.rotation[:, 2])
    whence = "z up"
    if _assumed(scan):
        before = (scan.points.mean(axis=0) - scan.viewpoint) @ made.pose.rotation[:, 2]
        origin = f"from the file's origin, {before:.2g} m before the rock"
        whence += ", assumed: " + (origin if scan.faces is None else "from above")
    beside = made.read - made.dropped - made.outliers - made.alone - len(made.vertices)
    rows = [
        ("points read", f"{made.read:,}", ""),
        ("dropped", f"{made.dropped:,}", "not finite, or several at (0, 0, 0)"),
        ("outliers", f"{made.outliers:,}", "dropped, far from their neighbours"),
        ("alone", f"{made.alone:,}", "left out, joined to nothing, maybe stray"),
        ("passed over", f"{beside:,}", "close to others, or in open gaps"),
        ("kept", f"{len(made.vertices):,}", f"{1e3 * made.spacing:.3g} mm apart"),
        ("triangles", f"{len(made.faces):,}", "the file's own" if made.kept else ""),
        ("extent", " × ".join(f"{size:.3f}" for size in made.extent), "m along x, y, z"),
        ("up", up, "of the file's axes" + (", assumed" if assumed else "")),
        ("view", view, whence),
        ("holes", *_sizes("wider", [each.width for each in made.holes], hole)),
        ("steps", *_sizes("higher", [each.height for each in made.steps], hole)),
    ]
    absent = {"outliers": not made.outliers, "alone": not made.alone}
    absent["passed over"] = made.kept or not beside
    return [row for row in rows if not absent.get(row[0])]


def _sizes(what: str, sizes: list[float], hole: float) -> tuple[str, str]:
    """Return how many holes or steps there are, and how large the first of them."""
    most = 5
    named = ", ".join(f"{1e3 * size:.0f}" for size in sizes[:most])
    more = ", …" if len(sizes) > most else ""
    return str(len(sizes)), f"{what} than {1e3 * hole:g} mm" + (
        f": {named}{more} mm" if named else ""
    )


def _pose(pose: Pose) -> str:
    # so many decimals that a point at 10 m is off by some micrometres
    place, turn = _numbers(pose.position, 6), _numbers(pose.quaternion(), 7)
    return f'{{"position": [{place}], "orientation": [{turn}]}}'


def _numbers(vector: Array, digits: int) -> str:
    return ", ".join(f"{number:z.{digits}f}" for number in vector)
