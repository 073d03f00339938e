"""What stands for the search for climbs in a service's processes: it does what a name says."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import planner
from service.answering import climbs
from service.answering.own_models import Robots
from service.processes import Job, answering, questions
from service.replies import ClimbReply, PartReply, SearchProgress
from service.requests import ClimbEnd, ClimbRequest
from service.wire import Answer


def asked(**does: object) -> ClimbRequest:
    """Return a request for which the search does so: ``parts``, ``until``, ``signal``."""
    start, goal = ClimbEnd(height=0.5), ClimbEnd(height=2.5)
    name = json.dumps(does)
    return ClimbRequest(v=1, name=name, rock="leaning-wall", start=start, goal=goal)


def searching() -> Callable[[Job], Answer]:
    """Called in each process: all but the search is the service's own; libraries load late."""
    climbs.answer_climb = _answer
    questions.import_module = lambda *_: None
    return answering(None, None)


def progress(number: int) -> SearchProgress:
    return SearchProgress(
        phase="search",
        best=0.5 + 0.1 * number,
        bound=2.0 - 0.1 * number,
        gap=None,
        done=number,
        total=0,
        seconds=0.01 * number,
    )


def _answer(
    request: ClimbRequest,
    robots: Robots,
    report: Callable[[PartReply], None] | None = None,
) -> ClimbReply:
    does = json.loads(request.name)
    for number in range(does.get("parts", 0)):
        if report is not None and request.parts:
            report(PartReply(id=request.id, progress=progress(number)))
    if "signal" in does:
        os.kill(os.getpid(), getattr(signal, does["signal"]))
    while "until" in does and not Path(does["until"]).exists():
        planner.deadline.check("the file was there")
        time.sleep(0.01)
    time.sleep(does.get("sleep", 0.0))
    return ClimbReply(
        id=request.id,
        name=request.name,
        robot="robosimian",
        status="none",
        least=None,
        bound=0.9,
        gap=None,
        deciding=None,
        raises=[],
        refused=[],
        about="nothing",
        route=None,
        stages=[],
        knots=None,
        placements=0,
        bodies=0,
        programs=os.getpid(),
        seconds={"search": 0.1},
    )
