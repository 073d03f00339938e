"""Page of holds that were found on rock: what places carry, and why others were refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hand_models.base import Pose
from hand_models.rock import Triangles
from planner.pages.documents import write_document
from planner.pages.plan_rows import PageTable
from planner.pages.scenes import Meshes, rock_stage

__all__ = ["PlaceGroup", "write_holds_page"]


class PlaceGroup(NamedTuple):
    """Places on rock that a page draws alike, or in the colours of their values.

    Attributes
    ----------
    name : str
        What they are.
    places : sequence of tuple of float
        Points on the rock [m].
    texts : sequence of str
        Text on hover of each.
    values : sequence of float, optional
        Value of each.
    label : str
        Meaning of the values, with their unit.
    """

    name: str
    places: Sequence[tuple[float, float, float]]
    texts: Sequence[str]
    values: Sequence[float] | None = None
    label: str = ""


def write_holds_page(
    rock: Triangles,
    groups: Sequence[PlaceGroup],
    table: PageTable,
    path: Path,
    title: str,
    said: Sequence[str],
) -> None:
    """Write holds on rock as a page: places by what they carry, refused ones by kind.

    Parameters
    ----------
    rock : Triangles
        Surface of the rock, in its frame, which has x up the rock and z into it [m].
    groups : sequence of PlaceGroup
        Holds with their values, and places without a hold, in that frame.
    table : PageTable
        Numbers of the holds.
    path : Path
        File of HTML to write.
    title : str
        Title of the page.
    said : sequence of str
        Sentences about the search, the result first.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    meshes, off = Meshes(), 0.01  # [m] from the rock, which would hide them
    drawn = [group._asdict() for group in groups]
    for group in drawn:
        places = group["places"]
        group["places"] = [[round(x, 4), round(y, 4), round(z - off, 4)] for x, y, z in places]
    tables = [table._asdict()] if table.rows else []
    more = {"status": "holds" if tables else "nothing holds", "sentence": said[0], "tables": tables}
    stage = rock_stage(rock, Pose.identity(), meshes, **more)
    data = {"stages": [stage], "meshes": meshes.packed, "groups": drawn, "said": said[1:]}
    write_document(title, data | {"frame": "the rock"}, path)
