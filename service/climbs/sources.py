"""Take many routes, or rocks to climb, as questions of bulk work."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import msgspec

from hand_models.base import CruxError
from service import requests, wire

__all__ = ["Sources"]


class Sources:
    """Files of routes, or rocks; each is read when its turn comes, with its meshes put in.

    Parameters
    ----------
    names : sequence of str
    read : callable
        Returns the request of a name.

    Attributes
    ----------
    names : sequence of str
    count : int
    """

    def __init__(
        self,
        names: Sequence[str],
        read: Callable[[str], requests.RouteRequest | requests.ClimbRequest],
    ) -> None:
        self.names = names
        self.count = len(names)
        self._read = read

    def __iter__(self) -> Iterator[bytes]:
        return (
            each.payload if isinstance(each, wire.Answer) else each for each in self.questions()
        )

    def questions(self) -> Iterator[bytes | wire.Answer]:
        """Yield requests, or the errors of their files."""
        for name in self.names:
            # an id has 256 characters at most
            known = name[-256:]
            try:
                request = self._read(name)
                request = msgspec.structs.replace(request, id=request.id or known)
                yield wire.Format.JSON.encode(request)
            except CruxError as error:
                yield wire.encode_error(error, wire.Format.JSON, known)
