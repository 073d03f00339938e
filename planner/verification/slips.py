"""Check what a plan says of tiles that have slipped, from the list of their names alone.

A tile on that list drags on with friction, or is off the rock: its shear is μ times a normal load
that is not negative, and it has no lateral load. All other tiles touch as they closed, unless their
whole finger is off the rock.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hand_models.base import Indices
from planner.prepare import CONTACT_CODES, contact_pattern_of
from planner.question import LostTile
from planner.verification.residuals import PartNames, Recomputed, Residual, ResidualLimits

__all__ = ["SlippedTiles"]


class SlippedTiles(ResidualLimits):
    """The loads and contacts of tiles that have slipped.

    Parameters
    ----------
    names : PartNames
        Names of the hands' parts.
    lost : sequence of LostTile
        The tiles that have slipped.
    closed : ndarray of int, shape (T,), optional
        Contact state of each tile before any slipped, as code of `CONTACT_CODES`; by default those
        of the hands as they closed.
    """

    def __init__(
        self,
        names: PartNames,
        lost: Sequence[LostTile],
        closed: Indices | None = None,
    ) -> None:
        self._names, known = names, names.known
        gone = {(tile.limb, tile.finger, tile.phalanx) for tile in lost}
        pairs = zip(names.limbs, known.hands, strict=True)
        named = [(limb, *tile[:2]) for limb, hand in pairs for tile in hand.tiles]
        tiles = [t for t, name in enumerate(named) if name in gone]
        self._tiles = np.array(tiles, dtype=np.intp)
        self._found = len(tiles) == len({*lost})
        self._friction = known.friction[self._tiles]
        if closed is None:
            as_closed = [hand.as_closed.tiles for hand in known.hands]
            closed = contact_pattern_of(as_closed, known.places).contacts
        self._closed = closed

    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals of friction of the tiles that have slipped, which only presses."""
        loads, hand = again.arrays.loads[self._tiles], self._names.known.places.hand[self._tiles]
        shear, normal, lateral = loads.T
        off = np.column_stack((shear - self._friction * normal, lateral))
        text = " has slipped: {:.6g} N along and {:.6g} N across the rock are not friction"
        pulled = " has slipped: it cannot pull with {:.6g} N"
        return [
            Residual("zero", off, hand, self._name, text, (shear, normal)),
            Residual("least", normal, hand, self._name, pulled, (-normal,)),
        ]

    def contacts(self) -> Iterator[str]:
        """Yield an error message for each tile with a contact state that it cannot have.

        `check_contacts` compares the plan's contact states with those of the hands.
        """
        if not self._found:
            yield "a tile that is said to have slipped is not in this stance"
        known = self._names.known
        now = known.touch.contacts
        off = now == CONTACT_CODES["none"]
        whole = np.logical_and.reduceat(off, known.places.first_of_finger)[known.places.finger]
        wrong = now != self._closed
        wrong[self._tiles] = now[self._tiles] != CONTACT_CODES["slipped"]
        for t in np.flatnonzero(wrong & ~(off & whole)).tolist():
            yield f"{self._names.tile(t)} has another contact than its slip leaves it"

    def _name(self, i: int) -> str:
        return self._names.tile(int(self._tiles[i]))
