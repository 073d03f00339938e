from .stations import (
    OUT_OF_MEMORY as OUT_OF_MEMORY,
    Lane as Lane,
    Make as Make,
    Station as Station,
    resident as resident,
)
from .workers import Lost as Lost, Workers as Workers, cores as cores
