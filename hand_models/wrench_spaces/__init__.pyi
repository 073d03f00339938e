from .block_sum import Sizes as Sizes
from .half_spaces import SCALE as SCALE
from .linear_programs import linear_program as linear_program
from .polytopes import TOLERANCE as TOLERANCE, hull as hull, hull_facets as hull_facets
from .space import Row as Row, WrenchSpace as WrenchSpace
