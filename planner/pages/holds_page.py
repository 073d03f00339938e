"""Page of holds that were found on rock: what places carry, and why others were refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hand_models.base import Pose
from hand_models.rock import Triangles
from planner.pages.documents import write_document
from planner.pages.plan_rows import PageTable
from planner.pages.scenes import Meshes, rock_data, rock_stage

__all__ = ["write_holds_page"]

Point = tuple[float, float, float]


def write_holds_page(
    rock: Triangles,
    holds: Sequence[tuple[Point, float, str]],
    refused: Mapping[str, Sequence[tuple[Point, str]]],
    label: str,
    table: PageTable,
    path: Path,
    title: str,
    said: Sequence[str] = (),
) -> None:
    """Write holds on rock as a page: places by what they carry, refused ones by kind.

    Parameters
    ----------
    rock : Triangles
        Surface of the rock, in its frame, which has x up the rock and z into it [m].
    holds : sequence of (tuple of three numbers, float, str)
        Point on the rock [m], value, and text on hover, of the best hand at each point.
    refused : mapping of str to sequence of (tuple of three numbers, str)
        Points without a hold [m], with their text on hover, by the kind of reason.
    label : str
        Meaning of the values, with their unit.
    table : PageTable
        Numbers of the holds.
    path : Path
        File of HTML to write.
    title : str
        Title of the page.
    said : sequence of str, optional
        Sentences about the search, the result first.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    meshes = Meshes()
    surface, views = rock_data(rock, Pose.identity(), meshes)
    groups: list[dict[str, Any]] = []
    if holds:
        groups.append(_group("holds", holds) | {"values": [each[1] for each in holds]})
        groups[0]["label"] = label
    groups += [_group(kind, points) for kind, points in refused.items()]
    tables = [table._asdict()] if table.rows else []
    status = "holds" if holds else "nothing holds"
    sentence = " ".join(said[:1])
    stage = rock_stage(surface, views, status=status, sentence=sentence, tables=tables)
    data = {"stages": [stage], "meshes": meshes.packed, "groups": groups, "said": said[1:]}
    write_document(title, data | {"frame": "the rock"}, path)


def _group(name: str, points: Sequence[tuple[Any, ...]]) -> dict[str, Any]:
    """Return points, which come first, with their texts, which come last, as a page's group."""
    off = 0.01  # [m] from the rock, which would hide them
    places = [[round(x, 4), round(y, 4), round(z - off, 4)] for (x, y, z), *_ in points]
    return {"name": f"{name} ({len(points)})", "places": places, "texts": [p[-1] for p in points]}
