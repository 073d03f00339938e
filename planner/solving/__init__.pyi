from .dual_bounds import least_bound as least_bound
from .prepared_checks import scene_findings as scene_findings
from .solve import KnownStance as KnownStance, plan as plan
from .trial import Trial as Trial, try_stance as try_stance
from .unique_plan import is_least as is_least, least_utilisation as least_utilisation
