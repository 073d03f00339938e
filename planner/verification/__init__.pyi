from .check import Check as Check
from .check import problems as problems
from .loads_check import LoadsCheck as LoadsCheck
