"""Read the stance or the route of a command from a file, standard input, or the bundled examples.

A request is JSON, or TOML in a file that ends in .toml or a text that begins with a comment (#).
Mesh files that holds name are read here, too, so that the request is complete.
"""

from __future__ import annotations

import sys
import tomllib
from codecs import BOM_UTF8
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import click
import msgspec
from click.shell_completion import CompletionItem

from hand_models.base import InvalidInputError
from service import answering, bulk, requests, wire

__all__ = [
    "Given",
    "beginning_so",
    "bundled",
    "is_folder",
    "limbs_of",
    "read_candidates",
    "read_request",
    "read_route",
    "read_route_with_text",
    "read_stance_or_route",
    "read_with_text",
    "routes_of",
]

RequestT = TypeVar("RequestT", bound=requests.Request)
StanceOrRoute = requests.PlanRequest | requests.RouteRequest


class Given(NamedTuple, Generic[RequestT]):
    """Request as the user wrote it, with the files that it names.

    Attributes
    ----------
    text : bytes
        JSON text of the request; of one in TOML, the same in JSON.
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
        Path of a JSON or TOML file, ``-`` for standard input, or the name of a bundled stance.

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
    return _read(source, "STANCE", "stance", requests.PlanRequest)


def read_route(source: str) -> requests.RouteRequest:
    """Read the route request that a command was given as ROUTE.

    Parameters
    ----------
    source : str
        Path of a JSON or TOML file, ``-`` for standard input, or the name of a bundled route.

    Returns
    -------
    RouteRequest
        The request, with the vertices and faces of the mesh files that it names.

    Raises
    ------
    InvalidInputError
        If the source does not exist or cannot be read, or is not a valid route request.
    """
    return read_route_with_text(source)[0]


def read_route_with_text(
    source: str,
) -> tuple[requests.RouteRequest, Given[requests.RouteRequest]]:
    """Read a route request as `read_route` does, and return it as the user wrote it as well."""
    return _read(source, "ROUTE", "route", requests.RouteRequest)


def read_stance_or_route(source: str) -> StanceOrRoute:
    """Read what a command was given as STANCE or ROUTE; with ``moves`` it is a route.

    Parameters
    ----------
    source : str
        Path of a JSON or TOML file, ``-`` for standard input, or the name of a bundled stance or
        route.

    Returns
    -------
    PlanRequest or RouteRequest
        The request, with the vertices and faces of the mesh files that it names.

    Raises
    ------
    InvalidInputError
        If the source does not exist or cannot be read, or is not a valid request.
    """
    kinds: tuple[type[StanceOrRoute], ...] = (requests.PlanRequest, requests.RouteRequest)
    return _read(source, "STANCE", "stance or route", *kinds)[0]


def _has_moves(text: bytes, name: str) -> bool:
    """Return True if a request has moves; what cannot be read has none."""
    try:
        content = _content(text, name)
    except (wire.MalformedError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return False
    return isinstance(content, dict) and "moves" in content


def read_candidates(source: str) -> Iterator[tuple[str, requests.PlanRequest | InvalidInputError]]:
    """Yield the plan requests of a file of JSON lines, or of a folder of stance files.

    Parameters
    ----------
    source : str
        Path of a file of JSON lines, ``-`` for standard input, or the path of a folder, whose files
        that end in .json or .toml are read in the order of their names.

    Yields
    ------
    name : str
        ``line`` and its number, or the name of the file.
    request : PlanRequest or InvalidInputError
        The request with its meshes, or what is wrong with it.

    Raises
    ------
    InvalidInputError
        If the source cannot be read, or has no requests.
    """
    path, found = Path(source), False
    if path.is_dir():
        for each in sorted(path.iterdir()):
            if each.suffix.lower() in (".json", ".toml"):
                found = True
                yield each.name, _or_error(read_request, str(each))
    else:
        files = answering.MeshFiles(Path() if source == "-" else path.parent)
        with closing(bulk.Lines(source, "CANDIDATES")) as lines:
            for number, line in lines.numbered():
                found = True
                yield f"line {number}", _or_error(_whole, line, files)
    if not found:
        raise InvalidInputError(
            f"{source}: has no stances; give lines of JSON, or files .json or .toml",
            field="CANDIDATES",
        )


def is_folder(source: str) -> bool:
    """Return whether a folder is meant, not a bundled route whose name a folder has, too."""
    return Path(source).is_dir() and source not in bundled(requests.RouteRequest)


def routes_of(source: str) -> list[str]:
    """Return the routes of a folder in the order of their names, or the one that is meant."""
    if source == "-":
        raise InvalidInputError(
            "standard input is one route: give it alone, with -o DIR", field="ROUTE"
        )
    if not is_folder(source):
        return [source]
    found = sorted(str(path) for path in Path(source).glob("*.json"))
    if not found:
        raise InvalidInputError(f"{source}: no file in this folder ends in .json", field="ROUTE")
    return found


def _whole(line: bytes, files: answering.MeshFiles) -> requests.PlanRequest:
    return files.whole(wire.decode_request(line, requests.PlanRequest))


def _or_error(
    read: Callable[..., requests.PlanRequest], *given: Any
) -> requests.PlanRequest | InvalidInputError:
    """Return a request that is read, or the error of reading it."""
    try:
        return read(*given)
    except InvalidInputError as error:
        return error


def beginning_so(
    names: Iterable[str], *, files: bool = False
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """Return the function that completes a name in the shell; with ``files``, a path, too."""

    def complete(_: click.Context, __: click.Parameter, begun: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in names if name.startswith(begun)]
        # if the file came last, click's function for bash would drop the names
        return [CompletionItem(begun, type="file"), *found] if files else found

    return complete


def limbs_of(source: str | None) -> tuple[str, ...]:
    """Return the names of the limbs with a hand in a stance, for shell completion.

    Parameters
    ----------
    source : str or None
        Path of a JSON or TOML file, or the name of a bundled stance.

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
        asked = _content(_text(path), path.name)
        return tuple(str(hand["limb"]) for hand in asked["stance"]["hands"])
    except (OSError, wire.MalformedError, msgspec.DecodeError, LookupError, TypeError):
        return ("front_right", "rear_right", "rear_left", "front_left")


