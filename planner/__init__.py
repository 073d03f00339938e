"""Many hands, one body: who carries what.

stance + question → WrenchSpace of every hand → conic program → solution → verified Plan.
"""

from planner.plan import Plan
from planner.solve import hand_space, plan
from planner.stance import HandOnHold, Limits, Load, Question, Stance

__all__ = ["HandOnHold", "Limits", "Load", "Plan", "Question", "Stance", "hand_space", "plan"]
