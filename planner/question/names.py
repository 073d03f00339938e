"""Names in a question: what its plan is the best in, and what is wanted beside that.

They travel, so that they are here without numbers of numpy's.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

__all__ = ["OBJECTIVES", "WANTS", "Objective", "Want"]

Objective = Literal["max_margin", "min_effort"]

OBJECTIVES: Final = get_args(Objective)
"""What a plan may be the best in."""

Want = Literal["load_factor", "prices", "model", "robust", "spread", "clearance", "advice"]

WANTS: Final = get_args(Want)
"""What may be wanted beside a plan."""
