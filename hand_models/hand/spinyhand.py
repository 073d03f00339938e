"""SpinyHand: a hand that can be seated and closed on holds, and keeps those it closed on last."""

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
    """Closures of a finger where the rock is a little elsewhere.

    Attributes
    ----------
    closures : tuple of str
        Ends other than where it is, as of `SettledHand.closures`, and ``refused`` where the hand
        cannot be there.
    turn : float
        Largest change of the angle at which any of its joints ends [rad].
    """

    closures: tuple[str, ...]
    turn: float


class SpinyHand(HandModel):
    """A hand that closes on holds.

    Parameters
    ----------
    table : ParameterTable, optional
        The numbers; ``parameters/hand.toml`` by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.

    Attributes
    ----------
    settled, settled_scans : BoundedStore
        Hands that were settled last on holds given by numbers, and on meshes and profiles;
        `settle_each` looks there first.
    seated_best : BoundedStore
        Hands whose best seats were searched for last (`hand_models.fixed_wrist.seat_search`).
    """

    def __init__(self, table: ParameterTable | None = None) -> None:
        super().__init__(table)
        most = 256  # hands: sixty-four stances of four; each takes 20 kB
        # of triangles: twenty scans of 200,000, or the largest mesh that a request may have
        most_bytes = 150_000_000
        self.settled: BoundedStore[Hashable, SettledHand] = BoundedStore("settled hands", most)
        self.settled_scans: BoundedStore[Hashable, SettledHand] = BoundedStore(
            "settled hands on scans", most, _rock_bytes, most_bytes
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
        """Close the hand on a hold.

        Parameters
        ----------
        hold : Hold
        surface : Surface
            What a tile holds on it.
        grasp : Grasp, optional
        hold_in_hand : Pose, optional
            The hold's frame in H; without it the hand is seated (see
            `hand_models.hand.seating`), and backs off rock that would stand in its open fingers, as
            far as ``back_off``.
        at : Pose, optional
            Where it is then seated: a frame, in the hold's, that takes that one's place.

        Raises
        ------
        InvalidInputError
            If the rock stands deeper in the palm than the spines can retract, or in a finger
            wherever its joints turn.
        """
        asked = Placement(hold, surface, grasp or Grasp(), hold_in_hand, at)
        (settled,) = self.settle_each([asked])
        if isinstance(settled, InvalidInputError):
            raise settled
        return settled

    def settle_each(self, placements: Sequence[Placement]) -> list[SettledHand | InvalidInputError]:
        """Close hands like this one on their holds, all at once.

        Of the hands that were settled last, 256 are kept, and found again where hold, place,
        grasp and surface are the same: holds given by numbers where these are equal, meshes and
        profiles where they are the same object (fewer if these have more than 150 MB in
        all). Their arrays are read-only.

        Parameters
        ----------
        placements : sequence of Placement

        Returns
        -------
        list of SettledHand or InvalidInputError
            In order; the error that `settle` would raise in place of a hand that cannot be where
            it is.
        """
        scanned = [each.hold.scanned for each in placements]
        if not any(scanned):
            return self._known_or_settled(self.settled, placements)
        smooth, rough = (
            iter(
                self._known_or_settled(
                    self.settled_scans if of else self.settled,
                    [each for each, scan in zip(placements, scanned, strict=True) if scan == of],
                )
            )
            for of in (False, True)
        )
        return [next(rough if scan else smooth) for scan in scanned]

    def _known_or_settled(
        self, store: BoundedStore[Hashable, SettledHand], placements: Sequence[Placement]
    ) -> list[SettledHand | InvalidInputError]:
        keys = [PlacementKey(each) for each in placements]
        known: list[SettledHand | InvalidInputError | None] = [*store.find(keys)]
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
            store.keep(kept)
        return [outcome for outcome in known if outcome is not None]


def _rock_bytes(hands: Iterable[SettledHand]) -> int:
    """Return how many bytes the rock has that hands are on, of each hold once."""
    return sum({hand.hold: hand.hold.nbytes for hand in hands}.values())


def nearby_closures(settled: SettledHand, distance: float = 1e-4) -> tuple[NearbyClosure, ...]:
    """Return how each finger of a settled hand ends where the rock is a little elsewhere.

    Closed anew with the hold moved by a distance to and fro along each axis of H. Where two
    equilibria are close, fingers end in one here and in the other there.

    Parameters
    ----------
    settled : SettledHand
    distance : float, optional
        [m]

    Returns
    -------
    tuple of NearbyClosure
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
    """Return the SpinyHand of a table, built once; of the bundled one by default.

    Raises
    ------
    InvalidInputError
        If a number is missing or impossible.
    """
    return _built(table or hand_table())


_built = stored("hands", 32)(SpinyHand)
"""Hands by their tables, those asked for last."""
