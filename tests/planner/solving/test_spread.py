"""The spread of a plan: what stances planned one by one with each draw's numbers have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from hand_models.parameters import (
    ParameterSample,
    ParameterTable,
    bundled_draws,
    own_draw,
    own_hand,
    own_surfaces,
)
from hand_models.tile import Surface
from planner.capability import BodySpace
from planner.prepare import prepare_stance, settle_hand
from planner.question import Limits, Question, Stance, drawn_hands, drawn_quantities
from planner.result import DrawnPlan, Spread
from planner.robots import robosimian
from planner.solving import KnownStance, plan, spread
from planner.streaming import WrenchStream
from tests.suite.helpers.spreads import FEW, STRENGTHS, asked_of, drawn, entry, radii, seat
from tests.suite.helpers.stances import TILE_60N, ask, moved, on_wall

SEATS = tuple(drawn(finger=seat(contact)) for contact in (0.0237, 0.0247, 0.0257))


def on_draw(asked: Question, draw: ParameterSample) -> Question:
    """The same question of a robot that has a draw's hands, on rock that has its strength."""
    stance = asked.stance
    surfaces = own_surfaces(draw.surfaces)
    hands = tuple(
        replace(hand, surface=Surface.named(hand.surface.name, surfaces))
        if hand.surface.name is not None
        else hand
        for hand in stance.hands
    )
    there = replace(stance, hands=hands, robot=robosimian(own_hand(draw.hand)))
    return replace(asked, stance=there, want=frozenset(["load_factor"]), draws=None)


def planned_apart(asked: Question) -> list[DrawnPlan]:
    """What plans of all draws say that are asked for one by one."""
    found = []
    for draw in asked.draws:
        try:
            answer = plan(on_draw(asked, draw))
        except InvalidInputError:
            found.append(DrawnPlan())
            continue
        holds = answer.status == "optimal"
        found.append(DrawnPlan(answer.utilisation, answer.load_factor, holds))
    return found


def almost(values):
    return [None if value is None else pytest.approx(value, rel=1e-5) for value in values]


PLAIN = tuple(
    draw._replace(half_planes=None, discrepancy=())
    for draw in bundled_draws()  # as questions can have them
)
MIXED = replace(
    on_wall(),
    hands=tuple(
        replace(hand, surface=surface)
        for hand, surface in zip(
            on_wall().hands,
            (*map(Surface.named, ("rock", "concrete-fine", "concrete-coarse")), TILE_60N),
            strict=True,
        )
    ),
)


@pytest.mark.parametrize(
    "asked",
    [
        pytest.param(ask(MIXED, "spread", draws=PLAIN), marks=pytest.mark.slow),
        ask(on_wall(), "spread", draws=FEW, limits=Limits(utilisation=0.8, tendon_tension=150.0)),
        ask(on_wall(), "spread", draws=FEW, objective="min_effort"),
        pytest.param(asked_of("wall-300-joints", draws=FEW), marks=pytest.mark.slow),
        asked_of("ledge", draws=FEW),
        pytest.param(asked_of("wall-700", draws=FEW), marks=pytest.mark.slow),
        pytest.param(asked_of("boulders", draws=FEW), marks=pytest.mark.slow),
    ],
    ids=["mixed", "capped", "effort", "joints", "nails", "weak", "mesh"],
)
def test_it_is_what_each_draw_has_by_itself(asked):
    found, apart = plan(asked).spread, planned_apart(asked)
    assert found.draws == len(apart)
    assert found.holds == sum(each.holds for each in apart)
    assert found.without == sum(each.utilisation is None for each in apart)
    for name in ("utilisation", "load_factor"):
        one_by_one = [getattr(each, name) for each in apart]
        assert getattr(found, f"{name}s") == almost(one_by_one)
        told = getattr(found, name)
        if name == "load_factor":
            # a draw without a plan holds nothing
            one_by_one = [
                0.0 if each.utilisation is value is None else value
                for each, value in zip(apart, one_by_one, strict=True)
            ]
        there = [value for value in one_by_one if value is not None]
        percents = (0, 50, 100) if len(there) < 20 else (5, 50, 95)
        expected = np.percentile(there, percents).tolist()
        assert [told.low, told.median, told.high] == pytest.approx(expected, rel=1e-5)
    assert plan(asked).spread == found


