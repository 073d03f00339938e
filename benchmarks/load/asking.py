"""Questions of all prices, and sessions that ask them without waiting."""

from __future__ import annotations

import copy
import itertools
import random
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import msgspec
import zenoh

from service.replies import ErrorReply
from service.wire import Format, server_key, service_key
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.requests import flat_request, full_request, spoil, wall_request
from tests.suite.helpers.served import client_config

PLAN = service_key("robosimian", "plan")
WRENCH_SPACE = service_key("robosimian", "wrench_space")
BODY_SPACE = service_key("robosimian", "body_space")
STREAM = service_key("robosimian", "stream")

Asked = tuple[str, bytes, str]
"""Key, payload and encoding."""


def new_wrenches(seed: int = 0) -> Iterator[bytes]:
    """A stance that stays, whose body's wrench changes."""
    rng = random.Random(seed)
    request = wall_request(mass=None)
    while True:
        request["body_wrench"] = [rng.uniform(-50, 50), rng.uniform(-50, 50), 400.0, 0.0, 0.0, 0.0]
        yield msgspec.json.encode(request)


def new_stances(seed: int = 0) -> Iterator[bytes]:
    """Stances of which no two are alike."""
    rng = random.Random(seed)
    request = wall_request()
    while True:
        for hand in request["stance"]["hands"]:
            hand["hold"]["diameter"] = rng.uniform(0.25, 0.35)
        yield msgspec.json.encode(request)


def random_plans(seed: int = 0) -> Iterator[bytes]:
    """Plans of all sorts, of hands and holds of all sorts."""
    for i in itertools.count():
        yield msgspec.json.encode(random_request(seed * 10**6 + i) | {"deadline": 5.0})


def dear_questions(seed: int = 0) -> Iterator[Asked]:
    """The dearest that are legal: many half-planes, robust, floating hands, sections of spaces."""
    rng = random.Random(seed)
    for i in itertools.count():
        request = wall_request()
        for hand in request["stance"]["hands"]:
            hand["hold"]["diameter"] = rng.uniform(0.25, 0.35)
        stance = request["stance"]
        kind = i % 4
        if kind == 0:
            numbers = {"shear_limit": 60.0, "pull_off_limit": 15.0, "pull_off_angle": 0.7}
            stance["hands"][0]["surface"] = numbers | {"half_planes": rng.choice([3, 5, 8, 64])}
            asked = {"v": 1, "stance": stance, "limb": stance["hands"][0]["limb"]}
            yield WRENCH_SPACE, msgspec.json.encode(asked), "application/json"
        elif kind == 1:
            for hand in stance["hands"]:
                hand["wrist"] = "floating"
                hand["tendon_preload"] = [20.0] * 4
            yield PLAN, msgspec.json.encode(request), "application/json"
        elif kind == 2:
            directions = [[rng.gauss(0, 1) for _ in range(3)] for _ in range(100)]
            asked = {"v": 1, "stance": stance, "others": "free", "directions": directions}
            yield BODY_SPACE, msgspec.json.encode(asked), "application/json"
        else:
            request["want"] = ["robust", "spread", "load_factor", "prices", "model"]
            yield PLAN, msgspec.json.encode(request), "application/json"


def spoilt(seed: int = 0) -> Iterator[Asked]:
    """Requests with something wrong in them, and bytes that are none."""
    rng = random.Random(seed)
    for i in itertools.count():
        request = (full_request, flat_request, wall_request)[i % 3]()
        payload, encoding = spoil(copy.deepcopy(request), rng)
        yield rng.choice([PLAN, WRENCH_SPACE, BODY_SPACE, STREAM]), payload, encoding


def mixed(seed: int = 0) -> Iterator[Asked]:
    """Everything, by turns."""
    dear, bad, known = dear_questions(seed), spoilt(seed), new_wrenches(seed)
    stances, rng = new_stances(seed), random.Random(seed)
    for i in itertools.count():
        kind = rng.random()
        if kind < 0.05:
            yield next(dear)
        elif kind < 0.25:
            yield next(bad)
        elif kind < 0.5:
            yield PLAN, msgspec.json.encode(random_request(seed * 10**6 + i)), "application/json"
        else:
            yield PLAN, next(known if kind < 0.8 else stances), "application/json"


