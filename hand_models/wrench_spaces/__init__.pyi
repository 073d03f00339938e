from .block_sum import Sizes as Sizes
from .linear_programs import linear_program as linear_program
from .polytopes import TOLERANCE as TOLERANCE, hull as hull, hull_facets as hull_facets
from .row import Row as Row
from .scaled_wrench import SCALE as SCALE
from .space import WrenchSpace as WrenchSpace
