"""Read the mesh files that requests name, through a cache, so that requests contain meshes."""

from __future__ import annotations

import os
from collections.abc import Hashable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import msgspec

from hand_models.base import BoundedStore, InvalidInputError, errors_under
from hand_models.rock import read_mesh
from service.requests import (
    ClimbRequest,
    Hand,
    Hold,
    MeshMessage,
    PlanRequest,
    Request,
    RouteRequest,
)

__all__ = ["MeshFiles"]

HandT = TypeVar("HandT", bound=Hand)
HoldT = TypeVar("HoldT", bound=Hold)
RequestT = TypeVar("RequestT", bound=Request)


class MeshFiles:
    """Reader of mesh files, with an LRU cache of the last eight; a changed file is read again.

    Parameters
    ----------
    folder : Path
        Folder that relative names of mesh files start from.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read: BoundedStore[Hashable, MeshMessage] = BoundedStore("mesh files", 8)

    def whole(self, request: RequestT) -> RequestT:
        """Replace the mesh files that a request names by their vertices and faces.

        Parameters
        ----------
        request : Request
            Request of any kind; only plans, routes and climbs name files.

        Returns
        -------
        Request
            A new request without files.

        Raises
        ------
        InvalidInputError
            If a file cannot be read, or a mesh has both a file and vertices or faces. The error's
            ``field`` is a path in the request.
        """
        replace = msgspec.structs.replace
        if isinstance(request, ClimbRequest) and isinstance(request.rock, MeshMessage):
            request = replace(request, rock=self._filled(request.rock, "rock"))
        if isinstance(request, (PlanRequest, RouteRequest)):
            stance = request.stance
            rocks = {
                name: self._filled(rock, f"stance.rocks.{name}")
                for name, rock in stance.rocks.items()
            }
            hands = self._hands(stance.hands, "stance.hands")
            request = replace(request, stance=replace(stance, rocks=rocks, hands=hands))
        if isinstance(request, RouteRequest):
            request = replace(request, moves=self._hands(request.moves, "moves"))
        return request

    def named(self, request: PlanRequest, given: PlanRequest, folder: Path) -> PlanRequest:
        """Replace vertices and faces in a request by the mesh files that they were read from.

        Parameters
        ----------
        request : PlanRequest
            Request with whole meshes, as `whole` returns it.
        given : PlanRequest
            Request that names the files, as it was before `whole`.
        folder : Path
            Folder that relative names are to start from; absolute names stay.

        Returns
        -------
        PlanRequest
            A new request that names the files.
        """
        replace = msgspec.structs.replace

        def renamed(hold: HoldT, before: Hold) -> HoldT:
            if (
                not isinstance(hold, MeshMessage)
                or not isinstance(before, MeshMessage)
                or before.file is None
            ):
                return hold
            file = before.file
            if not Path(file).is_absolute():
                file = os.path.relpath(self._folder / file, folder)
            return replace(hold, vertices=None, faces=None, file=file)

        stance, before = request.stance, given.stance
        rocks = {name: renamed(rock, before.rocks[name]) for name, rock in stance.rocks.items()}
        hands = [
            replace(hand, hold=renamed(hand.hold, other.hold))
            for hand, other in zip(stance.hands, before.hands, strict=True)
        ]
        return replace(request, stance=replace(stance, rocks=rocks, hands=hands))

    def _hands(self, hands: list[HandT], path: str) -> list[HandT]:
        return [
            msgspec.structs.replace(hand, hold=self._filled(hand.hold, f"{path}[{i}].hold"))
            for i, hand in enumerate(hands)
        ]

    def _filled(self, hold: HoldT, path: str) -> HoldT:
        if not isinstance(hold, MeshMessage) or hold.file is None:
            return hold
        with errors_under(path):
            if hold.vertices is not None or hold.faces is not None:
                raise InvalidInputError(
                    "give a file, or vertices and faces, not both", field="file"
                )
            known = self._mesh(self._folder / hold.file)
        return msgspec.structs.replace(hold, vertices=known.vertices, faces=known.faces, file=None)

    def _mesh(self, path: Path) -> MeshMessage:
        changed = None
        with suppress(OSError):  # reading reports a missing file
            changed = path.stat().st_mtime_ns

        def read() -> MeshMessage:
            vertices, faces = read_mesh(path)
            # tuples, which the garbage collector does not look at, take a fifth of the lists' time
            columns = (array.T.tolist() for array in (vertices, faces))
            points, corners = (list(zip(*each, strict=True)) for each in columns)
            return MeshMessage(vertices=points, faces=corners)

        return self._read.get((path, changed), read)
