"""A tile that has slipped, by name."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from hand_models.base import Name, Strict

__all__ = ["LostTile"]


class LostTile(Strict, frozen=True, kw_only=False):
    """A finger tile whose spines have let go of the rock.

    - ``limb``: limb of its hand.
    - ``finger``: finger of its hand.
    - ``phalanx``: ``base``, ``proximal``, ``middle`` or ``distal``.
    """

    limb: Name
    finger: Annotated[Name, Meta(description="as outer_left")]
    phalanx: Annotated[Name, Meta(description="base, proximal, middle or distal")]
