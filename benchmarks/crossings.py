"""How many modules one plan passes, and how often it goes from one to another, bytes to bytes.

``python -m benchmarks.crossings``, from a checkout: of a new stance of a known shape, from the
bytes of its request to those of the reply, in a process that has answered before. With
``--sequence`` every crossing, in its order. A generator that goes on counts as entered again.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from types import FrameType
from typing import Any, NamedTuple

import msgspec

from service.answering import handle
from service.wire import ServiceName
from tests.suite.helpers.requests import wall_request

OWN = ("hand_models.", "planner.", "service.")

MASS = 60.0
"""Of the robot [kg]: it holds, and what does not is explained, too."""


class Crossing(NamedTuple):
    """A call from one module into another."""

    caller: str
    module: str
    function: str


class Watch:
    """Counts the calls of each module, and all calls from one into another."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget all calls."""
        self.modules: Counter[str] = Counter()
        self.crossings: list[Crossing] = []

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        name = frame.f_globals.get("__name__", "")
        if event != "call" or not name.startswith(OWN):
            return
        self.modules[name] += 1
        caller = frame.f_back
        while caller is not None and not caller.f_globals.get("__name__", "").startswith(OWN):
            caller = caller.f_back
        before = "" if caller is None else caller.f_globals["__name__"]
        if before != name:
            self.crossings.append(Crossing(before, name, frame.f_code.co_name))


def plan_on(diameter: float, watch: Watch) -> None:
    """Plan a stance on logs of this diameter [m], and watch that alone."""
    request = wall_request(MASS)
    for hand in request["stance"]["hands"]:
        hand["hold"] = {"shape": "cylinder", "diameter": diameter}
    payload = msgspec.json.encode(request)
    watch.clear()
    sys.setprofile(watch)
    try:
        answer = handle(ServiceName.PLAN, payload)
    finally:
        sys.setprofile(None)
    assert answer.status == "optimal", answer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sequence", action="store_true", help="print every crossing")
    asked, watch = parser.parse_args(), Watch()
    for warm in range(5):
        plan_on(0.3 + 1e-4 * warm, watch)
    print(f"{len(watch.modules)} modules, {len(watch.crossings)} crossings between them,")
    print(f"{watch.modules.total()} calls")
    entered = Counter(crossing.module for crossing in watch.crossings)
    for name, count in entered.most_common(None if asked.sequence else 12):
        print(f"{count:5} {name}")
    for crossing in watch.crossings if asked.sequence else ():
        print(f"{crossing.caller:44} -> {crossing.module}.{crossing.function}")


if __name__ == "__main__":
    main()
