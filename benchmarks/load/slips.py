"""How long a loaded service takes to give set-points after slips."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.load.asking import STREAM, Client, percentile
from planner import LostTile
from service.answering import dispatch
from service.commands.stances import read_request
from service.replies import SetPointsReply, StreamReply
from service.requests import SetPointsRequest, StreamRequest
from service.wire import Format, service_key

__all__ = ["slips_table"]

SET_POINTS = service_key("robosimian", "set_points")


def questions(stream: str, wrench: list[float], count: int) -> Iterator[bytes]:
    """Ask for set-points near a wrench, each time after other slips of one to three tiles."""
    chance = np.random.default_rng(0)
    limbs = ("front_right", "rear_right", "rear_left", "front_left")
    fingers = ("outer_left", "inner_left", "inner_right", "outer_right")
    tiles = [
        LostTile(limb, finger, phalanx)
        for limb in limbs
        for finger in fingers
        for phalanx in ("proximal", "middle", "distal")
    ]
    for _ in range(count):
        lost = chance.choice(len(tiles), chance.integers(1, 4), replace=False)
        yield Format.MSGPACK.encode(
            SetPointsRequest(
                v=1,
                stream=stream,
                body_wrench=tuple((np.array(wrench) * chance.uniform(0.97, 1.03, 6)).tolist()),
                lost=[tiles[i] for i in lost],
                detail="set_points",
            )
        )


def slips_table(
    endpoint: str,
    bare: Client,
    echo: str,
    count: int,
    load: Callable[[], AbstractContextManager[object]],
) -> Table:
    """Time set-points of a service after slips, alone and beside load, and a bare echo likewise.

    In this process, from bytes to bytes, the thread's processor time: what else runs counts little.
    """
    client, console = Client(endpoint), Console()
    asked = read_request("wall-300")
    declaration = StreamRequest(v=1, stance=asked.stance, load=asked.load, limits=asked.limits)
    form = Format.MSGPACK
    declared = form.encode(declaration)
    told = client.ask(STREAM, declared, form.value).ok.payload.to_bytes()
    stream = form.decode(told, StreamReply)
    table = Table("", "p50 [ms]", "p99 [ms]", title=f"set-points after slips, {count} random ones")
    outcomes: Counter[str] = Counter()

    def timed(name: str) -> None:
        took, echoed = list[float](), list[float]()
        for payload in questions(stream.stream, stream.body_wrench, count):
            start = time.perf_counter()
            reply = client.ask(SET_POINTS, payload, form.value)
            took.append(time.perf_counter() - start)
            if reply is None or reply.ok is None:
                outcomes["no reply"] += 1
                continue
            points = form.decode(reply.ok.payload.to_bytes(), SetPointsReply)
            outcomes[points.status if points.verified else "not verified"] += 1
            start = time.perf_counter()
            assert bare.ask(echo, payload) is not None
            echoed.append(time.perf_counter() - start)
        for what, times in (("set-points", took), ("bare echo", echoed)):
            table.add_row(f"{what}{name}", *(f"{percentile(times, p):.2f}" for p in (0.5, 0.99)))

    timed("")
    with load():
        time.sleep(1.0)
        timed(", loaded")
    own = form.decode(dispatch.handle(STREAM, declared, form.value).payload, StreamReply)
    time.sleep(2.0)  # in which all of the stance that can be known ahead is worked out
    took = list[float]()
    for payload in questions(own.stream, own.body_wrench, count):
        start = time.thread_time()
        assert dispatch.handle(SET_POINTS, payload, form.value).good
        took.append(time.thread_time() - start)
    numbers = (f"{percentile(took, part):.2f}" for part in (0.5, 0.99))
    table.add_row("in process: processor time", *numbers)
    console.print(dict(outcomes))
    client.close()
    return table