@pytest.mark.slow
@pytest.mark.parametrize("mass", [60.0, None])
def test_floating_wrists_that_begin_at_the_usual_plan_are_no_worse_than_by_themselves(mass):
    """Their searches end at a local optimum, and bracket load factors no closer than this."""
    plain = tuple(
        draw._replace(half_planes=None, discrepancy=()) for draw in bundled_draws(wrists_move=True)
    )
    asked = replace(asked_of("wall-300-floating", draws=plain[::3]), explain=False)
    if mass is not None:
        asked = replace(asked, load=structs.replace(asked.load, mass=mass))
    found, apart = plan(asked).spread, planned_apart(asked)
    # a sample within the bracket of the cap may be on either side of it
    assert abs(found.holds - sum(each.holds for each in apart)) <= 1
    # relative, of the largest factor: where a palm begins to press, one search ends 10 % higher
    bracket = 0.12
    for used, factor, alone in zip(found.utilisations, found.load_factors, apart, strict=True):
        assert used <= alone.utilisation * (1.0 + bracket)
        assert factor >= alone.load_factor * (1.0 - bracket)
    # few come out better
    ends = [each.utilisation for each in apart]
    assert sorted(np.abs(np.array(found.utilisations) / ends - 1.0))[-3] <= bracket


def with_wrists(name: str, wrist: str, **kwargs) -> Question:
    """The question of a bundled stance's spread, with one kind of wrists."""
    asked = asked_of(name)
    hands = tuple(replace(hand, wrist=wrist, **kwargs) for hand in asked.stance.hands)
    return replace(asked, stance=replace(asked.stance, hands=hands))


@pytest.mark.parametrize(("wrist", "share"), [("fixed", 0.0), ("compliant", 1.0)])
def test_how_stiff_tiles_are_on_rock_counts_where_wrists_move(wrist, share):
    draws = tuple(drawn(tile={"rock_stiffness_ratio": entry(k, "1")}) for k in (0.5, 1.0, 2.0))
    found = plan(replace(with_wrists("overhang", wrist), draws=draws)).spread
    named = {each.quantity: each.share for each in found.sensitive_to}
    assert named.get("tile.rock_stiffness_ratio", 0.0) == pytest.approx(share)
    if share:
        assert found.load_factors == pytest.approx([0.948, 1.041, 1.186], abs=5e-3)
    else:
        assert found.load_factors == almost([found.load_factors[0]] * 3)


def test_bundled_samples_have_it_where_wrists_move():
    hand, rock = on_wall().robot.hand, frozenset(["rock"])
    for moving in (False, True):
        named = drawn_quantities(drawn_hands(hand, wrists_move=moving), rock)
        assert ("tile.rock_stiffness_ratio" in named) == moving


@pytest.mark.parametrize(
    ("wrist", "surface", "moves"),
    [
        ("fixed", "rock", False),
        ("compliant", "rock", True),
        ("floating", "concrete-fine", True),
        ("compliant", "sandpaper-36", False),
    ],
)
def test_only_wrists_that_move_on_rock_draw_its_stiffness(wrist, surface, moves, monkeypatch):
    asked = with_wrists("overhang", wrist, surface=Surface.named(surface))
    # with samples of the caller, no threshold is sought
    asked, seen = replace(asked, draws=STRENGTHS), []

    def none(hand, draws, *, wrists_move, limbs):
        seen.append(wrists_move)
        return ()

    monkeypatch.setattr(spread, "drawn_hands", none)
    spread.find_spread(prepare_stance(asked), (), None, None)
    assert seen == [moves]


def test_the_plan_itself_stays():
    asked = ask(on_wall(), "load_factor")
    plain, told = plan(asked), plan(replace(asked, want=frozenset(["load_factor", "spread"])))
    assert plain.spread is None
    assert told.load_factor == plain.load_factor
    assert told.utilisation == plain.utilisation
    spread = told.spread
    assert spread.load_factor.low < told.load_factor < spread.load_factor.high
    assert 0 < spread.holds < spread.draws == len(bundled_draws())


def test_it_does_not_hang_on_where_the_world_is():
    by = Pose(np.array([3.0, -2.0, 5.0]), Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix())
    here, there = (
        plan(ask(stance, "spread", draws=FEW)).spread
        for stance in (on_wall(), moved(on_wall(), by))
    )
    assert there.load_factors == almost(here.load_factors)
    assert there.utilisations == almost(here.utilisations)


def test_the_order_of_draws_does_not_matter():
    once, again = (plan(ask(on_wall(), "spread", draws=draws)).spread for draws in (FEW, FEW[::-1]))
    assert again.load_factors == once.load_factors[::-1]
    assert again.load_factor == once.load_factor
    assert again.holds == once.holds
    by_name = {each.quantity: each.share for each in once.sensitive_to}
    assert {each.quantity: each.share for each in again.sensitive_to} == pytest.approx(by_name)