@dataclass
class Tally:
    """Outcomes of questions: how many of each status, and how long the good ones took [s]."""

    statuses: Counter[str] = field(default_factory=Counter)
    times: list[float] = field(default_factory=list)
    late: list[float] = field(default_factory=list)
    slowest: float = 0.0
    in_time: int = 0
    seconds: float = 0.0
    """How long it was asked [s]."""

    def note(self, reply: zenoh.Reply | None, seconds: float) -> None:
        """Count what a question got."""
        self.slowest = max(self.slowest, seconds)
        if reply is None:
            self.statuses["no reply"] += 1
        elif reply.ok is not None:
            self.statuses["good"] += 1
            self.times.append(seconds)
        else:
            self.statuses[error_kind(reply)] += 1

    @property
    def rate(self) -> float:
        """Good answers a second."""
        return self.statuses["good"] / self.seconds

    def percentile(self, part: float) -> float:
        """A percentile of how long good answers took [ms]."""
        return percentile(self.times, part)

    def in_words(self) -> str:
        """Return rate, times and statuses, in words."""
        middle, late, most = map(self.percentile, (0.5, 0.99, 1.0))
        return (
            f"{self.rate:.1f}/s, p50 {middle:.0f} ms, p99 {late:.0f} ms, longest {most:.0f} ms, "
            f"{dict(self.statuses)}"
        )


def percentile(seconds: list[float], part: float) -> float:
    """A percentile of durations [s], in ms."""
    return 1e3 * sorted(seconds)[min(len(seconds) - 1, int(part * len(seconds)))]


def at_once(count: int, work: Callable[[int], object]) -> None:
    """Do some work in so many threads, each with its number, until all have ended."""
    with ThreadPoolExecutor(count) as pool:
        list(pool.map(work, range(count)))


def error_kind(reply: zenoh.Reply) -> str:
    """The kind of an error reply; ``timeout`` for zenoh's own."""
    encoding = str(reply.err.encoding)
    if not encoding.startswith("application/"):
        return "timeout"
    return Format.named(encoding).decode(reply.err.payload.to_bytes(), ErrorReply).error.kind


class Client:
    """A session of its own; asks one question after another, or many."""

    def __init__(self, endpoint: str, timeout: float = 30.0) -> None:
        self._take(zenoh.open(client_config(endpoint)), timeout)

    @classmethod
    def of(cls, session: zenoh.Session, timeout: float = 30.0) -> Client:
        """Return a client that asks by an open session."""
        made = cls.__new__(cls)
        made._take(session, timeout)
        return made

    def _take(self, session: zenoh.Session, timeout: float) -> None:
        self.session = session
        self._source = self.session.declare_querier(PLAN)
        self._numbers = itertools.count()
        self._timeout = timeout

    def ask(self, key: str, payload: bytes, encoding: str = "application/json") -> zenoh.Reply:
        """Return the reply."""
        source = zenoh.SourceInfo(self._source.id, next(self._numbers))
        replies = self.session.get(
            key,
            payload=payload,
            encoding=encoding,
            timeout=self._timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
            source_info=source,
        )
        return next(iter(replies), None)

    def send(self, tally: Tally, key: str, payload: bytes, encoding: str) -> None:
        """Ask, and count the reply when it comes."""
        start, got = time.perf_counter(), []

        def reply(found: zenoh.Reply) -> None:
            got.append(found)

        def done() -> None:
            tally.note(got[0] if got else None, time.perf_counter() - start)

        self.session.get(
            key,
            zenoh.handlers.Callback(reply, done, indirect=False),
            payload=payload,
            encoding=encoding,
            timeout=self._timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
            source_info=zenoh.SourceInfo(self._source.id, next(self._numbers)),
        )

    def close(self) -> None:
        """Close the session."""
        self.session.close()


def health(client: Client, server: str | None = None) -> dict:
    """What the service says of itself, or one of several."""
    robot, name = "robosimian", "health"
    key = service_key(robot, name) if server is None else server_key(robot, server, name)
    reply = client.ask(key, b"")
    return msgspec.json.decode(reply.ok.payload.to_bytes())
