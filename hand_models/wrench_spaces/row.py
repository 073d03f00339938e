"""The name of an inequality of a wrench space."""

from __future__ import annotations

from typing import Literal, NamedTuple

__all__ = ["Row"]


class Row(NamedTuple):
    """The name of an inequality.

    Attributes
    ----------
    finger, phalanx : str or None
        Whose it is; None where it is the palm's, or a whole finger's.
    limit : str
        What it limits.
    kind : {'limit', 'hard'}
    label : str
        Unique in its set.
    joint : str or None
        Of the limb that carries the hand, where the limit is that joint's.
    """

    finger: str | None
    phalanx: str | None
    limit: str
    kind: Literal["limit", "hard"]
    label: str
    joint: str | None = None
