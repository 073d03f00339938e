"""Identify clients: any session can send any identifier, so an identifier must be proven.

A query does not say over which link it came. Zenoh reports which sessions are linked, and which
session replies to a query. Therefore a client can prove its identifier: its queries carry a secret
as attachment, and it answers queries at ``crux/<robot>/clients/<name>`` with the digest of that
secret. All queries with an identifier but without the right secret, or with an identifier that no
known session has, share one anonymous place.
"""

from __future__ import annotations

import hashlib
import itertools
import secrets
import time

import zenoh
from cachetools import LRUCache, TTLCache
from zenoh.handlers import Callback

from service.serving.settings import SERVING_SETTINGS
from service.wire import ServiceName, service_key

__all__ = ["ClientIdentity", "ClientNames", "digest"]


def digest(secret: bytes) -> bytes:
    """Return the SHA-256 digest of a client's secret, 32 bytes."""
    return hashlib.sha256(secret).digest()


class ClientIdentity:
    """Declarations of a client, by which a service gives it its turns and knows when it has gone.

    Parameters
    ----------
    session : zenoh.Session
        The client's session.
    robot : str
        Name of the robot whose service is asked.

    Attributes
    ----------
    secret : bytes
        Attachment of the client's queries; its digest proves that nobody else asks in its name.
    """

    def __init__(self, session: zenoh.Session, robot: str) -> None:
        self._asked = itertools.count()
        self._querier = session.declare_querier(service_key(robot, ServiceName.PLAN))
        # read once: a querier cannot be read while another thread withdraws it
        self._id = self._querier.id
        here = service_key(robot, f"{ServiceName.CLIENTS}/{session.info.zid()}")
        self._token = session.liveliness().declare_token(here)
        self.secret = secrets.token_bytes(16)
        proof = digest(self.secret)

        def prove(query: zenoh.Query) -> None:
            with query:
                query.reply(here, proof)

        self._proof = session.declare_queryable(here, Callback(prove, indirect=False))

    def source(self) -> zenoh.SourceInfo:
        """Return the identifier of the session, with the number of the next query."""
        return zenoh.SourceInfo(self._id, next(self._asked))

    def withdraw(self) -> None:
        """Withdraw the declarations."""
        self._token.undeclare()
        self._proof.undeclare()
        self._querier.undeclare()


class ClientNames:
    """Record of the sessions that ask questions: their links, and proofs of their identifiers.

    For use in one thread. Proofs are in an LRU cache of 4096 sessions. Callers by ROS 2 have no
    proof: whoever makes up identifiers gets as many places as there are for such callers, at most.

    Attributes
    ----------
    linked : set of str
        Identifiers of the sessions with a link to the service's own session.
    """

    def __init__(self) -> None:
        self.linked: set[str] = set()
        most = SERVING_SETTINGS.remembered
        self._proofs: LRUCache[str, set[bytes]] = LRUCache(most)
        # made-up names are to push out no proven ones; a digest is asked for once a second
        self._asked: TTLCache[str, bool] = TTLCache(most, ttl=1.0, timer=time.perf_counter)
        self._ros: TTLCache[bytes, str] = TTLCache(
            SERVING_SETTINGS.ros_callers,
            ttl=SERVING_SETTINGS.ros_caller_time,
            timer=time.perf_counter,
        )

    def place(self, name: str, secret: bytes, caller: bytes = b"") -> str:
        """Return the place (client) that a query counts for when workers' time is shared.

        Parameters
        ----------
        name : str
            Identifier in the query; empty if there is none.
        secret : bytes
            Attachment of the query; empty if there is none.
        caller : bytes, optional
            Global identifier of the caller by ROS 2, which has a place of its own unless too many
            have one.

        Returns
        -------
        str
            The identifier, if it is proven by the secret, or if no proof is known and its session
            is linked. Otherwise ``""``, the place of all clients that cannot be distinguished.
        """
        if caller:
            self._ros.expire()
            if caller not in self._ros and len(self._ros) == self._ros.maxsize:
                return ""
            # from now on it is remembered for the full time again
            self._ros[caller] = f"ros2 {caller.hex()}"
            return self._ros[caller]
        proofs = self._proofs.get(name)
        if proofs is not None:
            return name if digest(secret) in proofs else ""
        return name if name in self.linked else ""

    def is_to_prove(self, name: str, secret: bytes) -> bool:
        """Return whether a session must now be asked for the digest of its secret.

        The answer is true at most once a second for each identifier, and false where the secret is
        already proven, or where identifier or secret is empty.
        """
        if not name or not secret or digest(secret) in self._proofs.get(name, ()):
            return False
        if name in self._asked:
            return False
        self._asked[name] = True
        return True

    def proven(self, name: str, proof: bytes) -> None:
        """Store a digest that a session has sent as proof; up to 16 of each session."""
        proofs = self._proofs.setdefault(name, set())
        # a session may have several clients
        if len(proofs) < 16:
            proofs.add(proof)

    def has_proof(self, name: str) -> bool:
        """Return whether a digest of the session with an identifier is stored."""
        return name in self._proofs

    def connected(self) -> frozenset[str]:
        """Return the places of all sessions that are linked or proven, and of ROS 2's callers."""
        return frozenset(self.linked) | frozenset(self._proofs) | frozenset(self._ros.values())

    def gone(self, name: str) -> None:
        """Forget the link and the digests of a session that has disconnected."""
        self.linked.discard(name)
        self._proofs.pop(name, None)
        self._asked.pop(name, None)