def test_on_a_callers_own_numbers_only_the_hand_varies():
    """Even if they are those of a preset."""
    usual = Surface.named("rock")
    mine = Surface.from_values({"shear_limit": usual.shear_limit})
    assert mine == usual
    one = plan(ask(on_wall(surface=mine), "spread", "load_factor", draws=STRENGTHS))
    assert one.spread.load_factors == almost([one.load_factor] * len(STRENGTHS))
    assert one.spread.sensitive_to == []
    changed = replace(usual, shear_limit=61.0)
    other = plan(ask(on_wall(surface=changed), "spread", draws=STRENGTHS)).spread
    assert other.load_factors == almost([other.load_factors[0]] * len(STRENGTHS))
    bundled = plan(ask(on_wall(surface=mine), "spread")).spread
    known = {"finger", "tile", "palm", "discrepancy"}
    assert {each.quantity.split(".")[0] for each in bundled.sensitive_to} <= known


def test_half_planes_that_were_asked_for_stay():
    finer = replace(Surface.named("rock"), half_planes=4)
    asked = ask(on_wall(surface=finer), "spread", draws=STRENGTHS[:2])
    factors = plan(asked).spread.load_factors
    for draw, factor in zip(STRENGTHS, factors, strict=False):
        rock = draw.surfaces.scalar("rock", "shear_limit")
        own = Surface.from_values({"shear_limit": rock, "half_planes": 4})
        assert factor == pytest.approx(plan(ask(on_wall(surface=own), "load_factor")).load_factor)


def seated(stance: Stance, **kwargs) -> Stance:
    hands = tuple(
        replace(hand, hold_in_hand=settle_hand(hand, stance).seating.pose, **kwargs)
        for hand in stance.hands
    )
    return replace(stance, hands=hands)


def test_a_seat_that_is_given_stays_and_one_that_is_not_moves():
    moves = plan(ask(on_wall(), "spread", draws=SEATS)).spread
    assert np.ptp(moves.load_factors) > 0.01
    assert moves.sensitive_to[0].quantity == "finger.seated_contact"
    stays = plan(ask(seated(on_wall()), "spread", draws=SEATS)).spread
    assert stays.load_factors == almost([moves.load_factors[1]] * 3)


def test_a_best_seat_is_kept_where_it_was_found():
    limbs = ("front_left", "front_right")
    stance = on_wall(limbs=limbs)
    best = replace(stance, hands=tuple(replace(hand, seat="best") for hand in stance.hands))
    there = plan(ask(best, "spread", draws=FEW[:2])).spread
    given = plan(ask(seated(best, seat="rest"), "spread", draws=FEW[:2])).spread
    assert there.load_factors == almost(given.load_factors)


def test_a_hand_of_the_callers_own_stays_in_what_it_changes():
    mine = own_hand(own_draw({"hand": {"finger": radii(0.003, 0.0024) | seat(0.0241)}}).hand)
    stance = replace(on_wall(surface=TILE_60N), robot=robosimian(mine))
    found = plan(ask(stance, "spread")).spread
    assert found.sensitive_to
    sections = {each.quantity.split(".")[0] for each in found.sensitive_to}
    assert sections <= {"tile", "palm", "discrepancy"}


NOTHING = ParameterSample(ParameterTable({}), ParameterTable({}))
LIMBS = sorted(hand.limb for hand in on_wall().hands)


def test_a_common_discrepancy_is_that_much_stronger_rock():
    """Where closed fingers are laid on the rock, whatever it holds."""
    factors = (0.8, 1.0, 1.25)
    drawn_by = tuple(NOTHING._replace(discrepancy=(f, *[1.0] * 8)) for f in factors)
    found = plan(ask(on_wall(), "spread", draws=drawn_by)).spread
    rocks = tuple(drawn(68.1 * f) for f in factors)
    stronger = plan(ask(on_wall(), "spread", draws=rocks)).spread
    assert found.load_factors == almost(stronger.load_factors)
    assert [each.quantity for each in found.sensitive_to] == ["discrepancy.common"]


