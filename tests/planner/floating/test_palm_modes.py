"""Load factors of floating hands, and whether a limit or a failed search ends them."""

import msgspec
import pytest

from planner.question import Load
from planner.solving import plan
from service.answering.questions import question
from service.commands.stances import read_request


def factor_of(request):
    return plan(question(msgspec.structs.replace(request, want=["load_factor"])))


@pytest.mark.slow
def test_a_load_factor_that_a_limit_ends_has_no_warning():
    request = read_request("wall-300-floating")
    light = Load(mass=95.0)
    request = msgspec.structs.replace(request, load=light)
    answer = factor_of(request)
    assert answer.load_factor > 1.0
    assert not any("lower bound" in words for words in answer.warnings)
    # and at that factor the utilisation is one
    at = [answer.load_factor * value for value in answer.body_wrench]
    there = plan(question(msgspec.structs.replace(request, load=None, body_wrench=at, want=[])))
    assert there.utilisation == pytest.approx(1.0, abs=1e-3)
