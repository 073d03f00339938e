from .advice import plan as plan
from .prepare import hand_space as hand_space
from .question import (
    HandOnHold as HandOnHold,
    Limits as Limits,
    Load as Load,
    Question as Question,
    Stance as Stance,
)
from .result import Plan as Plan
from .solving import KnownStance as KnownStance
from .streaming import WrenchStream as WrenchStream
