"""How old published set-points are when they come, beside a bare echo as often."""

from __future__ import annotations

import threading
import time
from collections import Counter
from itertools import count
from math import sin

import numpy as np
import zenoh
from rich.table import Table
from zenoh.handlers import Callback

from benchmarks.load.asking import STREAM, Client, percentile
from service.commands.stances import read_request
from service.replies import PublishedReply, StreamReply
from service.requests import StreamRequest, WrenchRequest
from service.serving import zenoh_config
from service.wire import Format, ServiceName, stream_key
from tests.suite.helpers.served import client_config

__all__ = ["echo_published", "published_table"]

HEARD, ECHOED = "echo/wrench", "echo/set_points"

SENDING = {
    "congestion_control": zenoh.CongestionControl.DROP,
    "priority": zenoh.Priority.REAL_TIME,
    "express": True,
}


def echo_published(endpoint: str) -> None:
    """Publish again what is published, with as many bytes as set-points have, until killed."""
    rest = b"x" * 900
    with zenoh.open(zenoh_config(mode="peer", listen=[endpoint], multicast=False)) as session:

        def echo(sample: zenoh.Sample) -> None:
            session.put(ECHOED, sample.payload.to_bytes() + rest, **SENDING)

        session.declare_subscriber(HEARD, Callback(echo, indirect=False))
        print("on", flush=True)
        threading.Event().wait()


def published_table(endpoint: str, where: str, seconds: float, rate: float) -> Table:
    """Publish wrenches and as many messages to a bare echo, by turns, at a rate [1/s].

    An age is the time from publication to arrival, in this process.
    """
    form = Format.MSGPACK
    asked, asking = read_request("wall-300"), Client(endpoint)
    request = StreamRequest(v=1, stance=asked.stance, load=asked.load, limits=asked.limits)
    told = asking.ask(STREAM, form.encode(request), form.value).ok.payload.to_bytes()
    declared = form.decode(told, StreamReply)
    sent: list[float] = []
    echo_sent: list[float] = []
    ages, echo_ages = list[float](), list[float]()
    statuses: Counter[str] = Counter()

    def came(sample: zenoh.Sample) -> None:
        now = time.perf_counter()
        reply = form.decode(sample.payload.to_bytes(), PublishedReply)
        statuses["skipped"] += reply.skipped
        if reply.set_points is None:
            statuses["errors"] += 1
            return
        ages.append(now - sent[reply.number])
        statuses["answered" if reply.set_points.verified else "not verified"] += 1

    def echoed(sample: zenoh.Sample) -> None:
        number = int.from_bytes(sample.payload.to_bytes()[:8])
        echo_ages.append(time.perf_counter() - echo_sent[number])

    with zenoh.open(client_config(endpoint)) as session, zenoh.open(client_config(where)) as bare:
        key = stream_key("robosimian", declared.stream, ServiceName.SET_POINTS)
        session.declare_subscriber(key, Callback(came, indirect=False))
        bare.declare_subscriber(ECHOED, Callback(echoed, indirect=False))
        key = stream_key("robosimian", declared.stream, ServiceName.WRENCH)
        # what was declared has to be known
        time.sleep(0.5)
        start = time.perf_counter()
        for number in count():
            at = number / rate
            if at >= seconds:
                break
            time.sleep(max(start + at - time.perf_counter(), 0.0))
            # up to 5 % less than the stance is held by, twice a second
            wrench = np.multiply(declared.body_wrench, 0.975 + 0.025 * sin(12.6 * at))
            message = form.encode(
                WrenchRequest(
                    v=1,
                    number=number,
                    time=at,
                    body_wrench=tuple(wrench.tolist()),
                    detail="set_points",
                )
            )
            sent.append(time.perf_counter())
            session.put(key, message, encoding=form.value, **SENDING)
            payload = number.to_bytes(8) + message[8:]
            echo_sent.append(time.perf_counter())
            bare.put(HEARD, payload, **SENDING)
        took = time.perf_counter() - start
        time.sleep(0.5)
    asking.close()
    lost = len(sent) - statuses.total()
    title = f"{len(sent)} wrenches in {took:.1f} s: {dict(statuses)}, lost {lost}"
    table = Table("", "p50 [ms]", "p99 [ms]", "longest [ms]", "lost", title=title)
    rows = (("set-points", ages, lost), ("bare echo", echo_ages, len(echo_sent) - len(echo_ages)))
    for name, times, missing in rows:
        figures = (f"{percentile(times, part):.2f}" for part in (0.5, 0.99, 1.0))
        table.add_row(name, *figures, str(missing))
    ratios = (f"{percentile(ages, p) / percentile(echo_ages, p):.2f}" for p in (0.5, 0.99, 1.0))
    table.add_row("ratio", *ratios, "")
    return table
