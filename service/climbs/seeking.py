"""Search for a climb with its progress shown."""

from __future__ import annotations

from pathlib import Path

from planner import MadeWall, WallProgress, WallSource
from service import answering, requests, tables
from service.processes import make_wall
from service.replies import PartReply

__all__ = ["seek"]


def seek(
    request: requests.ClimbRequest,
    robots: answering.Robots,
    on: str,
    workers: int | None,
    folder: Path,
) -> answering.SoughtClimb:
    """Search for the climb of a request; show phase, best load factor, bound and gap.

    Parameters
    ----------
    request : ClimbRequest
    robots : Robots
    on : str
        Where the wall is made, as of `service.processes.make_wall`.
    workers : int or None
    folder : Path
        Keeps the finished chunks of walls, in a file for each rock and grid: a search that was
        broken off, or the next one on the same wall, goes on with them.
    """

    def make(source: WallSource, report: WallProgress) -> MadeWall:
        kept = folder / f"wall-{source.digest[:12]}.chunks"
        return make_wall(source, on, workers=workers, kept=kept, report=report)

    with tables.progress(f"a climb on {request.name}") as bar:

        def report(part: PartReply) -> None:
            now = part.progress
            if not now:
                return
            best = "none yet" if now.best is None else f"{now.best:.3f}"
            words = f"{now.phase}: best {best}"
            if now.bound is not None:
                words += f", bound {now.bound:.3f}"
            if now.gap is not None:
                words += f", gap {100.0 * now.gap:.0f} %"
            bar(now.done, max(now.total, 1), words)

        return answering.seek_climb(request, robots, report, make)
