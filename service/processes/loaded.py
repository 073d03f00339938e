"""Load what most questions need, so that none waits for it: once for all processes that are forked.

CVXPY and SciPy's statistics take as long to load as all else, and few questions need them.
"""

import scipy.optimize
import scipy.spatial  # noqa: F401
import trimesh  # noqa: F401

from hand_models.hand import load_closing
from planner import load_dual_method
from service.answering import Streams, handle, robots_of  # noqa: F401

load_closing()
load_dual_method()
robots_of(None)