def _text(path: Traversable) -> bytes:
    """Return the content of a file, without a byte order mark."""
    return path.read_bytes().removeprefix(BOM_UTF8)


def _is_toml(text: bytes, name: str) -> bool:
    """Return True if a request is written in TOML; no JSON begins with a comment."""
    return name.lower().endswith(".toml") or text.lstrip()[:1] == b"#"


def _content(text: bytes, name: str) -> Any:
    """Return the content of a request in JSON or TOML."""
    return _from_toml(text) if _is_toml(text, name) else msgspec.json.decode(text)


def _from_toml(text: bytes) -> dict[str, Any]:
    """Return the content of TOML text.

    Raises
    ------
    MalformedError
        If the text is not TOML in UTF-8.
    """
    try:
        content: dict[str, Any] = _in_64_bits(tomllib.loads(text.decode()))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise wire.MalformedError(f"not valid TOML: {error or 'nested too deep'}") from None
    return content


def _in_64_bits(content: Any) -> Any:
    """Return a content in which whole numbers beyond 64 bits are floats, as msgspec reads them."""
    if isinstance(content, dict):
        return {name: _in_64_bits(each) for name, each in content.items()}
    if isinstance(content, list):
        return [_in_64_bits(each) for each in content]
    large = isinstance(content, int) and not -(2**63) <= content < 2**64
    return float(str(content)) if large else content


def _folder(kind: type[requests.Request]) -> Traversable:
    folder = resources.files("service") / "examples"
    return folder / "routes" if kind is requests.RouteRequest else folder


def _read(
    source: str, field: str, noun: str, *kinds: type[RequestT]
) -> tuple[RequestT, Given[RequestT]]:
    """Read a request of one of the kinds; of two, it is of the last if it has moves."""
    path = Path(source)
    if source == "-" or path.is_file() or path.is_fifo():
        text = sys.stdin.buffer.read() if source == "-" else _read_file(path, field)
        moves = len(kinds) > 1 and _has_moves(text, path.name)
        return _decoded(text, kinds[-1 if moves else 0], path)
    for kind in kinds:
        if source in bundled(kind):
            with resources.as_file(_folder(kind)) as folder:
                path = folder / f"{source}.json"
                whole, given = _decoded(path.read_bytes(), kind, path)
                return whole, given._replace(files=None)
    if path.is_dir():
        raise InvalidInputError(f"is a folder: {path}; name a file in it", field=field)
    names = ", ".join(name for kind in kinds for name in bundled(kind))
    raise InvalidInputError(
        f"no such file, and no bundled {noun} {source!r}; bundled are {names}", field=field
    )


def _read_file(path: Path, field: str) -> bytes:
    try:
        return _text(path)
    except OSError as error:
        raise InvalidInputError(f"{error.strerror}: {path}", field=field) from None


def _decoded(text: bytes, kind: type[RequestT], path: Path) -> tuple[RequestT, Given[RequestT]]:
    """Return a request with its scans and its text; its files are relative to that of the text."""
    files = answering.MeshFiles(path.parent)
    if _is_toml(text, path.name):
        content = _from_toml(text)
        # unlike JSON, MessagePack has the numbers that are not finite, which are refused
        request = wire.decode_request(msgspec.msgpack.encode(content), kind, wire.Format.MSGPACK)
        text = msgspec.json.encode(content)
    else:
        request = wire.decode_request(text, kind)
    return files.whole(request), Given(text, request, files)
