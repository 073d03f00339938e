"""The dual active-set method: from wrong guesses to the optimum that CVXPY has."""

import numpy as np
import pytest

from planner.programs import Rows, dual_optimum, solvers, tie_weight
from planner.programs.program import Best
from planner.solving.unique_plan import active_set_optimum
from tests.suite.helpers.stances import ask, on_wall, program_data


@pytest.fixture(scope="module")
def stance():
    """Rows of a stance of four hands, the optimum that its solver leads to, and CVXPY's."""
    data = program_data(ask(on_wall()))
    exact = active_set_optimum(data, solvers.unique(data))
    weights = tie_weight(len(data.hands)) * data.rows.tie
    _, further = Best(data, weights=weights).by_definition()
    return Rows.of(data), 2.0 * weights, exact.found, float(further[0])


def test_a_guess_that_is_wrong_in_some_rows_leads_to_the_optimum(stance):
    rows, Q, (point, face), least = stance
    chance, others = np.random.default_rng(0), np.flatnonzero(~face.active)
    own = np.flatnonzero(face.active)[rows.equations :]
    found = 0
    for wrong in (0, 1, 1, 2, 2, 3, 3, 4):
        guess, multipliers = face.active.copy(), point.multipliers.copy()
        guess[chance.choice(own, wrong, replace=False)] = False
        guess[chance.choice(others, wrong, replace=False)] = True
        multipliers[guess & ~face.active] = chance.uniform(0.0, 0.01, wrong)
        again = dual_optimum(rows, Q, point._replace(multipliers=multipliers), guess)
        if again is None:
            continue
        found += 1
        z, u, multipliers = again.point
        assert u == pytest.approx(point.u, abs=1e-9)
        assert z == pytest.approx(point.z, abs=1e-7)
        assert u == pytest.approx(least, abs=1e-5)
        # Karush, Kuhn and Tucker's conditions, from the rows themselves
        room = rows.room(z, u)
        assert room.min() >= -1e-9
        assert np.abs(room[again.face.active]).max() <= 1e-9
        assert multipliers[rows.equations :].min() >= -1e-14
        assert not multipliers[~again.face.active].any()
        assert np.abs(Q * z + multipliers @ rows.C).max() <= 1e-13
        assert multipliers @ rows.d == pytest.approx(1.0, abs=1e-9)
    assert found >= 7


def test_the_optimum_itself_needs_no_change(stance):
    rows, Q, (point, face), *_ = stance
    again = dual_optimum(rows, Q, point, face.active)
    assert np.array_equal(again.face.active, face.active)


def test_faces_of_both_methods_keep_an_optimum_up_to_the_same_weight(stance):
    rows, Q, (point, face), *_ = stance
    again = dual_optimum(rows, Q, point, face.active)
    weights = np.geomspace(0.1, 1e9, 60)
    kept = [face.keeps(point, weight) for weight in weights]
    assert kept == [again.face.keeps(again.point, weight) for weight in weights]
    assert {True, False} <= {*kept}


def test_there_is_no_start_without_a_limit(stance):
    rows, Q, (point, _), *_ = stance
    equations = np.arange(len(rows.b)) < rows.equations
    assert dual_optimum(rows, Q, point, equations) is None


def test_a_row_of_nothing_that_only_more_utilisation_meets_is_met(stance):
    rows, Q, (point, face), *_ = stance
    least = point.u + 0.1
    C, d, b = (
        np.append(part, [more], axis=0)
        for part, more in zip(rows[:3], (np.zeros(len(Q)), 1.0, -least), strict=True)
    )
    multipliers = np.append(point.multipliers, 0.0)
    start, guess = point._replace(multipliers=multipliers), np.append(face.active, False)
    found = dual_optimum(Rows(C, d, b, rows.equations), Q, start, guess)
    assert found is None or found.point.u == pytest.approx(least, abs=1e-9)
