"""Write the files of a planned route, and those of a search for a climb."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import msgspec

import planner
from hand_models.base import Array, whole_file
from hand_models.scans import write_rock
from service import answering, bulk, replies, requests

if TYPE_CHECKING:
    from service.answering import SoughtClimb

__all__ = ["SEARCH_FILES", "write_route", "write_search", "write_stance"]

SEARCH_FILES: Final = {
    "wall": "wall.npz",
    "picture of the wall": "wall.png",
    "rock": "rock.ply",
    "certificate": "certificate.npz",
    "route": "route.json",
    "compliant route": "compliant.json",
}
"""Names of the files of a search, of which those are written that there are."""

StageRequest = Callable[
    [planner.RouteStage, Mapping[str, Array] | None, Path], requests.PlanRequest
]
"""Returns the plan request of a stage at joint angles, for a file in a folder."""


def write_route(
    result: planner.RouteResult,
    climb: planner.Climb | None,
    folder: Path,
    request_of: StageRequest,
) -> tuple[dict[str, Path], str | None]:
    """Write report, pictures, trajectory and stances of a route.

    Return the files by name, and the digest of the trajectory; None without one.

    Parameters
    ----------
    result : RouteResult
    climb : Climb or None
    folder : Path
        Created if missing.
    request_of : callable
        Returns the request of a stage.
    """
    knots = [] if climb is None else [replies.KnotReply.of(knot) for knot in climb.knots]
    trajectory, digest = bulk.write_trajectory(knots, folder), None
    if climb is not None and knots:
        digest = bulk.trajectory_digest(folder, climb.rates)
    files = planner.write_report(result, folder, climb, digest) | trajectory
    files["stances"] = _write_stages(result, folder / "stages", request_of)
    return files, digest


def _write_stages(result: planner.RouteResult, folder: Path, request_of: StageRequest) -> Path:
    """Write each stage as a stance of its own; return the folder."""
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.json"):
        if old.name.partition("-")[0].isdecimal():
            old.unlink()
    for stage, answer in zip(result.stages, result.plans, strict=True):
        name = "-".join(filter(None, (f"{stage.index:02d}", stage.phase, stage.limb)))
        write_stance(request_of(stage, answer.joints, folder), folder / f"{name}.json")
    return folder


def write_stance(request: requests.PlanRequest | requests.RouteRequest, file: Path) -> None:
    """Write a request as a file of JSON."""
    with whole_file(file) as part:
        part.write_bytes(msgspec.json.format(msgspec.json.encode(request)))


def write_search(
    request: requests.ClimbRequest, sought: SoughtClimb, folder: Path
) -> dict[str, Path]:
    """Write wall, certificate, picture and route of a search; return the files by name.

    The route names the file of the rock, which is written beside it.

    Parameters
    ----------
    request : ClimbRequest
    sought : SoughtClimb
    folder : Path
        Existing, without files of an earlier search (`ClimbFolder.filling`).
    """
    found, wall = sought.found, sought.made.wall
    files = {name: folder / own for name, own in SEARCH_FILES.items()}
    planner.write_wall(wall, files["wall"], request.name)
    planner.plot_wall(found, sought.rock, sought.rock_pose, files["picture of the wall"])
    if found.found.proof is None:
        del files["certificate"]
    else:
        planner.climb_certificate(wall, sought.start, sought.goal, found.found).write(
            files["certificate"]
        )
    compliant = None if found.compliant is None else found.compliant.route
    routes = {"route": found.route, "compliant route": compliant}
    if found.route is None:
        for name in ("rock", *routes):
            del files[name]
        return files
    write_rock(sought.rock.triangles, files["rock"])
    pose = answering.pose_of_request(sought.rock_pose)
    rocks = {"rock": requests.MeshMessage(file=files["rock"].name, pose=pose)}
    for name, route in routes.items():
        if route is None:
            del files[name]
            continue
        given = answering.route_request(request, route)
        stance = msgspec.structs.replace(given.stance, rocks=rocks)
        write_stance(msgspec.structs.replace(given, stance=stance), files[name])
    return files
