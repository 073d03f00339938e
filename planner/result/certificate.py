"""Certificate that there is no plan: one struct over the kind of its vectors and of hands' sets.

In the planner these are arrays and wrench spaces, in a reply lists and what travels of a set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, TypeVar

from msgspec import UNSET, Struct, UnsetType

from planner.result.plain_parts import AnyVector, LimitName

__all__ = ["CertificateOf"]

SetOfWrenches = TypeVar("SetOfWrenches")


class CertificateOf(Struct, Generic[AnyVector, SetOfWrenches], frozen=True, kw_only=True, eq=False):
    """Why no plan balances the body, or none within a cap on the utilisation.

    Checked without the solver: for every body wrench w that the hands can give, and the wrenches v
    of theirs on the rock with which they do,

        d · w + Σ c · v ≤ supremum < needed = d · W + Σ c · V

    for the body wrench W asked for and the components V of hands' wrenches that are given. Where d
    and all c are zero, rows contradict each other whatever the hands are to give.

    Attributes
    ----------
    utilisation : float or None
        The cap within which there is no plan; None: there is none at any utilisation.
    direction : vector, length 6
        d in B [1/N, 1/(N·m)], of unit length in the program's units of 300 N and 30 N·m; zero where
        what the body needs plays no part.
    held : mapping of str to vector, length 6
        c in H [1/N, 1/(N·m)] of each hand that is given a wrench, by limb; zero for components that
        are free.
    supremum : float
        Over all loads up to 10⁶ N that keep to hard rows and, within a cap, to limits.
    needed : float
        Larger than ``supremum``.
    shortfall : vector, length 6, or None
        What is missing in B: the body wrench asked for minus the nearest that can be had. None
        where nothing can: the hands' own rows, or the wrenches they are given, leave no loads. None
        also where a deadline came before it was found; the direction is not zero then.
    nearest : vector, length 6, or None
        That nearest body wrench.
    blocking : sequence of LimitName
        Rows that keep the hands from giving more in that direction; empty where no hand has
        anything at all to give. The caller's own limits come first, then other limits, then hard
        rows; of each of these the weightiest.
    irreducible : sequence of LimitName or None
        Limits and hard rows (all rows of a name together) and given wrenches of hands
        (``held_wrench``) that by themselves leave no balance, each of them needed for that. Others
        may be in the way, too. In the order of ``blocking``. Empty where loads of any sign, up to
        10⁶ N, would not balance it. None where rounding or a deadline leaves the set undecided.
    irreducible_up_to : float or None
        Loads up to which they are proven to leave no balance [N], at least 10⁶: far beyond any
        strength, but rows that are all but parallel may meet beyond. None where no loads of any
        size balance, or there is no set.
    sufficient : sequence of LimitName or None
        Those of them without any one of which, all other rows in place, there is a plan: within
        the cap, or at any utilisation. Empty if no single one does. None where that is undecided,
        or the set has more than 24 members and others alone are not in the way.
    wrench_spaces : mapping of str to set, or UNSET
        The hands' sets that are meant, by limb; none where no hand has a part in it. In a reply
        they come with ``"want": ["model"]`` where there is no plan.
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
