from .block_sum import Sizes as Sizes
from .half_spaces import WRENCH_SCALE as WRENCH_SCALE
from .linear_programs import ends_along as ends_along, linear_program as linear_program
from .polytopes import (
    hull as hull,
    hull_facets as hull_facets,
    largest_ball as largest_ball,
    polytope as polytope,
)
from .space import Row as Row, WrenchSpace as WrenchSpace
