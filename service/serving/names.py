"""Identify clients: anybody can send any name, so a name counts only as far as it is known.

A query does not say by which link it came. Zenoh reports which sessions are linked, and which one
replies to a query. So a client may prove its name: its queries carry a secret as their attachment,
and it replies at ``crux/<robot>/clients/<name>`` with the secret's digest. Whoever sends another's
name without the secret, or a name that nobody has, shares one place with all others who do.
"""

from __future__ import annotations

import hashlib
import time

from cachetools import LRUCache, TTLCache

from service.serving.settings import SERVING_SETTINGS

__all__ = ["ClientNames", "digest"]


def digest(secret: bytes) -> bytes:
    """Return the digest that a client sends of its secret."""
    return hashlib.sha256(secret).digest()


class ClientNames:
    """Links and proofs that are known of the sessions that ask. For one thread.

    Attributes
    ----------
    linked : set of str
        Sessions with a link to the service's own.
    """

    def __init__(self) -> None:
        self.linked: set[str] = set()
        most = SERVING_SETTINGS.remembered
        self._proofs: LRUCache[str, set[bytes]] = LRUCache(most)
        # made-up names are to push out no proven ones; a digest is asked for once a second
        self._asked: TTLCache[str, bool] = TTLCache(most, ttl=1.0, timer=time.perf_counter)

    def place(self, name: str, secret: bytes) -> str:
        """Return the place of a query that carries a name, and perhaps a secret.

        All clients that cannot be distinguished share the place ``""``.
        """
        proofs = self._proofs.get(name)
        if proofs is not None:
            return name if digest(secret) in proofs else ""
        return name if name in self.linked else ""

    def is_to_prove(self, name: str, secret: bytes) -> bool:
        """Return whether the session of a name is to be asked for its digest now."""
        if not name or not secret or digest(secret) in self._proofs.get(name, ()):
            return False
        if name in self._asked:
            return False
        self._asked[name] = True
        return True

    def proven(self, name: str, proof: bytes) -> None:
        """Take a digest that the session of a name has sent."""
        proofs = self._proofs.setdefault(name, set())
        # a session may have several clients
        if len(proofs) < 16:
            proofs.add(proof)

    def has_proof(self, name: str) -> bool:
        """Return whether the session of a name has sent a digest."""
        return name in self._proofs

    def gone(self, name: str) -> None:
        """Forget a session."""
        self.linked.discard(name)
        self._proofs.pop(name, None)
        self._asked.pop(name, None)
