"""Many hands, one body: who carries what.

stance + question → WrenchSpace of every hand → conic program → solution → verified Plan.
"""

from planner.known_stance import KnownStance
from planner.plan import Plan
from planner.question import Limits, Load, Question
from planner.settling import hand_space
from planner.solve import plan
from planner.stance import HandOnHold, Stance
from planner.stream import WrenchStream

__all__ = [
    "HandOnHold",
    "KnownStance",
    "Limits",
    "Load",
    "Plan",
    "Question",
    "Stance",
    "WrenchStream",
    "hand_space",
    "plan",
]
