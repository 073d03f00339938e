from .check import Check as Check
from .executed import execution_problems as execution_problems
from .loads_check import LoadsCheck as LoadsCheck
