"""Cascades of slips: the plan's loads where nothing slips, a plain simulator where it does."""

from functools import cache

import msgspec
import numpy as np
import pytest

from hand_models.fixed_wrist import slipped_hand
from hand_models.hand import FINGERS
from hand_models.tile import StrengthScatter, TileStrengths
from planner import Plan, plan
from planner.prepare import PreparedStance, prepare_stance
from planner.simulation import Cascade, plan_loads
from planner.simulation.finger_states import STATE_DIGITS, PhalanxState
from service.answering import question
from service.commands.stances import read_request
from service.requests import PlanRequest
from tests.suite.helpers.plain_slips import PlainSlips
from tests.suite.helpers.random_requests import random_request

NAMED = ("wall-300", "wall", "overhang", "slab", "boulders")
# hooked fingers, frames, edges, tiles off the rock, one to four hands, with and without palms
SEEDS = (0, 1, 2, 4, 6, 8, 10, 12, 15, 16, 21, 23, 29, 31, 37)


@cache
def planned(case: str | int) -> tuple[PreparedStance, Plan]:
    """A stance and its plan, by name, or by seed without limits of its own."""
    if isinstance(case, str):
        request = read_request(case)
    else:
        document = random_request(case)
        document.pop("limits", None)
        request = msgspec.convert(document, PlanRequest)
    asked = question(request)
    answer = plan(asked)
    assert answer.hands is not None
    return prepare_stance(asked), answer


def cascade_of(case: str | int) -> Cascade:
    prepared, answer = planned(case)
    return Cascade(prepared, plan_loads(prepared, answer.hands))


def sampled(case: str | int, draws: int, seed: int = 0) -> np.ndarray:
    """Strengths with which a tenth to all draws lose a tile."""
    prepared, answer = planned(case)
    hand = np.concatenate([prepared.batch.places.hand, np.arange(len(answer.hands))])
    surfaces = [hand.surface for hand in prepared.batch.hands]
    law = TileStrengths.of(surfaces, hand, StrengthScatter(0.15, 0.25), 1.0)
    used = cascade_of(case).used
    return law.sample(draws, seed, law.factor_for(used, 0.3))


@pytest.mark.parametrize("case", [*NAMED, *SEEDS])
def test_where_nothing_slips_loads_are_the_plans(case):
    prepared, answer = planned(case)
    cascade = cascade_of(case)
    found = cascade.loads(cascade.start(2))
    on = prepared.batch.touch.touches > 0.0
    used = np.concatenate([hand.tile_utilisations for hand in answer.hands]) * on
    scale = max(1.0, float(np.abs(plan_loads(prepared, answer.hands).tiles).max()))
    for row in range(2):
        tiles = np.concatenate([hand.loads for hand in answer.hands])
        np.testing.assert_allclose(found.tiles[row], tiles, atol=1e-9 * scale)
        np.testing.assert_allclose(found.used[row, : len(used)], used, atol=1e-9 * scale)
        np.testing.assert_allclose(found.used[row], cascade.used, atol=1e-9 * scale)
    assert not found.lost.any()
    # no finger moves by itself
    assert (cascade.fingers.rests[:, 0] == 0).all()
    assert not cascade.fingers.base_lifts[:, 0].any()


def unit_keys(answer: Plan) -> list[tuple[int, int | None]]:
    tiles = [(h, t) for h, hand in enumerate(answer.hands) for t in range(len(hand.tiles))]
    return [*tiles, *((h, None) for h in range(len(answer.hands)))]


def compare(case: str | int, draws: int) -> tuple[int, int]:
    """Compare draws with the plain simulator; return how many slipped, and how many were lost."""
    prepared, answer = planned(case)
    strengths, keys = sampled(case, draws), unit_keys(answer)
    outcome = cascade_of(case).run(strengths)
    names = {key: unit for unit, key in enumerate(keys)}
    for row, strength in enumerate(strengths):
        plain = PlainSlips(prepared, answer)
        if row == 0:
            used = np.array([plain.used().get(key, 0.0) for key in keys])
            np.testing.assert_allclose(np.maximum(used, 0.0), cascade_of(case).used, atol=1e-6)
        held, slipped = plain.run(dict(zip(keys, strength.tolist(), strict=True)))
        assert len(slipped) == outcome.slips[row], (row, slipped)
        assert held == outcome.held[row], (row, slipped)
        assert outcome.first[row] == (names[slipped[0]] if slipped else -1)
    return int((outcome.slips > 0).sum()), int((~outcome.held).sum())