@pytest.mark.parametrize("weak", range(4))
def test_each_limb_has_its_own_discrepancy_by_its_name(weak):
    own = [1.0] * 8
    own[weak] = 0.6
    draws = (NOTHING._replace(discrepancy=(1.0, *own)),)
    found = plan(ask(on_wall(), "spread", draws=draws)).spread
    usual = Surface.named("rock")
    hands = tuple(
        replace(hand, surface=usual.times(0.6)) if hand.limb == LIMBS[weak] else hand
        for hand in on_wall().hands
    )
    alone = plan(ask(replace(on_wall(), hands=hands), "load_factor"))
    assert found.load_factors == almost([alone.load_factor])
    backwards = replace(on_wall(), hands=on_wall().hands[::-1])
    assert plan(ask(backwards, "spread", draws=draws)).spread.load_factors == almost(
        found.load_factors
    )


def test_a_law_of_more_pieces_is_that_of_more_half_planes():
    draws = tuple(NOTHING._replace(half_planes=n) for n in (1, 2, 4))
    found = plan(ask(on_wall(), "spread", draws=draws)).spread
    for planes, factor in zip((1, 2, 4), found.load_factors, strict=True):
        finer = replace(Surface.named("rock"), half_planes=planes)
        alone = plan(ask(on_wall(surface=finer), "load_factor"))
        assert factor == pytest.approx(alone.load_factor, rel=1e-5)
    assert found.load_factors == sorted(found.load_factors)
    assert [each.quantity for each in found.sensitive_to] == ["tile.half_planes"]


def test_of_no_body_wrench_there_is_a_utilisation_and_no_load_factor():
    found = plan(ask(on_wall(), "spread", body_wrench=np.zeros(6), draws=FEW)).spread
    assert found.load_factor is None
    assert found.holds == len(FEW)
    assert found.sensitive_to == []


def test_a_known_stance_tells_it_for_each_wrench():
    asked = ask(on_wall(), "spread", draws=FEW)
    once = plan(asked).spread
    again = KnownStance(asked).plan(0.5 * asked.needed_wrench()).spread
    assert again.load_factors == almost([2.0 * factor for factor in once.load_factors])


def test_what_solvers_leave_of_equal_load_factors_is_no_variation():
    rng = np.random.default_rng(0)
    factors = 1.9 + 1e-7 * rng.random(30)
    factors[3] = 1.5
    values = {"a": rng.permutation(np.arange(30.0)), "b": rng.permutation(np.arange(30.0))}
    told = [
        Spread.of([DrawnPlan(load_factor=each) for each in noisy], 1.0, {}, values)
        for noisy in factors + 1e-8 * rng.random((2, 30))
    ]
    assert told[0].sensitive_to == told[1].hangs_on
    assert told[0].sensitive_to[0].share < 0.2


def test_draws_may_set_different_numbers_of_a_preset():
    ratios = [{"surfaces": {"rock": {"pull_off_ratio": entry(r, "1")}}} for r in (0.2, 0.25, 0.35)]
    draws = (drawn(60.0), *(own_draw(ratio) for ratio in ratios))
    found = plan(ask(on_wall(), "spread", draws=draws)).spread
    assert found.load_factors[1] < found.load_factors[2] < found.load_factors[3]
    assert found.sensitive_to[0].quantity in ("rock.pull_off_ratio", "rock.shear_limit")
    assert {each.quantity for each in found.sensitive_to} >= {"rock.pull_off_ratio"}


def test_streams_and_body_spaces_of_a_question_with_draws_leave_them_out():
    asked = ask(on_wall(), "spread", draws=FEW)
    first = WrenchStream(asked).first
    np.testing.assert_allclose(first, BodySpace(asked).plan.body_wrench)


def test_draws_that_cannot_be_are_refused_by_their_entry():
    # possible one by one, but not together
    bad = drawn(tendon={"closing_tension": entry(900.0, "N")})
    with pytest.raises(
        InvalidInputError, match=r"must be at most tendon.maximum_tension, 700 N"
    ) as caught:
        ask(on_wall(), "spread", draws=(*FEW, bad))
    assert caught.value.field == "draws[4].hand.tendon.closing_tension"
    ratio = {"surfaces": {"defaults": {"pull_off_ratio": entry(1.5, "1")}}}
    with pytest.raises(InvalidInputError, match="must not exceed") as caught:
        ask(on_wall(), "spread", draws=(own_draw(ratio),))
    assert caught.value.field == "draws[0].surfaces.sandpaper-36.pull_off_limit"
    with pytest.raises(InvalidInputError, match="requires 'spread' in want") as caught:
        ask(on_wall(), "load_factor", draws=FEW)
    assert caught.value.field == "draws"
    for count in (0, 101):
        with pytest.raises(
            InvalidInputError, match=f"from 1 to 100 draws .* got {count}"
        ) as caught:
            ask(on_wall(), "spread", draws=FEW[:1] * count)
        assert caught.value.field == "draws"
