"""SpinyHand: close the hand on holds, with an LRU cache of the hands settled last."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import BoundedStore, InvalidInputError, Pose, stored
from hand_models.hand.grasp import Grasp
from hand_models.hand.model import HandModel
from hand_models.hand.placement import Placement, PlacementKey
from hand_models.hand.settled_hand import SettledHand
from hand_models.hand.settling import settle_hands
from hand_models.parameters import ParameterTable, hand_table
from hand_models.rock import Hold
from hand_models.tile import Surface

__all__ = ["NearbyClosure", "SpinyHand", "nearby_closures", "spiny_hand"]


class NearbyClosure(NamedTuple):
    """Other closures of a finger if the rock is moved by a small distance.

    Attributes
    ----------
    closures : tuple of str
        Closures other than the finger's present one, from `SettledHand.closures`, sorted; with
        ``refused`` if the whole hand could not close on the moved rock.
    turn : float
        Largest change of any of the finger's joint angles [rad].
    """

    closures: tuple[str, ...]
    turn: float


class SpinyHand(HandModel):
    """The hand with its closing: seats a hand on a hold and closes its fingers on the rock.

    Hands that were settled last are kept in LRU caches.

    Parameters
    ----------
    table : ParameterTable, optional
        The hand's numbers; ``parameters/hand.toml`` by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.

    Attributes
    ----------
    settled : BoundedStore
        Cache of settled hands. `settle_each` looks here first.
    seated_best : BoundedStore
        Cache of hands in the best seats found by `hand_models.fixed_wrist.seat_search`.
    """

    def __init__(self, table: ParameterTable | None = None) -> None:
        super().__init__(table)
        most = 256  # hands: sixty-four stances of four; each takes 20 kB
        # of triangles: twenty scans of 200,000, or the largest mesh that a request may have
        most_bytes = 150_000_000
        self.settled: BoundedStore[Hashable, SettledHand] = BoundedStore(
            "settled hands", most, _rock_bytes, most_bytes
        )
        self.seated_best: BoundedStore[Hashable, SettledHand] = BoundedStore(
            "best seats", most, _rock_bytes, most_bytes
        )

    def __reduce__(self) -> tuple[Callable[[ParameterTable], SpinyHand], tuple[ParameterTable]]:
        return spiny_hand, (self.table,)

    def settle(
        self,
        hold: Hold,
        surface: Surface,
        grasp: Grasp | None = None,
        hold_in_hand: Pose | None = None,
        at: Pose | None = None,
    ) -> SettledHand:
        """Close the hand on one hold.

        Parameters
        ----------
        hold : Hold
        surface : Surface
            Strength of a tile on the hold.
        grasp : Grasp, optional
            Default grasp if left out.
        hold_in_hand : Pose, optional
            The hold's frame in the hand frame H. If left out, the hand is seated (see
            `hand_models.hand.seating`), and backs off by at most ``back_off`` from rock inside its
            open fingers.
        at : Pose, optional
            Frame on the hold, in the hold's frame, on which to seat the hand; the hold's own frame
            by default. Only used without ``hold_in_hand``.

        Returns
        -------
        SettledHand

        Raises
        ------
        InvalidInputError
            If rock is deeper in the palm than the spines can retract, or inside a finger even with
            its joints fully open; if the closing tension is above the tendon's maximum or too small
            to close the fingers; or if no equilibrium of a finger is found.
        """
        asked = Placement(hold, surface, grasp or Grasp(), hold_in_hand, at)
        (settled,) = self.settle_each([asked])
        if isinstance(settled, InvalidInputError):
            raise settled
        return settled

    def settle_each(self, placements: Sequence[Placement]) -> list[SettledHand | InvalidInputError]:
        """Close copies of this hand on many holds together.

        The last 256 settled hands are kept in an LRU cache. The key is hold, pose, grasp and
        surface: holds given by numbers are compared by value, meshes and profiles by identity
        (fewer hands are kept if these exceed 150 MB in all). Arrays of the results are read-only.

        Parameters
        ----------
        placements : sequence of Placement

        Returns
        -------
        list of SettledHand or InvalidInputError
            In the order of ``placements``; for a hand that cannot close, the error that `settle`
            would raise.
        """
        keys = [PlacementKey(each) for each in placements]
        known: list[SettledHand | InvalidInputError | None] = [*self.settled.find(keys)]
        new: dict[PlacementKey, list[int]] = {}
        for i, key in enumerate(keys):
            if known[i] is None:
                new.setdefault(key, []).append(i)
        if new:
            outcomes = settle_hands(self, [placements[alike[0]] for alike in new.values()])
            kept: list[tuple[Hashable, SettledHand]] = []
            for (key, alike), outcome in zip(new.items(), outcomes, strict=True):
                if isinstance(outcome, SettledHand):
                    kept.append((key, outcome))
                for i in alike:
                    known[i] = outcome
            self.settled.keep(kept)
        return [outcome for outcome in known if outcome is not None]

    def keep(self, closed: Iterable[tuple[Placement, SettledHand]]) -> None:
        """Add closed hands, each with its placement, to the cache that `settle_each` searches."""
        self.settled.keep([(PlacementKey(placement), settled) for placement, settled in closed])


def _rock_bytes(hands: Iterable[SettledHand]) -> int:
    """Return how many bytes the rock has that hands are on, of each hold once."""
    return sum({hand.hold: hand.hold.nbytes for hand in hands if hand.hold.nbytes}.values())


def nearby_closures(settled: SettledHand, distance: float = 1e-4) -> tuple[NearbyClosure, ...]:
    """Return how each finger of a settled hand would close if the rock were slightly elsewhere.

    The hand closes again with the hold moved by ``distance`` to and fro along each axis of the hand
    frame H. Fingers with two equilibria close to each other change their closure.

    Parameters
    ----------
    settled : SettledHand
    distance : float, optional
        Displacement of the hold [m].

    Returns
    -------
    tuple of NearbyClosure, length 4
        In the order of `FINGERS`.
    """
    pose = settled.seating.pose
    places = [
        Pose(pose.position + step, pose.rotation)
        for step in distance * np.vstack([np.eye(3), -np.eye(3)])
    ]
    there = settle_hands(
        settled.hand,
        [Placement(settled.hold, settled.surface, settled.grasp, at) for at in places],
    )
    hands = [each for each in there if isinstance(each, SettledHand)]
    refused = {"refused"} if len(hands) < len(there) else set()
    bent = [np.diff(hand.postures.angles, prepend=0.0) for hand in (settled, *hands)]
    turns = np.abs(np.array(bent) - bent[0]).max(axis=(0, 2))
    return tuple(
        NearbyClosure(tuple(sorted(({*ends} | refused) - {now})), turn)
        for now, turn, *ends in zip(
            settled.closures, turns.tolist(), *(hand.closures for hand in hands), strict=True
        )
    )


def spiny_hand(table: ParameterTable | None = None) -> SpinyHand:
    """Return the `SpinyHand` of a parameter table, built once per table and kept in an LRU cache.

    Parameters
    ----------
    table : ParameterTable, optional
        The bundled ``parameters/hand.toml`` by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.
    """
    return _built(table or hand_table())


_built = stored("hands", 32)(SpinyHand)
"""Cached constructor: the hands of the last 32 tables."""
