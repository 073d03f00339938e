"""A page for each key of the service, with bytes that a real service answered with."""

from __future__ import annotations

import json
import queue
import re
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final, NamedTuple

import msgspec
import zenoh

from generation.messages import anchor
from service.serving import PlanService, open_session, zenoh_config
from service.wire import most_bytes, schema, service_key, stream_key
from service.wire.json_schema import MESSAGE_KINDS

__all__ = ["key_pages"]

ROBOT: Final = "robosimian"

SHOWN: Final = 1024
"""Bytes of a payload that a page shows; the whole of it is a file beside it."""

WIDEST: Final = 100
"""Characters of a line of JSON on a page, unless nothing in it can be parted."""

ENCODINGS: Final = {"json": "application/json", "msgpack": "application/msgpack"}

TIMEOUT: Final = 300.0
"""Of a question, of which the first waits for processes that start [s]."""

PUBLISHED: Final = "stream_wrench"
"""Name of the page of wrenches that are published on a stream."""

CLIMB_ASKED: Final = {
    "v": 1,
    "id": "a",
    "rock": "leaning-wall",
    "start": {"height": 0.9},
    "goal": {"height": 1.4},
    "places": {"spacing": 0.8},
    "time": 5.0,
    "deadline": 600.0,  # a machine may be slow
}

KINDS: Final = {kind.__name__: kind for kind in MESSAGE_KINDS}


class _Key(NamedTuple):
    """What a reader of a key has to know, and what is asked there for example."""

    name: str
    words: str
    example: Mapping[str, Any]


class _Told(NamedTuple):
    payload: bytes
    encoding: str
    good: bool


def key_pages() -> dict[str, bytes]:
    """Return the pages of the keys, the list of them, and their payloads as files."""
    pages: dict[str, bytes] = {}
    # nothing but this process hears of this session
    config = zenoh_config(settings=["listen/endpoints:[]"], multicast=False)
    with open_session(config) as session, PlanService(session, workers=1):
        for key in _keys():
            _add_page(session, key, pages)
        _add_published(session, pages)
        pages["keys/errors.md"] = _errors(session).encode()
        pages["keys/health.md"] = _plain(session, "health", HEALTH).encode()
        pages["keys/metrics.md"] = _plain(session, "metrics", METRICS).encode()
    pages["keys/play.md"] = _published_at("play", PLAY).encode()
    asked = [key.name for key in _keys()]
    names = [*asked, PUBLISHED, "play", "health", "metrics", "errors"]
    pages["keys/index.md"] = BEGINNING.format("\n".join(names)).encode()
    return pages


def _keys() -> tuple[_Key, ...]:
    file = resources.files("service").joinpath("examples", "wall-300.json")
    stance = json.loads(file.read_text(encoding="utf-8"))["stance"]
    asked = {"v": 1, "id": "a", "stance": stance}
    return (
        _Key("plan", PLAN, asked | {"detail": "set_points"}),
        _Key(
            "wrench_space",
            WRENCH_SPACE,
            asked | {"limb": "front_right", "want": []},
        ),
        _Key("body_space", BODY_SPACE, asked),
        _Key("stream", STREAM, asked),
        _Key(
            "set_points",
            SET_POINTS,
            {
                "v": 1,
                "stream": "",
                "body_wrench": [1090, 0, 0, 0, -144, 0],
                "detail": "set_points",
            },
        ),
        _Key("diagnosis", DIAGNOSIS, asked | {"tensions": {"front_right": [63, 91, 85, 63]}}),
        _Key("route", ROUTE, asked | {"moves": [_move(stance["hands"][0])], "explain": False}),
        _Key("climb", CLIMB, CLIMB_ASKED),
        _Key("cancel", CANCEL, {"v": 1, "id": "a"}),
    )


def _move(hand: Mapping[str, Any]) -> dict[str, Any]:
    """Return a move of a hand to the same hold 100 mm higher up."""
    x, y, z = hand["pose"]["position"]
    return {**hand, "pose": {**hand["pose"], "position": [x, y, round(z + 0.1, 6)]}}


