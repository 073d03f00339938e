"""The check of a certificate's route: its load factors and its moves."""

from dataclasses import replace

import numpy as np
import pytest

from planner.certification import check_route
from tests.planner.certification.test_bound_check import open_climb
from tests.suite.helpers.certificates import with_route


def routed():
    climb, answers, best, route = open_climb()
    return with_route(climb, route, answers), best


def changed(certificate, name, at, value):
    array = getattr(certificate, name).copy()
    array[at] = value
    return replace(certificate, **{name: array})


def test_a_route_has_the_load_factors_of_another_program():
    certificate, best = routed()
    found = check_route(certificate)
    assert found.fault is None
    np.testing.assert_allclose(found.factors, certificate.route_factors, rtol=1e-7)
    assert found.least == pytest.approx(best, rel=1e-7)


def test_no_route_is_no_fault():
    certificate, _ = routed()
    empty = {
        name: getattr(certificate, name)[:0]
        for name in ("route_bodies", "route_members", "route_factors")
    }
    found = check_route(replace(certificate, **empty))
    assert found.fault is None
    assert found.least == -np.inf


def test_what_is_wrong_with_a_route_is_found():
    certificate, _ = routed()
    members = certificate.route_members
    lift = int(np.flatnonzero((members < 0).any(axis=1))[0])
    on = int(np.flatnonzero(members[lift] >= 0)[0])
    p, body = members[lift, on], certificate.route_bodies[lift]
    two = certificate.route_members[lift][certificate.route_members[lift] >= 0][:2]
    last = len(members) - 1
    faults = {
        "not at the start": changed(certificate, "start_bodies", slice(None), False),
        "not at the goal": changed(certificate, "goal_members", 0, (members[last, 0] + 1) % 5),
        "does not reach": changed(certificate, "reached", (p, body, on), False),
        "too near": changed(certificate, "apart", (two, two[::-1]), False),
        f"state {lift} has a load factor of": changed(
            certificate, "route_factors", lift, 1.001 * certificate.route_factors[lift]
        ),
        "more than one limb": changed(certificate, "route_members", (lift, on), -1),
        "not one move": replace(
            certificate,
            route_bodies=np.delete(certificate.route_bodies, lift),
            route_members=np.delete(members, lift, axis=0),
            route_factors=np.delete(certificate.route_factors, lift),
        ),
    }
    if np.ptp(certificate.route_bodies):
        faults["not one move from"] = replace(certificate, shifts=certificate.shifts[:0])
    for words, wrong in faults.items():
        found = check_route(wrong)
        assert words in found.fault
        assert found.least == -np.inf
