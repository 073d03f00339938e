from .block_sum import Sizes as Sizes
from .half_spaces import SCALE as SCALE
from .polytopes import TOLERANCE as TOLERANCE, hull as hull, hull_facets as hull_facets
from .space import Row as Row, WrenchSpace as WrenchSpace
