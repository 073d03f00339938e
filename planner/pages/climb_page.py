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
from planner.pages.advice_data import raise_data
from planner.pages.documents import write_document
from planner.pages.route_page import shown_stages
from planner.pages.scenes import Meshes, rock_stage
from planner.programs import WRENCH_UNIT
from planner.result import Plan

__all__ = ["write_climb_page"]


def write_climb_page(
    found: FoundClimb,
    rock: Mesh,
    rock_pose: Pose,
    path: Path,
    title: str,
    said: Sequence[str] = (),
    sure: Sequence[str] = (),
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
    sure : sequence of str, optional
        Sentences that say how sure the plan of the stage that decides is.

    Raises
    ------
    UnsupportedError
        If plotly is not installed.
    """
    meshes, wall = Meshes(), found.wall
    stages = [rock_stage(rock.triangles, rock_pose, meshes, status=found.status)]
    if found.result is not None:
        stages = shown_stages(found.result, meshes)
    lifts = wall.screening.hands.supports(np.eye(6)[2:3])[:, 0] * WRENCH_UNIT[2]
    groups: list[dict[str, Any]] = [
        {
            "name": "placements",
            "places": [each.pose.position.round(4).tolist() for each in wall.places],
            "values": lifts.round(1).tolist(),
            "label": "largest force upward [N]",
            "template": "placement %{pointNumber}<br>carries %{marker.color:.0f} N upward at most",
        },
        {
            "name": "poses of the body",
            "places": [each.position.round(4).tolist() for each in wall.bodies],
        },
    ]
    bounded = math.isfinite(found.bound)
    data = {
        "stages": stages,
        "meshes": meshes.packed,
        "groups": groups,
        "margin": "load factor",
        "bound": found.bound if bounded else None,
        "said": [*said, *meshes.said],
    }
    if found.deciding is not None and found.result is not None:
        data["crux"] = k = found.deciding.stage
        plan, stage = found.result.plans[k], found.result.stages[k]
        assert isinstance(plan, Plan)  # with a load factor
        more = {"sure": list(sure), "advice": raise_data(plan, stage.question, found)}
        stages[k] = stages[k] | more
    write_document(title, data, path)
