"""Chunks of requests: the grouping of similar requests, and the function that answers a chunk.

`answer_chunk` is the same function in every kind of worker, so that answers are equal to the last
digit, except for times and for results that a deadline has cut. Requests with hands on the same
holds are answered together, because the models of rocks and hands are then built once.
"""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import msgspec

from hand_models.base import DISTRIBUTION_NAME, BoundedStore, CruxError, installed_version
from hand_models.parameters import ParameterTable
from service.requests import ClimbRequest, PlanRequest, RouteRequest
from service.wire import Answer, Format, MalformedError, ServiceName

if TYPE_CHECKING:
    from planner import RobotFile

__all__ = [
    "BULK_SETTINGS",
    "About",
    "BulkSettings",
    "Setting",
    "about",
    "answer_chunk",
    "grouping_order",
    "own_versions",
]

Answerer = Callable[[bytes], Answer]


@dataclass(frozen=True, slots=True)
class BulkSettings:
    """Sizes of chunks and windows, and timeouts of bulk work.

    A window is a batch of requests that are read together, and grouped into chunks.
    """

    most_questions: int = 64
    """Maximum requests in a chunk; the whole chunk is retried when its worker dies."""
    most_bytes: int = 2**22
    """Maximum bytes of a chunk of several requests; times the workers, those of a window."""
    window: int = 2
    """Chunks for each worker in a window."""
    windows_ahead: int = 3
    """Maximum windows that are in work beyond the request whose answer is returned next."""
    scheduler_timeout: float = 15.0
    """Timeout for a Dask scheduler, for its first worker, and for the transfer of a result [s]."""
    check_interval: float = 1.0
    """Time between checks that the Dask scheduler still runs, while no result comes [s]."""


BULK_SETTINGS: Final = BulkSettings()


class Setting(NamedTuple):
    """Settings that all requests of a bulk run share. A setting is pickled and sent to workers.

    Attributes
    ----------
    robot : RobotFile or None
        The only robot that is planned for; None for the bundled robots.
    hand : ParameterTable or None
        Hand parameters that differ from the bundled hand; values in a request take precedence.
    folder : Path or None
        Folder that relative names of mesh files start from; None if requests may not name files.
    form : Format
        Encoding of requests and answers.
    explain : bool or None
        Whether infeasible stances are explained (irreducible infeasible subset); None to do as each
        request says.
    brief : bool
        True if answers contain only the columns of a table.
    versions : dict of str to str or None, or None
        Package versions of the client, which workers compare with their versions; None if workers
        use the same installation.
    kind : str
        Type of all requests: `ServiceName.PLAN`, `ServiceName.ROUTE` or `ServiceName.CLIMB`.
    make : callable or None
        Called once in each worker; returns a function that maps an encoded request to its `Answer`.
        This function replaces the handlers of requests.
    """

    robot: RobotFile | None = None
    hand: ParameterTable | None = None
    folder: Path | None = None
    form: Format = Format.JSON
    explain: bool | None = None
    brief: bool = False
    versions: dict[str, str | None] | None = None
    kind: str = ServiceName.PLAN
    make: Callable[[], Answerer] | None = None


def own_versions() -> dict[str, str | None]:
    """Return the versions of the packages that can change the last digits of answers.

    Returns
    -------
    dict of str to str or None
        Version by package name; None for a package that is not installed.
    """
    names = DISTRIBUTION_NAME, "numpy", "scipy", "clarabel"
    return {name: installed_version(name) for name in names}


def answer_chunk(setting: bytes, chunk: list[bytes]) -> list[Answer]:
    """Answer a chunk of requests; workers of every kind call this function.

    Parameters
    ----------
    setting : bytes
        A pickled `Setting`. Each process builds the models and reads the files of a new setting
        once.
    chunk : list of bytes
        Encoded requests.

    Returns
    -------
    list of Answer
        Encoded replies or error replies, in the order of the requests.

    Raises
    ------
    CruxError
        If this process has other versions of the packages than the client.
    """
    answer = _answerers.get(setting, partial(_answerer, setting))
    return [answer(payload) for payload in chunk]


_answerers: BoundedStore[bytes, Answerer] = BoundedStore("bulk settings", 4)


