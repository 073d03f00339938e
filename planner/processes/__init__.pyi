from .stations import (
    Lane as Lane,
    Make as Make,
    Station as Station,
    resident as resident,
    starting_children as starting_children,
)
from .workers import Lost as Lost, Workers as Workers, cores as cores
