"""A plan's tensions on hands that are not as planned: kept, and balanced by feedback."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.hand import FINGERS
from hand_models.parameters import own_draw
from planner import programs
from planner.execution import sent_plans
from planner.prepare import prepare_stance
from planner.programs import SET_POINT_SETTINGS, Kept, LeastChange
from planner.question import LimbStiffness, Limits, Question
from planner.result import Spread
from planner.solving import plan
from service.answering.questions import question
from service.commands.cli import run_command_line
from service.commands.stances import read_request
from tests.planner.solving.test_spread import STRENGTHS, drawn, entry, radii, seat, with_wrists
from tests.suite.helpers.checks import problems
from tests.suite.helpers.commands import DONE
from tests.suite.helpers.stances import ask, moved, on_wall

STIFFER = drawn(tile={"contact_stiffness": entry([5500.0, 6500.0, 9500.0], "N/m")})
"""Tiles that are dragged backwards at tensions at which softer ones hold."""

MIXED = (*STRENGTHS[:2], STIFFER, drawn(finger=seat(0.0239)), drawn(60.0, finger=seat(0.0255)))


def judged(asked: Question) -> Spread:
    found = plan(replace(asked, want=frozenset({"spread"}))).spread
    assert found is not None
    return found


def held_in(asked: Question, tensions: np.ndarray) -> tuple[programs.StanceData, list[np.ndarray]]:
    """Rows of a stance, and what of its loads is held at tensions, shape (hands, 4)."""
    prepared, held = prepare_stance(asked), []
    for space, own in zip(prepared.hands.spaces, tensions, strict=True):
        y = np.full(len(space.columns), np.nan)
        y[[space.columns.index(f"{finger}/tension") for finger in FINGERS]] = own
        held.append(y)
    return prepared.hands.data, held


def tensions_of(asked: Question) -> np.ndarray:
    return np.array([hand.tensions for hand in plan(asked).hands])


def shifted(asked: Question, by: float, seed: int = 0) -> np.ndarray:
    """The tensions of a stance's plan, each changed by up to so much [N]."""
    own = tensions_of(asked)
    return own + by * np.random.default_rng(seed).random(own.shape)


ASKED = ask(on_wall())


@pytest.mark.parametrize("name", ["wall-300", "ledge", "wall-300-joints"])
def test_kept_tensions_use_as_little_as_highs_finds_with_them(name):
    asked = question(read_request(name))
    data, held = held_in(asked, shifted(asked, 4.0))
    found = programs.kept(data, held)
    z = np.concatenate(held) / data.rows.unit
    rows, balance = data.rows.whole, len(data.wrench)
    limits = balance + data.rows.limits
    A = np.hstack([rows[balance:], np.zeros((len(rows) - balance, 1))])
    A[: limits - balance, -1] = -1.0
    other = linprog(
        np.append(np.zeros(len(z)), 1.0),
        A_ub=A,
        b_ub=data.rows.rest,
        A_eq=np.hstack([rows[:balance], np.zeros((balance, 1))]),
        b_eq=data.offset,
        bounds=[*((None, None) if np.isnan(v) else (v, v) for v in z), (None, None)],
    )
    assert found.value == pytest.approx(other.fun, rel=1e-6)
    assert programs.used(data, found.loads).max() == pytest.approx(found.value, rel=1e-6)
    by_definition, _ = Kept(data, held).by_definition()
    assert by_definition.value == pytest.approx(found.value, rel=1e-6)
    for y, own in zip(found.loads, held, strict=True):
        np.testing.assert_allclose(y[~np.isnan(own)], own[~np.isnan(own)], rtol=1e-14)


def test_feedback_changes_tensions_by_the_least_squares_that_another_solver_finds():
    data, held = held_in(ASKED, shifted(ASKED, -6.0))
    assert not programs.kept(data, held).solved
    found = programs.least_change(data, held)
    other, _ = LeastChange(data, held).by_definition({"solver": "OSQP", "eps_abs": 1e-9})
    assert found.value > 1.0
    assert other.value == pytest.approx(found.value, rel=1e-5)
    changes = np.concatenate(found.loads) - np.concatenate(held)
    free = np.concatenate(found.loads)[np.isnan(changes)]
    squares = np.nansum(changes**2) + SET_POINT_SETTINGS.reactions * (free @ free)
    assert squares == pytest.approx(found.value, rel=1e-6)
    # strengths are unknown to it
    strong = [hand._replace(L=0.1 * hand.L, l0=0.1 * hand.l0) for hand in data.hands]
    same = programs.least_change(programs.StanceData.of(tuple(strong), data.wrench), held)
    assert same.value == pytest.approx(found.value, rel=1e-9)