@pytest.mark.parametrize("case", ["wall-300", pytest.param(2, marks=pytest.mark.slow)])
def test_a_plain_simulator_ends_alike(case):
    assert compare(case, 6)[0] > 0


@pytest.mark.slow
@pytest.mark.parametrize("case", [*NAMED, *SEEDS])
def test_a_plain_simulator_ends_alike_on_all_contact_states(case):
    slipped, _ = compare(case, 25)
    assert slipped > 5


# of two hands some contacts bear 0.36 and 0.86 of their joints: their spines across a gap are few
@pytest.mark.parametrize("case", ["slab", 8])
def test_tiles_that_drag_leave_the_loads_of_a_hand_whose_tiles_have_slipped(case):
    prepared, answer = planned(case)
    fingers, few = cascade_of(case).fingers, 0
    for code, digits in enumerate(STATE_DIGITS):
        drags = digits == PhalanxState.DRAGS
        if (digits == PhalanxState.OFF).any() or not drags.any():
            continue
        for f, own in enumerate(prepared.batch.places.phalanges):
            h, i = divmod(f, len(FINGERS))
            hand = prepared.batch.hands[h]
            tiles = own - prepared.batch.places.first[h]
            if not hand.touching[tiles[drags]].all():
                continue
            slipped = slipped_hand(hand, tiles[drags].tolist())
            if slipped.tiles[tiles[drags][0]].contact != "slipped":
                continue
            few += bool((hand.postures.bearing_shares[i] < 1.0).any())
            due = slipped.loads[tiles] @ [1.0, answer.hands[h].tensions[i]]
            found = np.column_stack([fingers.shears[f, code], fingers.normals[f, code]])
            np.testing.assert_allclose(found, due, rtol=1e-9, atol=1e-6 * np.abs(due).max())
    assert few > 5


@pytest.mark.parametrize("case", ["wall", 6, 10])
def test_loads_after_one_slip_balance_the_body(case):
    prepared, _ = planned(case)
    cascade = cascade_of(case)
    on = np.flatnonzero(prepared.batch.touch.touches)
    found = cascade.loads(cascade.slipped(cascade.start(len(on)), on))
    whole = prepared.hands.transports
    rubs = 0.005 * max(1.0, float(np.linalg.norm(prepared.wrench[:3]))) + 1e-5
    due = -prepared.wrench * [1, 1, 1, 10, 10, 10]
    for row in np.flatnonzero(~found.lost):
        forces = np.einsum("tk,tkx->tx", found.tiles[row], prepared.batch.axes)
        palms = np.column_stack(
            [-found.palms[row, :, 0], np.zeros(len(whole)), found.palms[row, :, 1]]
        )
        forces = np.vstack([forces, palms])
        wrenches = np.hstack([forces, np.cross(prepared.batch.points, forces)])
        hand = np.concatenate([prepared.batch.places.hand, np.arange(len(whole))])
        total = np.einsum("tij,tj->i", whole[hand], wrenches) * [1, 1, 1, 10, 10, 10]
        assert np.abs(total - due).max() <= rubs
        # what has slipped holds nothing sideways
        assert not found.holding[row, on[row]]
        assert found.tiles[row, on[row], 2] == 0.0
        shear, normal, _ = found.tiles[row, on[row]]
        assert shear == pytest.approx(prepared.batch.friction[on[row]] * normal, abs=1e-9)


def test_tiles_of_endless_strength_never_slip_and_those_of_none_all_do():
    cascade = cascade_of("slab")
    strong = cascade.run(np.full((3, cascade.units), 1e9))
    assert strong.held.all()
    assert not strong.slips.any()
    assert (strong.first == -1).all()
    weak = cascade.run(np.full((3, cascade.units), 1e-9))
    assert not weak.held.any()
    assert (weak.slips > 1).all()


def test_stronger_tiles_slip_no_more_often():
    cascade, strengths = cascade_of("wall"), sampled("wall", 300)
    weak, strong = cascade.run(strengths), cascade.run(1.3 * strengths)
    assert ((strong.slips > 0) <= (weak.slips > 0)).all()
    assert strong.held.mean() >= weak.held.mean()


def test_draws_do_not_depend_on_each_other():
    cascade, strengths = cascade_of("boulders"), sampled("boulders", 40)
    together = cascade.run(strengths)
    alone = [cascade.run(each[None]) for each in strengths]
    assert [bool(each.held[0]) for each in alone] == together.held.tolist()
    assert [int(each.slips[0]) for each in alone] == together.slips.tolist()
