"""``crux check``: its exit statuses, its table and its JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest

from service.commands.cli import run_command_line
from tests.planner.certification.test_bound_check import open_climb
from tests.suite.helpers.certificates import proof_of, with_route

DONE, BAD_INPUT, OVERLOADED = 0, 2, 3


def certificate(share):
    """A certificate of so many times the least load factor of the best route."""
    climb, answers, best, route = open_climb()
    return with_route(proof_of(climb, share * best, answers), route, answers), best


@pytest.mark.parametrize(("share", "status"), [(1.01, DONE), (0.99, OVERLOADED)])
def test_says_whether_the_bound_is_proven(share, status, tmp_path, capsys):
    claimed, best = certificate(share)
    claimed.write(tmp_path / "climb.npz")
    arguments = ["check", str(tmp_path / "climb.npz")]
    assert run_command_line(arguments) == status
    printed = " ".join(capsys.readouterr().out.split())
    assert f"no climb has a least load factor of {claimed.multiple:.6g} or more" in printed
    assert f"7 states, least load factor {best:.6g} as stated" in printed
    assert ("not proven the goal is connected: body 2 at" in printed) == (status == OVERLOADED)
    assert ("is at most 1.00% larger" in printed) == (status == DONE)
    assert run_command_line([*arguments, "-q"]) == status
    verdict = {DONE: "or more: proven", OVERLOADED: "or more: not proven"}[status]
    bound, route = capsys.readouterr().out.splitlines()
    assert bound.endswith(verdict)
    assert route == f"route of 7 states, least load factor {best:.6g}: as stated"
    assert run_command_line([*arguments, "--json"]) == status
    found = json.loads(capsys.readouterr().out)
    assert found["proven"] == (status == DONE)
    assert (found["open_end"] is None) == (status == DONE)
    assert found["digest"] == claimed.digest
    assert found["route"]["least"] == pytest.approx(best)


def test_says_what_is_wrong_with_the_route(tmp_path, capsys):
    claimed, _ = certificate(1.01)
    wrong = replace(claimed, route_factors=1.1 * claimed.route_factors)
    wrong.write(tmp_path / "climb.npz")
    assert run_command_line(["check", str(tmp_path / "climb.npz")]) == OVERLOADED
    assert "state 0 has a load factor of" in " ".join(capsys.readouterr().out.split())


def test_a_certificate_without_a_route(tmp_path, capsys):
    claimed, _ = certificate(1.01)
    none = {
        name: getattr(claimed, name)[:0]
        for name in ("route_bodies", "route_members", "route_factors")
    }
    replace(claimed, **none, backward=True).write(tmp_path / "climb.npz")
    assert run_command_line(["check", str(tmp_path / "climb.npz"), "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["route"] is None


def test_that_there_is_no_climb_is_said_so(tmp_path, capsys):
    claimed, _ = certificate(1.01)
    nowhere = replace(claimed, multiple=0.0, shifts=claimed.shifts[:0])
    nowhere.write(tmp_path / "climb.npz")
    assert run_command_line(["check", str(tmp_path / "climb.npz")]) == OVERLOADED
    printed = " ".join(capsys.readouterr().out.split())
    assert "there is no climb, whatever its load factor" in printed
    assert "ruled out proven route" in printed
    assert "state 1 is not one move from the state before" in printed


def test_a_file_that_is_none_is_bad_input(tmp_path, capsys):
    path = tmp_path / "climb.npz"
    np.savez(path, points=np.zeros(3))
    for file in (path, tmp_path / "missing.npz", tmp_path):
        assert run_command_line(["check", str(file)]) == BAD_INPUT
        (line,) = capsys.readouterr().err.splitlines()
        assert str(file) in line or "climb certificate" in line
