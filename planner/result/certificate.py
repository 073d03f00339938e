"""Infeasibility certificate of a question, generic in the types of its vectors and wrench spaces.

In the planner these are arrays and `WrenchSpace`; in a reply, lists and serialised spaces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, TypeVar

from msgspec import UNSET, Struct, UnsetType

from planner.result.plain_parts import AnyVector, LimitName

__all__ = ["CertificateOf"]

SetOfWrenches = TypeVar("SetOfWrenches")


class CertificateOf(Struct, Generic[AnyVector, SetOfWrenches], frozen=True, kw_only=True, eq=False):
    """Infeasibility certificate: why no plan balances the body, or none within a utilisation cap.

    A Farkas certificate, checked without the solver. For every body wrench w that the hands can
    give, by wrenches v of the hands on the rock,

        d · w + Σ c · v ≤ supremum < needed = d · W + Σ c · V.

    W is the body wrench asked for, V the prescribed components of hands' wrenches, d and c are the
    ``direction`` and ``held``. If d and all c are zero, rows contradict each other whatever the
    hands must give.

    Attributes
    ----------
    utilisation : float or None
        Cap within which there is no plan; None: there is none at any utilisation.
    direction : vector, length 6
        d in the body frame B [1/N, 1/(N·m)], of unit length in the program's units of 300 N and
        30 N·m; zero if the body wrench plays no part.
    held : mapping of str to vector, length 6
        c in the hand frame H [1/N, 1/(N·m)] of each hand with a prescribed wrench, by limb; zero
        for free components.
    supremum : float
        Largest value over all loads within hard rows and, within a cap, limits. Loads are at most
        10⁶ N, or a hundred times the force that the body needs if that is more.
    needed : float
        Value that the question needs; larger than ``supremum``.
    shortfall : vector, length 6, or None
        Missing wrench, in B: the body wrench asked for minus the nearest feasible one. None if no
        body wrench is feasible: hard rows, or prescribed hand wrenches, leave no loads. None also
        if a deadline expired first; the direction is then not zero.
    nearest : vector, length 6, or None
        Nearest feasible body wrench, in B.
    blocking : sequence of LimitName
        Active rows, which keep the hands from giving more in the direction; empty if no hand can
        give anything at all. First the caller's limits, then other limits, then hard rows; in each
        group the one with the largest weight first.
    irreducible : sequence of LimitName or None
        Irreducible infeasible subset: limits, hard rows (all rows of a name together) and
        prescribed hand wrenches (``held_wrench``) that alone leave no balance, each of them needed
        for that. Other rows may be in the way, too. In the order of ``blocking``. Empty if even
        such loads of any sign do not balance the body. None if rounding or a deadline left the
        subset undecided.
    irreducible_up_to : float or None
        Largest loads for which the subset is proven to leave no balance [N]; at least those of
        ``supremum``, far beyond any strength, but nearly parallel rows may meet beyond. 10⁹ if it
        is proven up to there or farther. None if no loads of any size balance the body, or there
        is no subset.
    sufficient : sequence of LimitName or None
        Members of the subset whose removal alone makes the question feasible: within the cap, or at
        any utilisation. Empty if no single removal does. None if undecided, or if the subset has
        more than 24 members and other rows alone are not in the way.
    wrench_spaces : mapping of str to set, or UNSET
        Wrench spaces to which the certificate refers, by limb; none if no hand has a part in it. In
        a reply they come with ``"want": ["model"]`` if there is no plan.
    """

    utilisation: float | None = None
    direction: AnyVector
    held: Mapping[str, AnyVector] = {}
    supremum: float
    needed: float
    shortfall: AnyVector | None
    nearest: AnyVector | None
    blocking: Sequence[LimitName]
    irreducible: Sequence[LimitName] | None = None
    irreducible_up_to: float | None = None
    sufficient: Sequence[LimitName] | None = None
    wrench_spaces: Mapping[str, SetOfWrenches] | UnsetType = UNSET