def _answerer(pickled: bytes) -> Answerer:
    """Return the function that answers a question; each process imports the planner here."""
    from service.answering import MeshFiles, handle, robots_of

    setting: Setting = pickle.loads(pickled)
    if setting.versions is not None:
        _check_versions(setting.versions)
    if setting.make is not None:
        return setting.make()
    robots = robots_of(setting.robot)
    files = None if setting.folder is None else MeshFiles(setting.folder)
    revised = partial(_revised, setting)

    def answer(payload: bytes) -> Answer:
        start = time.perf_counter()
        found = handle(
            setting.kind,
            payload,
            setting.form.value,
            setting.hand,
            robots,
            started=start,
            files=files,
            revised=revised,
        )
        return found._replace(seconds=time.perf_counter() - start)

    return answer


def _check_versions(there: dict[str, str | None]) -> None:
    here = own_versions()
    other = [name for name in here if there.get(name) != here[name]]
    if other:
        listed = (", ".join(f"{name} {at.get(name)}" for name in other) for at in (here, there))
        raise CruxError(
            "the worker has {}, and the client {}: install the same versions on both, for answers "
            "that are equal to the last digit".format(*listed)
        )


def _revised(
    setting: Setting, request: PlanRequest | RouteRequest | ClimbRequest
) -> PlanRequest | RouteRequest | ClimbRequest:
    """Return a request as it is to be answered."""
    if isinstance(request, ClimbRequest):
        return request
    explain = request.explain if setting.explain is None else setting.explain
    if not setting.brief or isinstance(request, RouteRequest):
        return msgspec.structs.replace(request, explain=explain)
    want = [each for each in request.want if each == "load_factor"]
    return msgspec.structs.replace(
        request,
        explain=explain,
        want=want,
        draws=[],
        open_loop=None,
        survival=None,
        detail="full" if explain else "hands",
        max_reply_bytes=None,
    )


class About(NamedTuple):
    """Digests of a request's rocks and hands; requests with equal digests share prepared models.

    Attributes
    ----------
    rock : bytes
        Digest of the shapes of all rocks and holds.
    hands : bytes
        Digest of all hands with their poses and holds, and of the hand parameters.
    """

    rock: bytes = b""
    hands: bytes = b""


class _Hand(msgspec.Struct):
    hold: msgspec.Raw = msgspec.Raw(b"null")


class _Stance(msgspec.Struct):
    hands: list[msgspec.Raw] = []
    rocks: msgspec.Raw = msgspec.Raw(b"null")
    hand: msgspec.Raw = msgspec.Raw(b"null")


class _Request(msgspec.Struct):
    stance: _Stance


def about(payload: bytes, form: Format) -> About:
    """Return the digests of a request's rocks and hands; empty digests if it cannot be decoded.

    Parameters
    ----------
    payload : bytes
        Encoded request.
    form : Format
        Encoding of the request.

    Returns
    -------
    About
        Digests of the encoded bytes: two texts for the same rock give two digests.
    """
    try:
        stance = form.decode(payload, _Request).stance
        holds = [form.decode(bytes(hand), _Hand).hold for hand in stance.hands]
    except (MalformedError, msgspec.ValidationError):
        return About()
    return About(_digest(stance.rocks, *holds), _digest(stance.hand, *stance.hands))


def _digest(*parts: msgspec.Raw) -> bytes:
    found = blake2b(digest_size=8)
    for part in parts:
        found.update(part)
        found.update(b"\n")
    return found.digest()


def grouping_order(abouts: Sequence[About]) -> list[int]:
    """Return an order of requests in which requests with the same rocks and hands are neighbours.

    Parameters
    ----------
    abouts : sequence of About
        Digests of each request.

    Returns
    -------
    list of int
        Indices of the requests. Groups are in the order of their first requests, and requests keep
        their order within a group.
    """
    rocks: dict[bytes, int] = {}
    hands: dict[About, int] = {}
    for i, each in enumerate(abouts):
        rocks.setdefault(each.rock, i)
        hands.setdefault(each, i)
    return sorted(range(len(abouts)), key=lambda i: (rocks[abouts[i].rock], hands[abouts[i]], i))
