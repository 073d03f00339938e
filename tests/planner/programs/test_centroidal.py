"""The equilibrium margin of hpp-centroidal-dynamics, from plain friction contacts as our sets.

Its margin is the largest b0 with which every generator of every friction pyramid carries at least
b0, in newtons by a factor of the pyramid. With the loads of a hand the pyramid's generators, and
minus each load a limit row of 1 N, our least utilisation is −b0.
"""

import sys

import numpy as np
import pytest

from tests.suite.helpers import centroidal_peer
from tests.suite.helpers.friction_contacts import EDGES, our_margin, random_case

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="its wheels are for Linux")


def test_margin_is_that_of_hpp_centroidal_dynamics():
    rng = np.random.default_rng(7)
    cases = [random_case(rng) for _ in range(60)]
    theirs = centroidal_peer.margins(cases, EDGES)
    ours = [our_margin(case) for case in cases]
    assert sum(margin is not None and margin > 0.0 for margin in theirs) > 20
    assert sum(margin is not None and margin < 0.0 for margin in theirs) > 5
    for mine, other in zip(ours, theirs, strict=True):
        assert mine == (None if other is None else pytest.approx(other, rel=1e-6, abs=1e-6))