def a_little(by: np.ndarray) -> Pose:
    return Pose(by[:3], Rotation.from_rotvec(by[3:]).as_matrix())


@pytest.fixture
def mine(tmp_path: Path) -> Question:
    """The stance that `crux new` writes, on which hands can squeeze each other without end."""
    file = tmp_path / "mine.toml"
    assert run_command_line(["new", "stance", "-o", str(file)]) == DONE
    return replace(question(read_request(str(file))), want=frozenset({"spread"}))


def test_squeezing_hands_do_not_spoil_the_tensions_of_feedback(mine: Question):
    weak = drawn(52.0, finger=radii(0.0028, 0.0022))
    ratio = {"defaults": {"pull_off_ratio": entry(0.25, "1")}}
    draws = (weak, own_draw({"surfaces": {"rock": {"shear_limit": entry(71.0, "N")}, **ratio}}))
    found = []
    rng = np.random.default_rng(2)
    for size in (0.0, 1e-9, 1e-9, 1e-8):
        hands = tuple(
            replace(hand, pose=hand.pose @ a_little(size * rng.normal(size=6)))
            for hand in mine.stance.hands
        )
        asked = replace(mine, stance=replace(mine.stance, hands=hands), draws=draws)
        found.append(judged(asked).feedback.utilisations)
    wall = question(read_request("wall-300"))
    usual = replace(wall, draws=draws, want=mine.want)
    found.append(judged(usual).feedback.utilisations)
    for each in found:
        assert each == pytest.approx(found[0], rel=1e-3)
        assert max(each) < 2.0


def test_tensions_of_feedback_go_with_loads_that_hands_can_bear(mine: Question):
    data, held = held_in(mine, shifted(mine, -6.0))
    found = programs.least_change(data, held)
    assert max(abs(loads).max() for loads in found.loads) < 1e3


def test_loads_beyond_the_box_balance_nothing(monkeypatch):
    prepared, own = prepare_stance(ASKED), tensions_of(ASKED)
    assert sent_plans(prepared, own, 0.0)[0].utilisation is not None
    monkeypatch.setattr("planner.programs.load_box", lambda wrench: 1.0)
    assert [each.utilisation for each in sent_plans(prepared, own, 0.0)] == [None, None]


def test_on_the_hands_of_the_plan_its_tensions_are_its_plan():
    asked = ask(on_wall(), "spread", draws=(drawn(68.1),))
    answer = plan(replace(asked, want=frozenset({"spread"})))
    for each in (answer.spread.kept, answer.spread.feedback):
        assert each.utilisations == pytest.approx([answer.utilisation], rel=1e-6)
        assert (each.holds, each.without) == (1, 0)


@pytest.mark.parametrize("name", ["wall-300", pytest.param("slab", marks=pytest.mark.slow)])
def test_no_set_points_are_better_than_a_plan_made_anew_and_feedback_balances_more(name):
    found = judged(question(read_request(name)))
    assert found.kept.without > 0
    # of a sample without a plan there is none either
    assert found.feedback.without == found.without < found.kept.without
    assert found.kept.holds <= found.feedback.holds <= found.holds
    trios = zip(
        found.utilisations, found.feedback.utilisations, found.kept.utilisations, strict=True
    )
    for anew, fed, kept in trios:
        if anew is None:
            assert fed is None
            continue
        # of which a plan gives a thousandth away
        assert anew <= 1.001001 * fed
        assert kept is None or kept == fed


def test_strength_alone_takes_no_balance_and_feedback_does_not_know_it():
    found = judged(ask(on_wall(), "spread", draws=STRENGTHS))
    assert found.kept == found.feedback
    assert found.kept.without == 0
    order = np.argsort([draw.surfaces.scalar("rock", "shear_limit") for draw in STRENGTHS])
    used = np.array(found.kept.utilisations)[order]
    assert (np.diff(used) < 0.0).all()
    assert found.kept.holds == (used <= 1.0).sum()