def _add_page(session: zenoh.Session, key: _Key, pages: dict[str, bytes]) -> None:
    example = dict(key.example)
    if "stream" in example:
        # as the reply of the page before names it
        declared = json.loads(pages["bytes/stream-reply.json"])
        example["stream"] = declared["stream"]
    named = service_key("<robot>", key.name)
    exchange = schema()["keys"][named]
    request = _name(exchange["request"])
    replies = exchange["reply"].get("anyOf", [exchange["reply"]])
    told_as = " or ".join(_link(_name(reply)) for reply in replies)
    text = [
        f"# {key.name}\n",
        f"{key.words}\n",
        f"- Key: `{named}`",
        f"- Request: {_link(request)}, {most_bytes(KINDS[request]):,} bytes at most",
        f"- Reply: {told_as}",
        "",
    ]
    for form, encoding in ENCODINGS.items():
        coder = msgspec.json if form == "json" else msgspec.msgpack
        asked = coder.encode(example)
        told = _ask(session, key.name, asked, encoding)
        if not told.good:
            raise RuntimeError(f"{key.name}: {told.payload!r}")
        both = {"request": _Told(asked, encoding, True), "reply": told}
        text += _payloads(key.name, form, both, pages)
    pages[f"keys/{key.name}.md"] = "\n".join(text).encode()


def _add_published(session: zenoh.Session, pages: dict[str, bytes]) -> None:
    """Add the page of a wrench that is published, and of the set-points that answer it."""
    stream = json.loads(pages["bytes/stream-reply.json"])["stream"]
    example = {"v": 1, "number": 0, "time": 12.5, "body_wrench": [1090, 0, 0, 0, -144, 0]}
    text = [_published_at("stream/<stream>/wrench", WRENCH, title=PUBLISHED)]
    text.append(_published_at("stream/<stream>/set_points", "", title=""))
    answers: queue.Queue[zenoh.Sample] = queue.Queue()
    with session.declare_subscriber(stream_key(ROBOT, stream, "set_points"), answers.put):
        for form, encoding in ENCODINGS.items():
            coder = msgspec.json if form == "json" else msgspec.msgpack
            asked = coder.encode(example | {"detail": "set_points"})
            session.put(stream_key(ROBOT, stream, "wrench"), asked, encoding=encoding)
            sample = answers.get(timeout=TIMEOUT)
            both = {
                "wrench": _Told(asked, encoding, True),
                "set_points": _Told(bytes(sample.payload), str(sample.encoding), True),
            }
            text += _payloads(PUBLISHED, form, both, pages)
    pages[f"keys/{PUBLISHED}.md"] = "\n".join(text).encode()


def _published_at(name: str, words: str, title: str | None = None) -> str:
    """Return what a page says of a key where messages are published."""
    named = service_key("<robot>", name)
    message = _name(schema()["keys"][named]["published"])
    head = name if title is None else title
    begin = [f"# {head}\n", f"{words}\n"] if head else []
    return "\n".join([*begin, f"- Key: `{named}`", f"- Published: {_link(message)}", ""])


def _link(message: str) -> str:
    return f"[{message}](#{anchor(message)})"


def _payloads(
    key: str, form: str, parts: Mapping[str, _Told], pages: dict[str, bytes]
) -> list[str]:
    """Add the payloads in one format to the files; return what the key's page shows of them."""
    text = [f"## {'JSON' if form == 'json' else 'MessagePack'}\n"]
    kept = "" if form == "json" else ":class: bytes\n"  # a style that does not wrap lines
    for part, told in parts.items():
        name = f"bytes/{key}-{part}.{form}"
        pages[name] = told.payload
        text += [
            f"The {part}, {len(told.payload):,} bytes, encoding `{told.encoding}`"
            f" ({{download}}`download <../{name}>`):\n",
            f"```{{code-block}} text\n{kept}{_shown(told.payload, form)}\n```\n",
        ]
    return text


def _name(reference: Mapping[str, str]) -> str:
    return reference["$ref"].rpartition("/")[2]


def _errors(session: zenoh.Session) -> str:
    told = _ask(session, "plan", b'{"v": 1, "id": "a", "stance": {}}', "application/json")
    if told.good:
        raise RuntimeError("a request without hands was answered")
    return ERRORS.format(told.encoding, told.payload.decode())


def _plain(session: zenoh.Session, name: str, words: str) -> str:
    told = _ask(session, name, b"", "")
    lines = told.payload.decode().splitlines()
    shown = "\n".join(lines[:12] + ["…"] * (len(lines) > 12))
    shown = _shown(told.payload, "json") if len(lines) == 1 else shown
    return PLAIN.format(name, words, service_key("<robot>", name), told.encoding, shown)


def _ask(session: zenoh.Session, name: str, payload: bytes, encoding: str) -> _Told:
    replies = session.get(
        service_key(ROBOT, name), payload=payload, encoding=encoding, timeout=TIMEOUT
    )
    (reply,) = list(replies)
    told = reply.ok or reply.err
    if told is None:
        raise RuntimeError(f"{name}: an answer that is neither a reply nor an error")
    return _Told(bytes(told.payload), str(told.encoding), reply.ok is not None)


