from .dual_bounds import least_bound as least_bound
from .known_stance import KnownStance as KnownStance
from .solve import plan as plan
from .unique_plan import is_least as is_least, least_utilisation as least_utilisation
