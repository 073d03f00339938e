"""How many modules one plan passes, and how often it goes from one to another.

``python -m benchmarks.crossings``, from a checkout. Of a new stance of a shape that is known,
from the closed hands on.
"""

from __future__ import annotations

import sys
import threading
from collections import Counter
from types import FrameType
from typing import Any, NamedTuple

from hand_models.rock import Cylinder
from planner.prepare.settled_stance import settle_stance
from planner.question import Load
from planner.solving import plan
from tests.suite.helpers.stances import PLACES, ask, on_wall

OWN = ("hand_models.", "planner.", "service.")


class Passed(NamedTuple):
    """What one plan passes: calls of each module, and of each pair of caller and module."""

    modules: Counter[str]
    crossings: Counter[tuple[str, str]]


def passed(diameter: float) -> Passed:
    """Plan a stance on logs of this diameter, and watch."""
    light = Load(mass=60.0)  # it holds: what does not is explained, too
    question = ask(on_wall(Cylinder(diameter), limbs=tuple(PLACES)), load=light)
    settle_stance(question.stance)
    found = Passed(Counter(), Counter())

    closed = False

    def watch(frame: FrameType, event: str, _: Any) -> None:
        nonlocal closed
        name = frame.f_globals.get("__name__", "")
        closed |= event == "return" and frame.f_code is settle_stance.__code__
        if event != "call" or not closed or not name.startswith(OWN):
            return
        found.modules[name] += 1
        caller = frame.f_back
        while caller is not None and not caller.f_globals.get("__name__", "").startswith(OWN):
            caller = caller.f_back
        before = "" if caller is None else caller.f_globals["__name__"]
        if before != name:
            found.crossings[before, name] += 1

    threading.setprofile(watch)
    sys.setprofile(watch)
    try:
        plan(question)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]
    return found


def main() -> None:
    for warm in range(4):
        passed(0.3 + 1e-4 * warm)
    found = passed(0.31)
    print(f"{len(found.modules)} modules, {found.crossings.total()} crossings between them,")
    print(f"{len(found.crossings)} of them distinct; {found.modules.total()} calls")
    for name, count in found.modules.most_common(12):
        print(f"{count:5} {name}")


if __name__ == "__main__":
    main()
