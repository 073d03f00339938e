"""Whatever becomes of a request on its way: it is read, or it is the sender's error."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from functools import cache

import msgspec
import pytest

from hand_models.base import InvalidInputError
from service.commands.stances import bundled, read_request
from service.requests import (
    BodySpaceRequest,
    PlanRequest,
    Query,
    SetPointsRequest,
    StreamRequest,
    WrenchSpaceRequest,
)
from service.wire import LARGEST_ERROR, Format, decode_request, encode_error, identifier
from tests.suite.helpers.requests import (
    at,
    full_request,
    paths,
    put,
    request_with_joints,
    stream_request,
)

NUMBERS = (
    *(
        "Infinity",
        "-Infinity",
        "NaN",
        "1e999",
        "-1e999",
        "1e308",
        "5e-324",
        "-0.0",
        "-1",
        "1e1000000",
    ),
    *("9" * 30, "-" + "9" * 400, "9" * 5000, "0." + "1" * 3000, "18446744073709551616", "00", "+1"),
)
"""What is put in place of a number of JSON."""

PACKED = (
    *(b"\xcb\x7f\xf0" + bytes(6), b"\xcb\x7f\xf8" + bytes(6), b"\xca\x7f\x80\x00\x00"),
    *(b"\xcf" + b"\xff" * 8, b"\xd3\x80" + bytes(7), b"\xc0", b"\xc3", b"\xd6\xff" + bytes(4)),
    *(b"\xdf\xff\xff\xff\xff", b"\xdd\xff\xff\xff\xff", b"\xdb\xff\xff\xff\xff", b"\xc7\xff\x05"),
)
"""What is put somewhere into MessagePack: numbers, and beginnings of what never comes."""

NESTS = (("[", "]"), ('{"a":', "}"), ('{"stance":', "}"), ('[{"limb":', "}]"))


def mesh_request() -> dict:
    """A hand on a rock of four triangles, which it shares."""
    request = full_request()
    tent = [[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [0, 0, -0.05]]
    faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    request["stance"]["rocks"] = {"tent": {"shape": "mesh", "vertices": tent, "faces": faces}}
    request["stance"]["hands"][0]["hold"] = {"shape": "rock", "rock": "tent"}
    return request


@cache
def requests() -> tuple[tuple[type[Query], dict], ...]:
    """The bundled stances at all keys, and requests with every field there is."""
    plans = [msgspec.to_builtins(read_request(name)) for name in bundled() if name != "boulders"]
    plans += [full_request(), request_with_joints(), mesh_request()]
    found: list[tuple[type[Query], dict]] = []
    for plan in plans:
        limb = plan["stance"]["hands"][0]["limb"]
        about = {"v": 1, "id": "ü", "stance": plan["stance"]}
        body = about | {"axes": ["fx", "mz"], "directions": [[0, 0, 1]], "deadline": 3.0}
        found += [
            (PlanRequest, plan | {"deadline": 0.5, "detail": "hands"}),
            (WrenchSpaceRequest, about | {"limb": limb, "want": ["robust"]}),
            (BodySpaceRequest, body),
            (StreamRequest, stream_request(plan, radius=20.0)),
        ]
    wrench = [1.0, 2.5, -3e2, 0.0, 1e-3, -7.0]
    found.append((SetPointsRequest, {"v": 1, "stream": "a" * 32, "body_wrench": wrench}))
    return tuple(found)


def changed(request: dict, chance: random.Random) -> dict:
    """A request with a few of its parts exchanged, doubled, renamed or gone."""
    for _ in range(chance.randint(1, 3)):
        places = paths(request)
        one, other = chance.choice(places), chance.choice(places)
        trick = chance.randrange(3)
        if trick == 0:
            request = put(request, one, at(request, other))
            if not isinstance(request, dict):
                return {"v": request}
        elif one and isinstance(one[-1], str):
            whole = at(request, one[:-1])
            names = [place[-1] for place in places if place and isinstance(place[-1], str)]
            renamed = {
                chance.choice(names) if name == one[-1] else name: part
                for name, part in whole.items()
                if trick == 1 or name != one[-1]
            }
            request = put(request, one[:-1], renamed)
    return request


def mutated(payload: bytes, other: bytes, form: Format, chance: random.Random) -> bytes:
    """Bytes with something done to them that knows nothing of requests, or a little of JSON."""
    trick = chance.randrange(7)
    spot, end = sorted(chance.randrange(len(payload) + 1) for _ in range(2))
    if trick == 0:
        copy = bytearray(payload)
        for _ in range(chance.randint(1, 4)):
            copy[chance.randrange(len(copy))] ^= 1 << chance.randrange(8)
        return bytes(copy)
    if trick == 1:
        return payload[:spot]
    if trick == 2:
        start, stop = sorted(chance.randrange(len(other) + 1) for _ in range(2))
        return payload[:spot] + other[start:stop] + payload[end:]
    if trick == 3:
        return payload[:spot] + payload[end:]
    if trick == 4:
        return payload[:end] + payload[spot:end] + payload[end:]
    if form is Format.MSGPACK:
        put_in = chance.choice(PACKED) if trick == 5 else b"\x91" * 10 ** chance.randint(1, 4)
        return payload[:spot] + put_in + payload[spot + chance.choice((0, 1, 9)) :]
    text = payload.decode()
    places = [i for i in range(1, len(text)) if text[i - 1] in ":[," and text[i] in "-0123456789"]
    if not places:
        return payload
    start = chance.choice(places)
    stop = next((i for i in range(start, len(text)) if text[i] in ",]}"), len(text))
    depth = 10 ** chance.randint(1, 4)
    opening, closing = chance.choice(NESTS)
    inside = chance.choice(NUMBERS) if trick == 5 else opening * depth + "1" + closing * depth
    return (text[:start] + inside + text[stop:]).encode()


def payloads(count: int, seed: int) -> Iterator[tuple[type[Query], Format, bytes]]:
    chance = random.Random(seed)
    table = requests()
    ready = {
        form: [form.encode(request) for _, request in table]
        for form in (Format.JSON, Format.MSGPACK)
    }
    for i in range(count):
        form = chance.choice(tuple(Format))
        which = i % len(table)
        kind, request = table[which]
        payload = ready[form][which]
        if chance.random() < 0.3:
            payload = form.encode(changed(request, chance))
        if chance.random() < 0.8:
            payload = mutated(payload, chance.choice(ready[form]), form, chance)
        yield kind, form, payload


def read(payload: bytes, kind: type[Query], form: Format) -> Query | InvalidInputError:
    """The request that bytes are, or why they are none; what else goes wrong tells the bytes."""
    try:
        return decode_request(payload, kind, form)
    except InvalidInputError as error:
        return error
    except BaseException as error:
        error.add_note(f"{kind.__name__}, {form}: {payload[:3000]!r}")
        raise


def check_mutated(count: int, seed: int) -> None:
    seen: Counter[str] = Counter()
    for kind, form, payload in payloads(count, seed):
        request = read(payload, kind, form)
        if isinstance(request, InvalidInputError):
            seen[request.kind] += 1
            name = identifier(payload, form, kind)
            said, *_ = encode_error(request, form, name)
            assert len(said) <= LARGEST_ERROR, (form, payload)
            assert request.message, (form, payload)
            assert "\n" not in request.message, (form, payload)
        else:
            seen["read"] += 1
            # what is read is what travels
            assert read(form.encode(request), kind, form) == request, (form, payload)
    assert min(seen[name] for name in ("read", "invalid", "malformed")) > count / 50, seen


@pytest.mark.parametrize("count", [1_500, pytest.param(5_000, marks=pytest.mark.slow)])
def test_mutated_payloads_are_read_or_refused(count: int) -> None:
    check_mutated(count, 1)


@pytest.mark.slow
def test_fifty_thousand_mutated_payloads_are_read_or_refused() -> None:
    check_mutated(50_000, 2)
