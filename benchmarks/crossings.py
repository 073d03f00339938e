"""How many modules one plan passes, and how often it goes from one to another, bytes to bytes.

``python -m benchmarks.crossings``, from a checkout. From the bytes of a request for a new stance,
of a shape that is known, to the bytes of its reply, in a process that has answered before.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from types import FrameType
from typing import Any, NamedTuple

import msgspec

from service.answering import handle
from service.wire import PLAN
from tests.suite.helpers.requests import wall_request

OWN = ("hand_models.", "planner.", "service.")

MASS = 60.0
"""Of the robot [kg]: it holds, and what does not is explained, too."""


class Passed(NamedTuple):
    """What one plan passes: calls of each module, and of each pair of caller and module."""

    modules: Counter[str]
    crossings: Counter[tuple[str, str]]


def own_name(frame: FrameType | None) -> str:
    """Name of the project's module that a frame is of, or nearest below it; none elsewhere."""
    while frame is not None and not frame.f_globals.get("__name__", "").startswith(OWN):
        frame = frame.f_back
    return "" if frame is None else frame.f_globals["__name__"]


def passed(diameter: float) -> Passed:
    """Plan a stance on logs of this diameter [m], and watch."""
    request = wall_request(MASS)
    for hand in request["stance"]["hands"]:
        hand["hold"] = {"shape": "cylinder", "diameter": diameter}
    payload = msgspec.json.encode(request)
    found = Passed(Counter(), Counter())

    def watch(frame: FrameType, event: str, _: Any) -> None:
        name = frame.f_globals.get("__name__", "")
        if event != "call" or not name.startswith(OWN):
            return
        found.modules[name] += 1
        before = own_name(frame.f_back)
        if before != name:
            found.crossings[before, name] += 1

    threading.setprofile(watch)
    sys.setprofile(watch)
    try:
        answer = handle(PLAN, payload)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]
    assert answer.status == "optimal"
    return found


def main() -> None:
    for warm in range(4):
        passed(0.3 + 1e-4 * warm)
    found = passed(0.31)
    print(f"{len(found.modules)} modules, {found.crossings.total()} crossings between them,")
    print(f"{len(found.crossings)} of them distinct; {found.modules.total()} calls")
    for (before, name), count in found.crossings.most_common(20):
        print(f"{count:5} {before or 'the caller'} → {name}")


if __name__ == "__main__":
    main()