def test_a_tile_that_would_be_dragged_back_leaves_no_balance_until_a_margin_keeps_it():
    asked = ask(on_wall(), "spread", draws=(STIFFER,))
    assert judged(asked).kept.without == 1
    margin = Limits(hold_margin=5.0, least_tension=5.0)
    spared = judged(replace(asked, limits=margin))
    # the margin is the plan's, and may be spent
    assert spared.kept.without == 0
    tight = replace(asked, limits=Limits(hold_margin=5.0), draws=(drawn(68.1), STIFFER))
    assert judged(tight).kept.without == 0


@pytest.mark.slow
def test_palms_that_press_can_also_give_less():
    asked = question(read_request("ledge"))
    bound = replace(asked, limits=Limits(palm_margin=15.0))
    free, pressed = plan(asked), plan(bound)
    for answer, least in ((free, 0.0), (pressed, 15.0)):
        presses = [hand.palm.force[2] for hand in answer.hands if hand.palm.engaged]
        assert min(presses) == pytest.approx(least, abs=1e-5)
    assert pressed.utilisation > free.utilisation
    assert problems(bound, pressed) == []
    assert any("its palm presses with" in each for each in problems(bound, free))
    before, after = judged(asked), judged(bound)
    assert after.kept.without < before.kept.without / 2
    assert after.kept.holds >= before.kept.holds


def test_neither_place_nor_order_of_hands_matters():
    asked = ask(on_wall(), "spread", draws=MIXED)
    here = judged(asked)
    by = Pose(np.array([3.0, -2.0, 5.0]), Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix())
    turned = on_wall()
    others = (moved(turned, by), replace(turned, hands=turned.hands[::-1]))
    assert here.kept.without > 0
    for stance in others:
        there = judged(replace(asked, stance=stance))
        for name in ("kept", "feedback"):
            pairs = zip(
                getattr(here, name).utilisations, getattr(there, name).utilisations, strict=True
            )
            for one, other in pairs:
                assert other == (None if one is None else pytest.approx(one, rel=1e-5))


def test_a_hand_that_cannot_be_there_balances_nothing():
    weak = drawn(tendon={"maximum_tension": entry(50.0, "N")})
    found = judged(ask(on_wall(closing_tension=60.0), "spread", draws=(STRENGTHS[2], weak)))
    assert (found.kept.without, found.feedback.without) == (1, 1)
    assert found.kept.utilisations[1] is None


def test_without_a_plan_there_are_no_set_points():
    heavy = ask(on_wall(palm=False), "spread", draws=STRENGTHS)
    none = replace(heavy, body_wrench=np.array([0.0, 0.0, 1e5, 0.0, 0.0, 0.0]))
    answer = plan(replace(none, want=frozenset({"spread"})))
    assert answer.status == "infeasible"
    assert answer.spread.kept is answer.spread.feedback is None


@pytest.mark.parametrize("off", [1e-3, float("nan")])
def test_loads_that_do_not_pass_the_checks_balance_nothing(monkeypatch, off):
    prepared, own = prepare_stance(ASKED), tensions_of(ASKED)
    honest = programs.kept

    def lies(data, held):
        outcome = honest(data, held)
        return replace(outcome, loads=tuple(y + off for y in outcome.loads))

    assert sent_plans(prepared, own, 0.0)[0].utilisation == pytest.approx(plan(ASKED).utilisation)
    monkeypatch.setattr(programs, "kept", lies)
    assert [each.utilisation for each in sent_plans(prepared, own, 0.0)] == [None, None]


@pytest.mark.parametrize("wrist", ["compliant", pytest.param("floating", marks=pytest.mark.slow)])
def test_where_wrists_move_limbs_balance_the_body_on_tensions_that_are_kept(wrist):
    draws = (drawn(68.1), drawn(90.0), drawn(finger=seat(0.0244)))
    asked = replace(with_wrists("overhang", wrist), draws=draws, want=frozenset({"spread"}))
    if wrist == "floating":
        asked = replace(asked, load=structs.replace(asked.load, mass=20.0))
    assert plan(asked).spread.kept is None
    stiffness = LimbStiffness(position=5e3, angle=100.0)
    answer = plan(replace(asked, stance=replace(asked.stance, limb_stiffness=stiffness)))
    found = answer.spread
    assert found.feedback is None
    assert found.failing == "overloaded or dragged"
    assert found.kept.without == 0
    usual, stronger, moved_on = found.kept.utilisations
    assert usual == pytest.approx(answer.utilisation, rel=1e-5)
    assert stronger < usual
    assert moved_on != pytest.approx(usual, rel=1e-3)
