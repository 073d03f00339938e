"""Residuals of limits and laws, recomputed from a plan's numbers, and their tolerances.

Every kind of limit (`ResidualLimits`) recomputes its residuals from the numbers of a plan. It is
the only definition of the limit: `Check` compares the residuals of a plan with their tolerances,
and `LoadsCheck`, for streams, tabulates the residuals that are affine in the loads.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import FINGERS, NAIL
from planner.prepare import HandBatch
from planner.result import PlanArrays

__all__ = [
    "FINGER_COUNT",
    "TOLERANCES",
    "PartNames",
    "Recomputed",
    "RecomputedNails",
    "Residual",
    "ResidualLimits",
    "VerificationTolerances",
    "allowed_errors",
    "claim",
    "is_near",
]

FINGER_COUNT: Final = len(FINGERS)


@dataclass(frozen=True, slots=True)
class VerificationTolerances:
    """Largest errors of a plan's numbers against the recomputed numbers."""

    load: float = 1e-6  # of a tile, relative to the largest load of its hand
    utilisation: float = 1e-6
    near: float = 1e-9  # of any residual: the smallest error that is allowed of one
    contact: float = 1e-5
    """Of a contact's place on a floating or compliant hand, along its phalanx [m]: the rock's
    radius is only known to some 1e-5 of itself. Contacts that roll as a wrist moves by 4 mm and 40
    mrad are off by 2 micrometres, of hands that are displaced by 4 mm and 40 mrad by 5."""
    pull: float = 1e-5
    """Of a limb's pull against its hand's wrench in an executed plan: forces, and moments over
    0.1 m [N]. Equilibria are sought to 1e-6 N, and limbs of 1e9 N/m round to 1e-8 N."""
    dragged: float = 2e-3
    """Of the force by which a tile is dragged backwards in an executed plan [N]: up to 1e-3 N is
    reported as none."""


TOLERANCES: Final = VerificationTolerances()


class RecomputedNails(NamedTuple):
    """State of the k nails that hook, recomputed from a plan's forces.

    Attributes
    ----------
    residuals : list of Residual
        Residuals of balance, friction and strength of the nails.
    angles : ndarray, shape (k,)
        Angle by which each nail has turned, computed from the point at which it hooks [rad].
    used : ndarray, shape (k,)
        Utilisation of each nail: by the shear of its finger, and by the load of its fingertip.
    """

    residuals: list[Residual]
    angles: Array
    used: Array


class Recomputed(NamedTuple):
    """A plan's numbers, and the tile loads recomputed from its tensions or its wrists' poses.

    T tiles and F fingers are counted through all hands.

    Attributes
    ----------
    arrays : PlanArrays
        The plan's numbers.
    loads : ndarray, shape (T, 3)
        Shear, normal and lateral load of each tile [N]; shear and normal of nails zero.
    left : ndarray, shape (F, 3)
        Residual of each joint's balance, which a stop must carry, positive if closing [N·m].
    wound : ndarray, shape (F,)
        Tension of each tendon at which its winch stands [N].
    drawn : ndarray, shape (T,)
        Shear of each tile at these tensions, with the wrists at rest [N].
    nails : RecomputedNails
        State of the nails that hook.
    """

    arrays: PlanArrays
    loads: Array
    left: Array
    wound: Array
    drawn: Array
    nails: RecomputedNails


class Residual(NamedTuple):
    """Residuals of one kind of limit, for n tiles, fingers or hands.

    Attributes
    ----------
    kind : {"zero", "least", "use"}
        Meaning of the values: they must be zero, they must not be negative, or they are
        utilisations.
    values : ndarray, shape (n, …)
        Residuals of the n parts.
    hand : ndarray of int, shape (n,)
        Index of the hand to which each part belongs.
    name : callable, optional
        Returns the name of part i, with which the error message begins.
    text : str
        Rest of the error message, a format string.
    numbers : tuple of ndarray, shape (n,) or that of the values
        Numbers for the format string.
    error : float, optional
        Tolerance of each value; by default the tolerance for loads of the part's hand.
    scale : ndarray, optional
        Numbers to which ``error`` is relative where their size is above one.
    affine : bool
        True if the values are affine in the loads of the hands.
    """

    kind: Literal["zero", "least", "use"]
    values: Array
    hand: Indices
    name: Callable[[int], str] = str
    text: str = ""
    numbers: tuple[Array, ...] = ()
    error: float | None = None
    scale: Array | None = None
    affine: bool = True

    def off(self, allowed: Array) -> Iterator[str]:
        """Yield an error message for each value that exceeds its tolerance or is not finite.

        Parameters
        ----------
        allowed : ndarray, shape (H,)
            Tolerance for the loads of each hand [N].
        """
        if self.kind == "use":
            return
        room = -np.abs(self.values) if self.kind == "zero" else self.values
        error: Array | float | None = self.error
        if error is None:
            error = allowed.take(self.hand).reshape(-1, *[1] * (room.ndim - 1))
        elif self.scale is not None:
            error = error * np.maximum(np.abs(self.scale), 1.0)
        # numbers that are not finite are off, too
        wrong = ~(room + error >= 0.0) | np.isinf(room)
        for i in np.flatnonzero(wrong).tolist():
            row = i // (self.values.size // len(self.values))
            numbers = [each.flat[i if each.size == room.size else row] for each in self.numbers]
            yield self.name(row) + self.text.format(*numbers)


