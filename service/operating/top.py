"""Show what a running service does: its health and its metrics as one table."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec
import zenoh
from prometheus_client.parser import text_string_to_metric_families

from service.replies import HealthReply
from service.servers import silence_in_words
from service.tables import PrintedColumn, name, number
from service.wire import NoServiceError, ServiceName, service_key

if TYPE_CHECKING:
    from rich.console import RenderableType

__all__ = ["Snapshot", "draw_top", "read_snapshot", "top_json"]


class Snapshot(NamedTuple):
    """State of a service.

    Attributes
    ----------
    at : float
        When it was read, on the clock of `time.monotonic` [s].
    health : HealthReply
    samples : dict
        Value of each metric by its name and labels.
    """

    at: float
    health: HealthReply
    samples: dict[tuple[str, frozenset[tuple[str, str]]], float]


class _Row(NamedTuple):
    key: str
    number: int
    rate: float
    errors: int
    waited: tuple[float | None, float | None]
    worked: tuple[float | None, float | None]


def read_snapshot(session: zenoh.Session, robot: str, timeout: float) -> Snapshot:
    """Ask a service for its health and its metrics.

    Parameters
    ----------
    session : zenoh.Session
    robot : str
        Name of the robot.
    timeout : float
        Longest wait for each of both [s].

    Raises
    ------
    NoServiceError
        If no service answers.
    """
    found = []
    for key in (service_key(robot, each) for each in (ServiceName.HEALTH, ServiceName.METRICS)):
        replies = [each.ok for each in session.get(key, timeout=timeout) if each.ok is not None]
        if not replies:
            raise NoServiceError(silence_in_words(session, robot, key.rpartition("/")[2]))
        found.append(replies[0].payload.to_bytes())
    samples = {
        (each.name, frozenset(each.labels.items())): each.value
        for family in text_string_to_metric_families(found[1].decode())
        for each in family.samples
    }
    return Snapshot(time.monotonic(), msgspec.json.decode(found[0], type=HealthReply), samples)


def top_rows(now: Snapshot, before: Snapshot | None = None) -> list[_Row]:
    """Return a row for each kind of question: since another snapshot, or since the start."""
    old = {} if before is None else before.samples
    since = now.health.uptime if before is None else now.at - before.at
    new = {key: value - old.get(key, 0.0) for key, value in now.samples.items()}
    if any(value < 0.0 for (each, _), value in new.items() if each == "crux_questions_total"):
        # another service answers by now
        return top_rows(now)
    counts: Counter[str] = Counter()
    errors: Counter[str] = Counter()
    fine = {"optimal", "overloaded", "infeasible", "done", "found", "none"}
    for (metric, labels), value in new.items():
        if metric == "crux_questions_total":
            said = dict(labels)
            counts[said["key"]] += int(value)
            errors[said["key"]] += 0 if said["status"] in fine else int(value)

    def times(name: str, key: str) -> tuple[float | None, float | None]:
        metric = f"crux_{name}_seconds_bucket"
        return _quantile(new, metric, key, 0.5), _quantile(new, metric, key, 0.99)

    since = max(since, 1e-9)
    return [
        _Row(key, n, n / since, errors[key], times("waiting", key), times("work", key))
        for key, n in sorted(counts.items())
    ]


def _quantile(
    samples: Mapping[tuple[str, frozenset[tuple[str, str]]], float],
    name: str,
    key: str,
    part: float,
) -> float | None:
    """Return a quantile of times that were counted in buckets, linear within a bucket [s]."""
    buckets = sorted(
        (float(said["le"]), value)
        for (each, labels), value in samples.items()
        if each == name and (said := dict(labels))["key"] == key
    )
    if not buckets or buckets[-1][1] <= 0.0:
        return None
    wanted = part * buckets[-1][1]
    low, below = 0.0, 0.0
    for high, count in buckets:
        if count >= wanted:
            # of times beyond the last bucket nothing more is known
            share = (wanted - below) / (count - below)
            return low if high == float("inf") else low + share * (high - low)
        low, below = high, count
    return low


def top_json(now: Snapshot, before: Snapshot | None = None) -> dict[str, Any]:
    """Return a snapshot as plain data: the health, and `top_rows` as ``questions``."""
    rows = {
        row.key: {k: v for k, v in row._asdict().items() if k != "key"}
        for row in top_rows(now, before)
    }
    return {"v": 1, "health": now.health, "questions": rows}


def draw_top(now: Snapshot, before: Snapshot | None = None) -> RenderableType:
    """Return a snapshot as a table for a terminal of 80 columns.

    Parameters
    ----------
    now : Snapshot
    before : Snapshot, optional
        Since when questions are counted; by default since the service's start.
    """
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    health = now.health
    does = Counter(f"{each.purpose} {each.state}" for each in health.processes)
    memory = sum(each.resident or 0 for each in health.processes) / 2**20
    waits = ", ".join(f"{count} {kind}" for kind, count in health.waiting.items() if count)
    lines = {
        "service": f"{health.robot}, version {health.version or 'unknown'}, "
        f"up {_span(health.uptime)}, {health.replied:,} replies",
        "clients": f"{health.clients}, with this one",
        "streams": f"{health.streams}",
        "queue": waits or "empty",
        "workers": ", ".join(f"{count} {words}" for words, count in sorted(does.items()))
        + f"; {memory:,.0f} MiB",
    }
    if (kept := health.recording) is not None:
        size = (
            f"{kept.file}, {kept.bytes / 2**20:,.1f} MiB" if kept.file else f"none: {kept.problem}"
        )
        lines["recording"] = f"{size}; {kept.recorded:,} recorded, {kept.dropped:,} dropped"
    if (failure := health.last_failure) is not None:
        ago = _span(max(time.time() - failure.at, 0.0))
        lines["last failure"] = f"{failure.kind}: {failure.about}, {ago} ago"
    head = Table.grid(padding=(0, 2))
    for word, line in lines.items():
        head.add_row(Text(word, "bold"), line)
    body = Table(title=None, padding=(0, 1), box=None)
    for column in TOP_COLUMNS:
        body.add_column(column.head, justify="right" if column.kind == "number" else "left")
    rows = top_rows(now, before)
    for row in rows:
        body.add_row(*(column.cell(row) for column in TOP_COLUMNS))
    return Group(head, Text(), body) if rows else Group(head, Text("no questions"))


TOP_COLUMNS: tuple[PrintedColumn, ...] = (
    name("question", "key"),
    number("per s", "rate", ".1f"),
    number("number", "number", ",d"),
    number("errors", "errors", ",d"),
    *(
        number(f"{word}\n{part} [ms]", f"{path}.{i}", ".3g", 1e3)
        for word, path in (("wait", "waited"), ("work", "worked"))
        for i, part in enumerate(("p50", "p99"))
    ),
)


def _span(seconds: float) -> str:
    """Return a time span in words, in its two largest units."""
    whole = int(seconds)
    parts = (
        (whole // 86400, "d"),
        (whole // 3600 % 24, "h"),
        (whole // 60 % 60, "min"),
        (whole % 60, "s"),
    )
    said = [f"{count} {unit}" for count, unit in parts if count]
    return " ".join(said[:2]) or "0 s"
