"""Residuals of limits and laws in a plan's numbers, and whether they are more than rounding.

Every kind of limit (`ResidualLimits`) recomputes its residuals from the numbers of a plan, and
nothing else says what the limit is: the check of a plan judges these, and the check of a stream
tabulates those that are affine in the loads.
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
    """Largest errors of a plan's numbers against what is recomputed of them."""

    load: float = 1e-6  # of a tile, relative to the largest load of its hand
    utilisation: float = 1e-6
    near: float = 1e-9  # of any residual: the smallest error that is allowed of one


TOLERANCES: Final = VerificationTolerances()


class RecomputedNails(NamedTuple):
    """Recomputed state of the k nails that hook, under a plan's forces.

    Attributes
    ----------
    residuals : list of Residual
    angles : ndarray, shape (k,)
        How far each has turned, by where it hooks [rad].
    used : ndarray, shape (k,)
        Utilisation of each, by shear of its finger and by what its tip bears.
    """

    residuals: list[Residual]
    angles: Array
    used: Array


class Recomputed(NamedTuple):
    """A plan's numbers, and what its tensions, or where its wrists go, do to the fingers.

    Attributes
    ----------
    arrays : PlanArrays
        The plan's numbers.
    loads : ndarray, shape (T, 3)
        Of each tile [N]; shear and normal of nails zero.
    left : ndarray, shape (F, 3)
        What is left of each joint's balance, for its stop [N·m].
    wound : ndarray, shape (F,)
        Tensions to which the winches have drawn the tendons [N].
    drawn : ndarray, shape (T,)
        Shears of the tiles when they had [N].
    nails : RecomputedNails
    """

    arrays: PlanArrays
    loads: Array
    left: Array
    wound: Array
    drawn: Array
    nails: RecomputedNails


class Residual(NamedTuple):
    """Numbers that a plan leaves of one kind of limit.

    Attributes
    ----------
    kind : {"zero", "least", "use"}
        What must be zero; what may not be below zero; utilisations.
    values : ndarray, shape (n, …)
    hand : ndarray of int, shape (n,)
        Whose they are.
    name : callable, optional
        Name of what each of the n belongs to.
    text : str
        What is said of one that is off, right after that name.
    numbers : tuple of ndarray, shapes (n,) or that of the values
        What the text is formatted with.
    error : float, optional
        How far each may be off; as far as the loads of its hand by default.
    scale : ndarray, optional
        Numbers that the error is relative to where they are larger than one, in size.
    affine : bool
        Whether the values are affine in the loads of the hands.
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
        """Yield what is off by more than it may be: by ``allowed`` (H,) [N] in hands' loads."""
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
    """One kind of limits of the hands of a stance."""

    @abstractmethod
    def recompute(self, again: Recomputed) -> list[Residual]:
        """Return the residuals that are affine in the hands' loads, and what a plan claims."""

    def recompute_curved(self, arrays: PlanArrays, loads: Array, wrenches: Array) -> list[Residual]:
        """Return the residuals that are not affine in the loads; none by default.

        Parameters
        ----------
        arrays : PlanArrays
            Of its numbers, those that no load changes.
        loads : ndarray, shape (T, 3)
            Of the tiles [N].
        wrenches : ndarray, shape (H, 6)
            Of the hands on the rock [N, N·m].
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
    """Return by how much numbers of a plan are not what was recomputed of them."""
    text, off = what + " is {:.8g}, not {:.8g}", own - said
    return Residual("zero", off, hand, name, text, (own, said), relative, own, affine=False)


def is_near(residuals: Iterable[Residual]) -> bool:
    """Say whether no residual can be off by what it may be, whatever the size of the loads."""
    zero = np.concatenate([r.values for r in residuals if r.kind == "zero"], axis=None)
    least = np.concatenate([r.values for r in residuals if r.kind == "least"], axis=None)
    # both are false of numbers that are not finite; no number exceeds the norm of all
    return bool(
        zero.dot(zero) <= TOLERANCES.near**2 and np.minimum.reduce(least) >= -TOLERANCES.near
    )


def allowed_errors(known: HandBatch, arrays: PlanArrays) -> Array:
    """Return the error that loads of each hand may have, shape (H,), at least 1e-6 N."""
    largest = np.fmax.reduceat(np.abs(arrays.loads).ravel(), 3 * known.places.first)
    largest = np.fmax(largest, np.abs(arrays.palms).max(axis=1))
    return np.asarray(TOLERANCES.load * np.fmax(largest, 1.0))


class PartNames(NamedTuple):
    """Names of what hands have: ``front_left: proximal tile of inner_right``."""

    limbs: tuple[str, ...]
    known: HandBatch

    def limb(self, h: int) -> str:
        return f"{self.limbs[h]}: "

    def tile(self, t: int) -> str:
        """Return the name of a tile, or after them all of a palm."""
        places = self.known.places
        if t >= len(places.hand):
            return f"{self.limbs[t - len(places.hand)]}: palm"
        h = int(places.hand[t])
        tile = self.known.hands[h].tiles[t - int(places.first[h])]
        what = NAIL if tile.phalanx == NAIL else f"{tile.phalanx} tile"
        return f"{self.limbs[h]}: {what} of {tile.finger}"

    def limb_of(self, hands: Indices) -> Callable[[int], str]:
        """Return the function that names the limb of each hand."""
        return lambda i: self.limb(int(hands[i]))

    def finger(self, what: str, finger: int) -> str:
        """Return the name of something of a finger: ``front_left: tendon of inner_right``."""
        h, i = divmod(finger, FINGER_COUNT)
        return f"{self.limbs[h]}: {what} of {FINGERS[i]}"

    def of_fingers(self, what: str, fingers: Indices) -> Callable[[int], str]:
        """Return the function that names something of each finger."""
        return lambda i: self.finger(what, int(fingers[i]))
