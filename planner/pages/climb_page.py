"""Page of a search for a climb: its stages on the whole rock, the placements, and the bound."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hand_models.base import Pose
from hand_models.rock import Mesh
from planner.climbs import FoundClimb
from planner.pages.documents import write_document
from planner.pages.route_page import shown_stages
from planner.pages.scenes import Meshes
from planner.pictures import PICTURE_SETTINGS, DrawnSurface, coarse
from planner.programs import WRENCH_UNIT

__all__ = ["write_climb_page"]


def write_climb_page(
    found: FoundClimb, rock: Mesh, rock_pose: Pose, path: Path, title: str, said: Sequence[str] = ()
) -> None:
    """Write a climb as a page: stages on the rock, what each placement carries, and the bound.

    Parameters
    ----------
    found : FoundClimb
        With a climb or without; then the page has the rock and the placements.
    rock : Mesh
        Its frame has x up the rock and z into it.
    rock_pose : Pose
        Of that frame in W.
    path : Path
        File of HTML to write.
    title : str
        Title of the page.
    said : sequence of str, optional
        Sentences of the verdict.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    meshes, wall = Meshes(), found.wall
    up, across, into = rock_pose.rotation.T
    drawn = rock.triangles
    if len(drawn.faces) > PICTURE_SETTINGS.wall_triangles:
        extent = float(np.ptp(drawn.vertices, axis=0).max())
        drawn = coarse(drawn, extent / PICTURE_SETTINGS.wall_cells)
    surface = DrawnSurface("rock", "", rock_pose.apply(drawn.vertices), drawn.faces)
    meshes.rock = meshes.of(surface, into)
    if found.result is None:
        eyes = {"oblique": 0.6 * across - 0.8 * into, "facing the rock": -into}
        views = {name: {"eye": eye.tolist(), "up": up.tolist()} for name, eye in eyes.items()}
        empty: dict[str, Any] = {"lines": [], "dots": [], "arrows": [], "labels": [], "tiles": []}
        scene = empty | {"surfaces": [meshes.rock], "views": views}
        stages: list[dict[str, Any]] = [
            {"name": "", "status": found.status, "sentence": "", "scene": scene}
        ]
    else:
        stages = shown_stages(found.result, meshes)
    lifts = wall.screening.hands.supports(np.eye(6)[2:3])[:, 0] * WRENCH_UNIT[2]
    bounded = math.isfinite(found.bound)
    shown = {
        "places": [each.pose.position.round(4).tolist() for each in wall.places],
        "carried": lifts.round(1).tolist(),
        "bodies": [each.position.round(4).tolist() for each in wall.bodies],
        "bound": found.bound if bounded else None,
        "said": list(said),
    }
    data = {"stages": stages, "meshes": meshes.packed, "wall": shown}
    if found.deciding is not None:
        data["crux"] = found.deciding.stage
    write_document(title, data, path)
