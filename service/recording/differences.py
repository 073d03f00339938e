"""Compare two answers to the digit, but for what no two answers have in common."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

__all__ = ["Difference", "differences", "same_within_gaps"]

MISSING_VALUE: Final = "(none)"

OWN_FIELDS: Final = {"id", "stream", "number", "took", "age", "skipped", "seconds"}
"""Fields that differ from answer to answer: names, and times on a clock."""


class Difference(NamedTuple):
    """Difference between two answers in one field.

    Attributes
    ----------
    path : str
        Path of the field, such as ``hands[0].wrench[2]``.
    old, new : object
        Both values.
    """

    path: str
    old: Any
    new: Any

    @property
    def field(self) -> str:
        """Path without places in lists."""
        return re.sub(r"\[\d+\]", "[]", self.path)

    @property
    def size(self) -> float:
        """Difference of two numbers over the larger one; infinite for what is no number."""
        if not (_is_number(self.old) and _is_number(self.new)):
            return math.inf
        return float(abs(self.new - self.old) / max(abs(self.new), abs(self.old)))


def differences(old: Any, new: Any, path: str = "") -> Iterator[Difference]:
    """Yield all that differs between two decoded answers, but identifiers and times on a clock.

    Parameters
    ----------
    old, new : object
        Decoded answers, or parts of them.
    path : str, optional
        Where the parts are.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old.keys() | new.keys():
            pair = old.get(name, MISSING_VALUE), new.get(name, MISSING_VALUE)
            # a knot of a climb has a time, too, which is its own
            if name in OWN_FIELDS or (name == "time" and all(isinstance(e, dict) for e in pair)):
                continue
            yield from differences(*pair, f"{path}.{name}" if path else name)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, f"{path}[{i}]")
    elif isinstance(old, list) and isinstance(new, list):
        yield Difference(path, f"{len(old)} entries", f"{len(new)} entries")
    elif old != new or isinstance(old, bool) != isinstance(new, bool):
        yield Difference(path, old, new)


def same_within_gaps(old: Any, new: Any) -> bool:
    """Return whether two set-points for a wrench are as good as each other, as far as is proven.

    Which plans are interpolated depends on when a thread had solved them. So set-points for a
    wrench that has moved may differ; both are verified, and how far each is from the least
    utilisation is known (``gap``).

    Parameters
    ----------
    old, new : object
        Decoded set-points; anything else is not.
    """
    old, new = (
        each.get("set_points", each) if isinstance(each, dict) else {} for each in (old, new)
    )
    if not old or not new or "source" not in old or "source" not in new:
        return False
    names = ("status", "verified", "body_wrench", "lost", "findings")
    if any(old.get(name) != new.get(name) for name in names) or not old["verified"]:
        return False
    if None in (old["gap"], new["gap"], old["utilisation"], new["utilisation"]):
        return False
    rounding = 1e-9  # of a utilisation
    apart = abs(old["utilisation"] - new["utilisation"])
    return bool(apart <= max(old["gap"], new["gap"]) + rounding)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
