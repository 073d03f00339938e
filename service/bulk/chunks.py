"""Chunks of questions: which belong together, and the one function that answers them.

It is the same wherever it runs, so that answers are equal to the last digit; their times aside, and
what a deadline has left out. Questions that have hands on the same holds are answered together.
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
from service.requests import PlanRequest, RouteRequest
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
    """Sizes and times of bulk work."""

    most_questions: int = 64
    """Most questions in a chunk: what is tried again where its process has died."""
    most_bytes: int = 2**22
    """Most bytes of a chunk of several questions, and of a window for each process."""
    window: int = 2
    """Chunks for each process that are made of questions that came together."""
    windows_ahead: int = 3
    """Such windows that may be ahead of the question whose answer is due."""
    scheduler_timeout: float = 15.0
    """Wait for a Dask scheduler, for its first worker, or for a result to come over [s]."""
    check_interval: float = 1.0
    """Between checks that the scheduler is still there, while no result comes [s]."""


BULK_SETTINGS: Final = BulkSettings()


class Setting(NamedTuple):
    """Settings that all questions of some bulk work share.

    Attributes
    ----------
    robot : RobotFile or None
        The only robot that is planned for; those that are bundled by default.
    hand : ParameterTable or None
        Entries in which hands are not the bundled one; a request's own go on top.
    folder : Path or None
        Names of mesh files in requests are relative to it; with None requests name none.
    form : Format
        Format of questions and answers.
    explain : bool or None
        Whether what keeps a stance from a plan is explained; None: as each request says.
    brief : bool
        Whether only what a table shows is asked for.
    versions : dict of str to str or None, or None
        Versions of packages at the asking process; None where the same installation answers.
    kind : str
        Kind of all questions: `ServiceName.PLAN` or `ServiceName.ROUTE`.
    make : callable or None
        Called once in each process; returns what answers questions that are of neither kind.
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
    """Return the versions of the packages on which the last digits of answers depend."""
    names = DISTRIBUTION_NAME, "numpy", "scipy", "clarabel"
    return {name: installed_version(name) for name in names}


def answer_chunk(setting: bytes, chunk: list[bytes]) -> list[Answer]:
    """Answer a chunk of questions, in whatever process.

    Parameters
    ----------
    setting : bytes
        A pickled `Setting`: models and files are built once for each that is new to the process.
    chunk : list of bytes
        Encoded questions.

    Returns
    -------
    list of Answer
        In the order of the questions.

    Raises
    ------
    CruxError
        If other versions of packages ask than are to answer.
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


def _revised(setting: Setting, request: PlanRequest | RouteRequest) -> PlanRequest | RouteRequest:
    """Return a request as it is to be answered."""
    explain = request.explain if setting.explain is None else setting.explain
    if not setting.brief or isinstance(request, RouteRequest):
        return msgspec.structs.replace(request, explain=explain)
    want = [each for each in request.want if each == "load_factor"]
    return msgspec.structs.replace(
        request,
        explain=explain,
        want=want,
        draws=[],
        detail="full" if explain else "hands",
        max_reply_bytes=None,
    )


class About(NamedTuple):
    """Digests of what must be prepared for a question.

    Attributes
    ----------
    rock : bytes
        Rocks and holds, wherever hands are on them.
    hands : bytes
        Hands and their poses on these.
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
    """Return what a request is about, as it is written; nothing where it cannot be read."""
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
    """Return the indices of questions so that what is about the same stands together.

    Groups, and questions within them, stay in the order of their first ones.
    """
    rocks: dict[bytes, int] = {}
    hands: dict[About, int] = {}
    for i, each in enumerate(abouts):
        rocks.setdefault(each.rock, i)
        hands.setdefault(each, i)
    return sorted(range(len(abouts)), key=lambda i: (rocks[abouts[i].rock], hands[abouts[i]], i))
