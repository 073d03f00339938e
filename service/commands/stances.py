"""Where the command line finds a stance or a route: a file, standard input, or a bundled one.

Files that its holds name are read here, so that what travels is whole.
"""

from __future__ import annotations

import sys
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TypeVar

import msgspec

from hand_models.base import InvalidInputError
from hand_models.rock import read_mesh
from service.requests import Hand, Mesh, PlanRequest, Request, RouteRequest
from service.wire import decode_request

__all__ = ["bundled", "read_request", "read_route"]

H = TypeVar("H", bound=Hand)
R = TypeVar("R", bound=Request)


def bundled(kind: type[Request] = PlanRequest) -> tuple[str, ...]:
    """Return the names of the bundled stances, or of the bundled routes."""
    return tuple(sorted(Path(f.name).stem for f in _folder(kind).iterdir() if _is_json(f)))


def read_request(source: str) -> PlanRequest:
    """Return the plan request that a command was given.

    Parameters
    ----------
    source : str
        Path of a JSON file, ``-`` for standard input, or the name of a bundled stance.

    Raises
    ------
    InvalidInputError
        If there is none, or it is not a plan request.
    """
    return _read(source, PlanRequest, "STANCE", "stance")


def read_route(source: str) -> RouteRequest:
    """Return the route that a command was given; as `read_request`."""
    return _read(source, RouteRequest, "ROUTE", "route")


def _folder(kind: type[Request]) -> Traversable:
    folder = resources.files("service") / "examples"
    return folder / "routes" if kind is RouteRequest else folder


def _is_json(file: Traversable) -> bool:
    return file.is_file() and file.name.endswith(".json")


def _read(source: str, kind: type[R], field: str, noun: str) -> R:
    if source == "-":
        return _whole(decode_request(sys.stdin.buffer.read(), kind), Path())
    path = Path(source)
    if path.is_file():
        try:
            return _whole(decode_request(path.read_bytes(), kind), path.parent)
        except OSError as error:
            raise InvalidInputError(f"{error.strerror}: {source}", field=field) from None
    if source in bundled(kind):
        with resources.as_file(_folder(kind)) as folder:
            return _whole(
                decode_request((folder / f"{source}.json").read_bytes(), kind), Path(folder)
            )
    raise InvalidInputError(
        f"no such file, and no bundled {noun} {source!r}; bundled are {', '.join(bundled(kind))}",
        field=field,
    )


def _whole(request: R, folder: Path) -> R:
    """Return a request with the meshes that it names by file, relative to a folder."""
    read: dict[str, Mesh] = {}

    def filled(hands: list[H], path: str) -> list[H]:
        return [_filled(hand, folder, read, f"{path}[{i}]") for i, hand in enumerate(hands)]

    replace = msgspec.structs.replace
    if isinstance(request, (PlanRequest, RouteRequest)):
        hands = filled(request.stance.hands, "stance.hands")
        request = replace(request, stance=replace(request.stance, hands=hands))
    if isinstance(request, RouteRequest):
        request = replace(request, moves=filled(request.moves, "moves"))
    return request


def _filled(hand: H, folder: Path, read: dict[str, Mesh], path: str) -> H:
    hold = hand.hold
    if not isinstance(hold, Mesh) or hold.file is None:
        return hand
    if hold.vertices is not None or hold.faces is not None:
        raise InvalidInputError(
            "give a file, or vertices and faces, not both", field=f"{path}.hold.file"
        )
    if hold.file not in read:
        try:
            vertices, faces = read_mesh(folder / hold.file)
        except InvalidInputError as error:
            raise error.within(f"{path}.hold") from None
        read[hold.file] = Mesh(vertices=vertices.tolist(), faces=faces.tolist())
    known = read[hold.file]
    hold = msgspec.structs.replace(hold, vertices=known.vertices, faces=known.faces, file=None)
    return msgspec.structs.replace(hand, hold=hold)
