"""A key that an object has twice is the sender's mistake, and never decided for one of the two."""

from __future__ import annotations

import json
import random
from typing import Any

import msgspec
import pytest

from hand_models.base import InvalidInputError
from service.requests import PlanRequest, RouteRequest
from service.wire import Format, MalformedError, decode_request
from tests.suite.helpers.requests import at, dotted, full_request, paths, put, wall_request


class Twice(dict):
    """An object that is written with one of its keys, and that key's value, twice."""

    def __init__(self, whole: dict, key: str) -> None:
        super().__init__(whole)
        self.key = key

    def items(self) -> list:
        return [*super().items(), (self.key, self[self.key])]


def packed(value: Any) -> bytes:
    """MessagePack of a document, also of what is there twice."""
    if isinstance(value, dict):
        items = list(value.items())
        parts = b"".join(packed(key) + packed(part) for key, part in items)
        return b"\xdf" + len(items).to_bytes(4, "big") + parts
    if isinstance(value, list):
        return b"\xdd" + len(value).to_bytes(4, "big") + b"".join(map(packed, value))
    return msgspec.msgpack.encode(value)


def written(request: Any, form: Format) -> bytes:
    return json.dumps(request, indent=1).encode() if form is Format.JSON else packed(request)


def mesh_request(triangles: int) -> dict:
    chance = random.Random(1)
    vertices = [[chance.uniform(-1.0, 1.0) for _ in range(3)] for _ in range(triangles // 2)]
    faces = [[chance.randrange(len(vertices)) for _ in range(3)] for _ in range(triangles)]
    hold = {"shape": "mesh", "vertices": vertices, "faces": faces}
    return put(wall_request(), ("stance", "hands", 2, "hold"), hold)


def test_every_key_that_is_there_twice_is_named() -> None:
    for form in Format:
        request = full_request()
        assert decode_request(written(request, form), PlanRequest, form)
        for path in paths(request):
            if not path or not isinstance(path[-1], str):
                continue
            spoilt = put(request, path[:-1], Twice(at(request, path[:-1]), path[-1]))
            with pytest.raises(MalformedError, match="is given twice") as caught:
                decode_request(written(spoilt, form), PlanRequest, form)
            assert caught.value.field == dotted(path)
            assert f"{path[-1]!r}" in caught.value.message


def test_in_a_scan_too() -> None:
    for form in Format:
        request = mesh_request(3_000)
        assert len(written(request, form)) > 2**16
        assert decode_request(written(request, form), PlanRequest, form)
        for path in (
            ("id",),
            ("stance", "hands", 3, "hold"),
            ("stance", "hands", 2, "hold", "faces"),
        ):
            spoilt = put(request, path[:-1], Twice(at(request, path[:-1]), path[-1]))
            with pytest.raises(MalformedError, match="is given twice") as caught:
                decode_request(written(spoilt, form), PlanRequest, form)
            assert caught.value.field == dotted(path)


def test_moves_of_a_route_are_counted() -> None:
    for form in Format:
        request = wall_request()
        move = request["stance"]["hands"][1]
        route = {"v": 1, "stance": request["stance"], "moves": [move, Twice(move, "hold")]}
        with pytest.raises(MalformedError) as caught:
            decode_request(written(route, form), RouteRequest, form)
        assert caught.value.field == "moves[1].hold"


def test_a_key_is_the_same_however_it_is_written() -> None:
    text = json.dumps(wall_request()).replace('"id": "wall"', '"id": "one", "\\u0069d": "two"')
    with pytest.raises(MalformedError) as caught:
        decode_request(text.encode(), PlanRequest)
    assert caught.value.field == "id"


def test_what_only_looks_like_it_is_read() -> None:
    for name in ['"id": 1, "id": 2', "{}{}", "[" * 256, ":[" + "1," * 120, "\\"]:
        request = wall_request() | {"id": name}
        assert decode_request(json.dumps(request).encode(), PlanRequest).id == name
        large = mesh_request(5_000) | {"id": name}
        assert decode_request(json.dumps(large).encode(), PlanRequest).id == name


def test_numbers_of_any_length_are_refused_as_numbers() -> None:
    for number in ["1" * 5000, "-" + "1" * 400, "1e400"]:
        text = json.dumps(wall_request()).replace('"mass": 50.0', f'"mass": {number}')
        with pytest.raises(InvalidInputError):
            decode_request(text.encode(), PlanRequest)


def test_a_number_of_many_digits_is_one() -> None:
    text = json.dumps(wall_request()).replace('"mass": 50.0', '"mass": 50.' + "0" * 70_000)
    request = decode_request(text.encode(), PlanRequest)
    assert request.load is not None
    assert request.load.mass == 50.0
