from .prepare import hand_space as hand_space
from .question import (
    HandOnHold as HandOnHold,
    Limits as Limits,
    Load as Load,
    Question as Question,
    Stance as Stance,
)
from .result import Plan as Plan
from .solving import KnownStance as KnownStance, plan as plan
from .streaming import WrenchStream as WrenchStream
