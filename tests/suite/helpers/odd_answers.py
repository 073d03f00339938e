"""What stands for the planner in a service's processes: it does what the question says."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

from service.processes import Job
from service.wire import Answer


def obedient() -> Callable[[Job], Answer]:
    """Called in each process."""

    def answer(job: Job) -> Answer:
        asked = json.loads(job.payload)
        start = time.perf_counter()
        if "sleep" in asked:
            time.sleep(asked["sleep"])
        while "until" in asked and not Path(asked["until"]).exists():
            time.sleep(0.01)
        if "signal" in asked:
            os.kill(os.getpid(), asked["signal"])
        if "eat" in asked:
            kept = bytearray(asked["eat"])
            kept[::4096] = bytes(len(kept[::4096]))
        reply = {"pid": os.getpid(), "echo": asked.get("echo"), "size": len(job.payload)}
        reply["rehearsal"] = job.rehearsal
        payload = json.dumps(reply).encode() + b" " * asked.get("pad", 0)
        return Answer(payload, "application/json", seconds=time.perf_counter() - start)

    return answer


def never_ready() -> Callable[[Job], Answer]:
    """Called in each process, which does not live to be ready."""
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError
