from .check import Check as Check
from .loads_check import LoadsCheck as LoadsCheck
