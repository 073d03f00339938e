from .question import (
    ForceCap as ForceCap,
    Limits as Limits,
    Load as Load,
    Objective as Objective,
    Question as Question,
)
from .stance import (
    EARTH as EARTH,
    SOLVE as SOLVE,
    HandOnHold as HandOnHold,
    Stance as Stance,
    checked_body_wrench as checked_body_wrench,
)
