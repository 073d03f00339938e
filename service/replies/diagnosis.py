"""Define the reply of a diagnosis: which tile has probably slipped."""

from __future__ import annotations

from msgspec import Struct

from planner import LostTile
from service.replies.reply import StanceReply

__all__ = ["DiagnosisReply", "SuspectReply"]


class SuspectReply(Struct, kw_only=True):
    """A tile that may have slipped.

    - ``limb``, ``finger``, ``phalanx``: its name.
    - ``probability``: that it is this tile, if one tile has slipped.
    - ``expected``: change that its slip makes: of the tension [N], or turn of the winch [rad].
    """

    limb: str
    finger: str
    phalanx: str
    probability: float
    expected: float


class DiagnosisReply(StanceReply, kw_only=True):
    """Diagnosis of a slip: the tiles that have probably slipped, by the data of motors.

    - ``seen``: whether a slip explains the data better than none.
    - ``tiles``: all tiles of the hands with data, the most probable first.
    - ``suspects``: the first of them, which have 95 % of the probability together: as ``lost`` of
      set-points.
    - ``ambiguous``: pairs of tiles of one finger whose slips look alike.
    - ``reason``: why no slip is seen, or what the slip of one tile does not explain; else null.
    """

    seen: bool
    tiles: list[SuspectReply]
    suspects: list[LostTile]
    ambiguous: list[list[LostTile]]
    reason: str | None = None
