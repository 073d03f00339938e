"""Read the stance or the route of a command: a file, standard input, or a bundled one.

Files that its holds name are read here, so that the request is complete.
"""

from __future__ import annotations

import sys
from codecs import BOM_UTF8
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

import msgspec

from hand_models.base import InvalidInputError
from service import answering, requests, wire

__all__ = ["Given", "bundled", "limbs_of", "read_request", "read_route", "read_with_text"]

RequestT = TypeVar("RequestT", bound=requests.Request)


class Given(NamedTuple, Generic[RequestT]):
    """A request as it was written.

    Attributes
    ----------
    text : bytes
    request : Request
        Content of the text, with the scans of the files that it names.
    files : MeshFiles or None
        Those files; None where they are bundled, and so may be gone.
    """

    text: bytes
    request: RequestT
    files: answering.MeshFiles | None


def bundled(kind: type[requests.Request] = requests.PlanRequest) -> tuple[str, ...]:
    """Return the names of the bundled stances, or of the bundled routes."""
    files = [file.name for file in _folder(kind).iterdir()]
    return tuple(sorted(name.removesuffix(".json") for name in files if name.endswith(".json")))


def read_request(source: str) -> requests.PlanRequest:
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
    return read_with_text(source)[0]


def read_with_text(source: str) -> tuple[requests.PlanRequest, Given[requests.PlanRequest]]:
    """Return the plan request as `read_request` does, with its text."""
    return _read(source, requests.PlanRequest, "STANCE", "stance")


def read_route(source: str) -> requests.RouteRequest:
    """Return the route that a command was given; as `read_request`."""
    return _read(source, requests.RouteRequest, "ROUTE", "route")[0]


def limbs_of(source: str | None) -> tuple[str, ...]:
    """Return the limbs whose hands hold in a stance; the bundled robot's if it cannot be read."""
    path = (
        _folder(requests.PlanRequest) / f"{source}.json"
        if source in bundled()
        else Path(source or "")
    )
    try:
        asked = msgspec.json.decode(path.read_bytes())
        return tuple(str(hand["limb"]) for hand in asked["stance"]["hands"])
    except (OSError, msgspec.DecodeError, LookupError, TypeError):
        return ("front_right", "rear_right", "rear_left", "front_left")


def _text(path: Path) -> bytes:
    """Return the content of a file, without a byte order mark."""
    return path.read_bytes().removeprefix(BOM_UTF8)


def _folder(kind: type[requests.Request]) -> Traversable:
    folder = resources.files("service") / "examples"
    return folder / "routes" if kind is requests.RouteRequest else folder


def _read(
    source: str, kind: type[RequestT], field: str, noun: str
) -> tuple[RequestT, Given[RequestT]]:
    if source == "-":
        return _decoded(sys.stdin.buffer.read(), kind, Path())
    path = Path(source)
    if path.is_file() or path.is_fifo():
        try:
            return _decoded(_text(path), kind, path.parent)
        except OSError as error:
            raise InvalidInputError(f"{error.strerror}: {source}", field=field) from None
    if source in bundled(kind):
        with resources.as_file(_folder(kind)) as folder:
            whole, given = _decoded((folder / f"{source}.json").read_bytes(), kind, Path(folder))
            return whole, given._replace(files=None)
    raise InvalidInputError(
        f"no such file, and no bundled {noun} {source!r}; bundled are {', '.join(bundled(kind))}",
        field=field,
    )


def _decoded(text: bytes, kind: type[RequestT], folder: Path) -> tuple[RequestT, Given[RequestT]]:
    """Return a request with its scans and its text; its files are relative to a folder."""
    files = answering.MeshFiles(folder)
    request = wire.decode_request(text, kind)
    return files.whole(request), Given(text, request, files)
