from .block_sum import Sizes as Sizes
from .polytopes import TOLERANCE as TOLERANCE, hull as hull, hull_facets as hull_facets
from .row import Row as Row
from .scaled_wrench import SCALE as SCALE
from .space import WrenchSpace as WrenchSpace