class ResidualLimits(ABC):
    """One kind of limits of the hands of a stance, which recomputes its residuals from a plan."""

    @abstractmethod
    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals that are affine in the loads, and the errors of reported numbers.

        Parameters
        ----------
        again : Recomputed
            The plan's numbers and the recomputed tile loads.
        """

    def recompute_curved(self, arrays: PlanArrays, loads: Array, wrenches: Array) -> list[Residual]:
        """Return the residuals that are not affine in the loads; none by default.

        Parameters
        ----------
        arrays : PlanArrays
            A plan's numbers, of which only those are used that do not change with loads.
        loads : ndarray, shape (T, 3)
            Shear, normal and lateral load of each tile [N].
        wrenches : ndarray, shape (H, 6)
            Wrench of each hand on the rock, in its H [N, N·m].
        """
        return []


def claim(
    own: Array,
    said: Array,
    hand: Indices,
    relative: float,
    name: Callable[[int], str],
    what: str = "",
) -> Residual:
    """Return the residuals of reported numbers against the recomputed ones.

    Parameters
    ----------
    own : ndarray, shape (n,)
        Recomputed numbers.
    said : ndarray, shape (n,)
        The plan's numbers.
    hand : ndarray of int, shape (n,)
        Index of the hand to which each number belongs.
    relative : float
        Tolerance, relative to the recomputed number where that is above one.
    name : callable
        Returns the name of the part to which number i belongs.
    what : str, optional
        Name of the quantity, for the error message.
    """
    text, off = what + " is {:.8g}, not {:.8g}", own - said
    return Residual("zero", off, hand, name, text, (own, said), relative, own, affine=False)


def is_near(residuals: Iterable[Residual]) -> bool:
    """Return whether all residuals are within the smallest tolerance, 1e-9, whatever the loads.

    If so, no residual can exceed its tolerance, and the tolerances need not be computed.
    """
    zero = np.concatenate([r.values for r in residuals if r.kind == "zero"], axis=None)
    least = np.concatenate([r.values for r in residuals if r.kind == "least"], axis=None)
    # both are false of numbers that are not finite; no number exceeds the norm of all
    return bool(
        zero.dot(zero) <= TOLERANCES.near**2 and np.minimum.reduce(least) >= -TOLERANCES.near
    )


def allowed_errors(known: HandBatch, arrays: PlanArrays) -> Array:
    """Return the tolerance for the loads of each hand, shape (H,) [N].

    The tolerance is 1e-6 of the largest load of the hand's tiles and palm, and at least 1e-6 N.
    """
    largest = np.fmax.reduceat(np.abs(arrays.loads).ravel(), 3 * known.places.first)
    largest = np.fmax(largest, np.abs(arrays.palms).max(axis=1))
    return np.asarray(TOLERANCES.load * np.fmax(largest, 1.0))


class PartNames(NamedTuple):
    """Names of hands' parts in messages, such as ``front_left: proximal tile of inner_right``.

    Attributes
    ----------
    limbs : tuple of str
        Limb of each hand.
    known : HandBatch
        The hands on their holds.
    """

    limbs: tuple[str, ...]
    known: HandBatch

    def limb(self, h: int) -> str:
        """Return the name of the limb of hand h, with a colon."""
        return f"{self.limbs[h]}: "

    def tile(self, t: int) -> str:
        """Return the name of a tile from its index t over all hands; after the tiles come palms."""
        places = self.known.places
        if t >= len(places.hand):
            return f"{self.limbs[t - len(places.hand)]}: palm"
        h = int(places.hand[t])
        tile = self.known.hands[h].tiles[t - int(places.first[h])]
        what = NAIL if tile.phalanx == NAIL else f"{tile.phalanx} tile"
        return f"{self.limbs[h]}: {what} of {tile.finger}"

    def limb_of(self, hands: Indices) -> Callable[[int], str]:
        """Return a function of i that names the limb of the hand with index ``hands[i]``."""
        return lambda i: self.limb(int(hands[i]))

    def finger(self, what: str, finger: int) -> str:
        """Return the name of a finger's part: ``front_left: tendon of inner_right``.

        Parameters
        ----------
        what : str
            Name of the part.
        finger : int
            Index of the finger, counted through all hands.
        """
        h, i = divmod(finger, FINGER_COUNT)
        return f"{self.limbs[h]}: {what} of {FINGERS[i]}"

    def of_fingers(self, what: str, fingers: Indices) -> Callable[[int], str]:
        """Return a function of i that names the part ``what`` of the finger ``fingers[i]``."""
        return lambda i: self.finger(what, int(fingers[i]))