def _shown(payload: bytes, form: str) -> str:
    """Return the beginning of a payload: text, or bytes in hexadecimal beside their characters."""
    part, rest = payload[:SHOWN], len(payload) - SHOWN
    if form == "json":
        text = part.decode(errors="ignore")
        lines = [""]
        # after commas, where a line break means nothing
        for piece in re.findall("[^,]*,?", text):
            if lines[-1] and len(lines[-1]) + len(piece) > WIDEST:
                lines.append("")
            lines[-1] += piece
    else:
        lines = [
            f"{i:06x}  {row.hex(' '):<47}  {''.join(chr(b) if 32 <= b < 127 else '.' for b in row)}"
            for i, row in ((i, part[i : i + 16]) for i in range(0, len(part), 16))
        ]
    return "\n".join([*lines, f"… {rest:,} bytes more"] if rest > 0 else lines)


BEGINNING = """# Keys of the service

The service answers zenoh queries at the keys below. On a stream, wrenches may also be
[published](stream_wrench.md). These pages are enough to write a client in any language that has
zenoh.

A question is one `get` on the key `crux/<robot>/<name>`, with the request as its payload and its
encoding. The reply is one sample on that key.

| encoding of the request | format |
| --- | --- |
| none, `zenoh/bytes`, `text/json`, `application/json` | JSON |
| `application/msgpack` | MessagePack, field names as keys |

A `;schema` after it is ignored. The reply has the format of the request. Its encoding also names
the message, such as `application/msgpack;crux.PlanReply@1`. An error comes as zenoh's error reply
(`reply_err`), in the same format: see [errors](errors.md).

Three things are optional:

- `source_info`: the identifier of a querier or publisher of yours, and a number that counts your
  questions. With it, a client that is linked to the service has a turn of its own.
- A secret of 16 random bytes as attachment, and a queryable at `crux/<robot>/clients/<zid>` (with
  your session's zenoh identifier) that replies with the secret's SHA-256. With it, a client behind
  a router has a turn of its own, and nobody else can ask in its name.
- A liveliness token of the same key. With it, your questions are dropped when you go.

The service itself holds the liveliness token `crux/<robot>/alive`.

Below, `id` is `"a"`, and line breaks within JSON are those of this page.

```{{toctree}}
:maxdepth: 1

{}
```
"""

PLAN = """Plans the loads of a stance. The example asks for `"detail": "set_points"`, which is for
controllers. The reply is then a [BriefPlanReply](#message-briefplanreply)."""

WRENCH_SPACE = """Lists which wrenches one hand of a stance can exert. The example leaves out
vertices and half-spaces (`"want": []`)."""

BODY_SPACE = """Lists which body wrenches a stance holds."""

STREAM = """Declares a stance for set-points of many body wrenches. The reply names the `stream`;
the 16 streams that were used last are kept."""

SET_POINTS = """Gives the set-points of a stream for one body wrench. The stream was declared with
[stream](stream.md)."""

DIAGNOSIS = """Tells which tile has probably slipped, by the tensions, currents or turns of the
motors after the slip."""

ROUTE = """Plans every stage of a climb. With `"want": ["trajectory"]` and `"parts": true`, the
knots of each move come first, as [PartReply](#message-partreply) messages on the same key. The
example moves one hand 100 mm up."""

CLIMB = """Searches for the best climb on a rock, with a bound of every other. With
`"parts": true`, progress comes first, as [PartReply](#message-partreply) messages on the same key.
In the example, the grid of placements is so coarse that there is no climb."""

CANCEL = """Ends questions of the same client that wait, and its searches for climbs. Questions are
named by their `id`; the reply counts them. Here none waited."""

WRENCH = """Body wrenches may be published on a stream that was declared with [stream](stream.md).
The service publishes set-points for the newest of them, with its `number` and `time`, or an
`error` in their place. [Feed a control loop](../../../how-to/set-points.md) tells more."""

PLAY = """`crux play` publishes the set-points of a climb here, for a robot. Nobody answers."""

HEALTH = """Reports the state for an operator: version, uptime, workers, the queue, the last
failure."""

METRICS = """Reports counts and times in the format of Prometheus."""

PLAIN = """# {}

{}

- Key: `{}`
- Request: empty

The reply, encoding `{}`:

```{{code-block}} text
{}
```
"""

ERRORS = """# Errors

An error is zenoh's error reply, of 4,096 bytes at most. Long texts end in `…`. The message is an
[ErrorReply](#message-errorreply). `field` is the path of the fault in the request, or null.
[Run the service](../../../how-to/service.md#errors) explains each `kind`.

A request whose stance has no hands, `{{"v": 1, "id": "a", "stance": {{}}}}`, is answered with an
error reply, encoding `{}`:

```{{code-block}} text
{}
```
"""
