"""Read the stance or the route of a command from a file, standard input, or the bundled examples.

Mesh files that holds name are read here, too, so that the request is complete.
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
    """Request as the user wrote it, with the files that it names.

    Attributes
    ----------
    text : bytes
        JSON text of the request.
    request : Request
        Decoded text, still with the names of its mesh files.
    files : MeshFiles or None
        The mesh files that were read; None for a bundled request, whose files may be gone.
    """

    text: bytes
    request: RequestT
    files: answering.MeshFiles | None


def bundled(kind: type[requests.Request] = requests.PlanRequest) -> tuple[str, ...]:
    """Return the sorted names of the bundled stances or routes.

    Parameters
    ----------
    kind : type, optional
        `PlanRequest` for stances, `RouteRequest` for routes.
    """
    files = [file.name for file in _folder(kind).iterdir()]
    return tuple(sorted(name.removesuffix(".json") for name in files if name.endswith(".json")))


def read_request(source: str) -> requests.PlanRequest:
    """Read the plan request that a command was given as STANCE.

    Parameters
    ----------
    source : str
        Path of a JSON file, ``-`` for standard input, or the name of a bundled stance.

    Returns
    -------
    PlanRequest
        The request, with the vertices and faces of the mesh files that it names.

    Raises
    ------
    InvalidInputError
        If the source does not exist or cannot be read, or is not a valid plan request.
    """
    return read_with_text(source)[0]


def read_with_text(source: str) -> tuple[requests.PlanRequest, Given[requests.PlanRequest]]:
    """Read a plan request as `read_request` does, and return its text as well.

    Returns
    -------
    request : PlanRequest
        The request, with the vertices and faces of the mesh files that it names.
    given : Given
        The request as the user wrote it.
    """
    return _read(source, requests.PlanRequest, "STANCE", "stance")


def read_route(source: str) -> requests.RouteRequest:
    """Read the route request that a command was given as ROUTE.

    Parameters
    ----------
    source : str
        Path of a JSON file, ``-`` for standard input, or the name of a bundled route.

    Returns
    -------
    RouteRequest
        The request, with the vertices and faces of the mesh files that it names.

    Raises
    ------
    InvalidInputError
        If the source does not exist or cannot be read, or is not a valid route request.
    """
    return _read(source, requests.RouteRequest, "ROUTE", "route")[0]


def limbs_of(source: str | None) -> tuple[str, ...]:
    """Return the names of the limbs with a hand in a stance, for shell completion.

    Parameters
    ----------
    source : str or None
        Path of a JSON file, or the name of a bundled stance.

    Returns
    -------
    tuple of str
        The limbs of RoboSimian if the stance is None or cannot be read.
    """
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
