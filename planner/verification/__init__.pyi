from .check import Check as Check, problems as problems
from .loads_check import LoadsCheck as LoadsCheck
