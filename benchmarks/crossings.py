"""How many modules one plan passes, and how often it goes from one to another.

``python -m benchmarks.crossings``, from a checkout: of a new stance of a known shape, from the
bytes of its request to those of the reply. With ``--sequence`` every crossing, in its order. A
generator that goes on counts as entered again.
"""

from __future__ import annotations

import argparse
import sys
import threading
from collections import Counter
from types import FrameType
from typing import Any, NamedTuple

import msgspec

from service.answering import dispatch
from service.wire import PLAN
from tests.suite.helpers.requests import wall_request

OWN = ("hand_models.", "planner.", "service.")


class Crossing(NamedTuple):
    """A call from one module into another; ``beside``: in the thread beside the solver."""

    caller: str
    module: str
    function: str
    beside: bool


class Watch:
    """Counts the calls of each module, and all calls from one into another, of all threads."""

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
            beside = threading.current_thread() is not threading.main_thread()
            self.crossings.append(Crossing(before, name, frame.f_code.co_name, beside))


def plan_on(diameter: float, watch: Watch) -> None:
    """Plan a stance on logs of this diameter, and watch that alone."""
    request = wall_request()
    for hand in request["stance"]["hands"]:
        hand["hold"]["diameter"] = diameter
    payload = msgspec.json.encode(request)
    watch.clear()
    sys.setprofile(watch)
    try:
        answer = dispatch.handle(PLAN, payload)
    finally:
        sys.setprofile(None)
    assert answer.good, answer


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sequence", action="store_true", help="print every crossing")
    asked, watch = parser.parse_args(), Watch()
    # of the thread beside the solver, which the first plan begins
    threading.setprofile(watch)
    for warm in range(5):
        plan_on(0.3 + 1e-4 * warm, watch)
    beside = sum(crossing.beside for crossing in watch.crossings)
    print(f"{len(watch.modules)} modules, {len(watch.crossings)} crossings between them,")
    print(f"{beside} of them beside the solver; {watch.modules.total()} calls")
    entered = Counter(crossing.module for crossing in watch.crossings)
    for name, count in entered.most_common(None if asked.sequence else 12):
        print(f"{count:5} {name}")
    for crossing in watch.crossings if asked.sequence else ():
        print(f"{crossing.caller:44} -> {crossing.module}.{crossing.function}")


if __name__ == "__main__":
    main()
