from .polytopes import TOLERANCE as TOLERANCE
from .polytopes import hull as hull
from .polytopes import hull_facets as hull_facets
from .space import SCALE as SCALE
from .space import Row as Row
from .space import WrenchSpace as WrenchSpace
