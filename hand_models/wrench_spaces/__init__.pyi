from .polytopes import TOLERANCE as TOLERANCE, hull as hull, hull_facets as hull_facets
from .space import SCALE as SCALE, Row as Row, WrenchSpace as WrenchSpace
