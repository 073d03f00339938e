"""Plans without tiles that have slipped: hand-worked loads, another solver, symmetry, the check."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from hand_models.base import InvalidInputError, UnsupportedError
from hand_models.fixed_wrist import slipped_hand, wrench_spaces
from hand_models.hand import FINGERS
from planner import programs
from planner.prepare import HandBatch, prepare_stance
from planner.programs.conic import WAITING_SOLVERS
from planner.programs.program import Best
from planner.question import LostTile
from planner.recovery import Recovery
from planner.recovery.spare_fingers import cannot_spare
from planner.verification import Check
from planner.verification.check import SETTLED_LIMITS
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.hands import pinch

NAMES = ["wall-300", "wall", "slab", "boulders"]


@pytest.fixture(scope="module")
def recoveries():
    """A prepared stance of each name."""
    return {name: Recovery(prepare_stance(question(read_request(name)))) for name in NAMES}


def some(recovery: Recovery, seed: int, count: int) -> list[list[LostTile]]:
    """Random losses of one to three tiles."""
    chance, tiles = np.random.default_rng(seed), recovery.tiles
    return [
        [tiles[i] for i in chance.choice(len(tiles), chance.integers(1, 4), replace=False)]
        for _ in range(count)
    ]


def test_a_distal_tile_that_slips_is_balanced_by_hand():
    """About the last joint: M r f - k q - tau = along N + height mu N."""
    hand = pinch()
    finger, tile = (
        1,
        next(t for t, each in enumerate(hand.tiles) if each[:2] == ("inner_left", "distal")),
    )
    slipped, model, mu = slipped_hand(hand, [tile]), hand.hand.finger, hand.surface.friction
    bend = float(np.diff(hand.postures.angles[finger])[-1])
    spring = model.joint_stiffness[2] * bend + model.joint_preload[2]
    pull = (1.0 - model.friction) ** 2 * model.pulley_radii[2]
    arm = hand.postures.alongs[finger, 2] + mu * model.tile_height
    for tension in (40.0, 90.0):
        normal = (pull * tension - spring) / arm
        shear, across = slipped.loads[tile] @ [1.0, tension]
        assert across == pytest.approx(normal, rel=1e-9)
        assert shear == pytest.approx(mu * normal, rel=1e-9)
    assert slipped.tiles[tile].contact == "slipped"
    others = [t for t in range(len(hand.tiles)) if hand.finger_of[t] != finger]
    assert np.array_equal(slipped.loads[others], hand.loads[others])


def test_the_lateral_reaction_goes_over_to_the_tiles_that_hold():
    hand = pinch()
    tile = next(t for t, each in enumerate(hand.tiles) if each[:2] == ("inner_left", "middle"))
    slipped = slipped_hand(hand, [tile])
    own = hand.finger_of == 1
    assert slipped.lateral_shares[tile] == 0.0
    assert slipped.lateral_shares[own].sum() == pytest.approx(1.0)
    assert slipped.lateral_limits[1] == pytest.approx(hand.lateral_limits[1] * 2 / 3)


def test_a_finger_of_which_nothing_holds_is_released():
    hand = pinch()
    gone = [t for t in range(len(hand.tiles)) if hand.finger_of[t] == 0]
    slipped = slipped_hand(hand, gone)
    assert {slipped.tiles[t].contact for t in gone} == {"none"}
    assert not slipped.loads[gone].any()


@pytest.mark.parametrize("name", NAMES)
def test_every_plan_is_verified_and_uses_the_solver_that_is_there(recoveries, name):
    recovery = recoveries[name]
    recovery.plan(recovery.tiles[:1])
    before = WAITING_SOLVERS.info().misses
    plans = [recovery.plan(lost) for lost in some(recovery, 1, 12)]
    assert WAITING_SOLVERS.info().misses == before
    for found in plans:
        assert found.verified is not None
        told = found.plan()
        assert told.verified
        state = {
            (hand.limb, tile.finger, tile.phalanx): tile.contact
            for hand in told.hands
            for tile in hand.tiles
        }
        released = {*found.released}
        for each in found.lost:
            off = (each.limb, each.finger) in released
            expected = "none" if off else "slipped"
            assert state[each.limb, each.finger, each.phalanx] == expected


@pytest.mark.parametrize("name", NAMES)
def test_another_solver_finds_the_same_utilisation(recoveries, name):
    """HiGHS, over the rows of the hands' sets in newtons."""
    recovery = recoveries[name]
    for lost in some(recovery, 2, 4):
        found = recovery.plan(lost)
        prepared = found.found.prepared
        sizes = [len(space.columns) for space in prepared.hands.spaces]
        ends = np.cumsum([0, *sizes])
        A, b, G, g = [], [], np.zeros((6, ends[-1] + 1)), prepared.wrench.copy()
        for h, space in enumerate(prepared.hands.spaces):
            own = slice(ends[h], ends[h + 1])
            rows = np.zeros((len(space.s) + len(space.h), ends[-1] + 1))
            rows[: len(space.s), own] = space.L / space.s[:, None]
            rows[: len(space.s), -1] = -1.0
            rows[len(space.s) :, own] = space.H
            A.append(rows)
            b.append(np.concatenate([-space.l0 / space.s, space.h]))
            carried = -prepared.hands.transports[h]
            G[:, own] = carried @ space.generators
            g -= carried @ space.origin
        goal = np.zeros(ends[-1] + 1)
        goal[-1] = 1.0
        least = linprog(goal, np.vstack(A), np.concatenate(b), G, g, bounds=(None, None)).fun
        assert found.found.answer.solution.least.value == pytest.approx(least, abs=1e-6)
        assert found.utilisation >= least - 1e-6


def test_the_definition_in_cvxpy_agrees(recoveries):
    recovery = recoveries["wall-300"]
    for lost in some(recovery, 3, 2):
        found = recovery.plan(lost)
        data = found.found.prepared.hands.data
        outcome, _ = Best(data).by_definition()
        least = found.found.answer.solution.least.value
        assert outcome.value == pytest.approx(least, abs=1e-5)


def test_mirrored_losses_use_as_much(recoveries):
    recovery = recoveries["wall-300"]
    mirror = {"right": "left", "left": "right"}

    def mirrored(name: str) -> str:
        first, side = name.split("_")
        return f"{first}_{mirror[side]}"

    for tile in recovery.tiles[:14:3]:
        other = LostTile(mirrored(tile.limb), mirrored(tile.finger), tile.phalanx)
        one, two = recovery.plan([tile]), recovery.plan([other])
        assert one.utilisation == pytest.approx(two.utilisation, abs=1e-5)


def test_nothing_lost_is_the_plan_of_the_stance(recoveries):
    recovery = recoveries["wall-300"]
    whole = recovery.plan(())
    assert whole.utilisation == pytest.approx(0.9564, abs=1e-3)
    assert whole.holds
    assert whole.save_first is None


def test_a_hand_that_is_off_carries_nothing(recoveries):
    recovery = recoveries["slab"]
    found = recovery.plan((), off=["front_left"])
    told = found.plan()
    hand = next(each for each in told.hands if each.limb == "front_left")
    assert told.verified
    assert not hand.wrench.any()
    assert not hand.tensions.any()
    assert {(limb, finger) for limb, finger in found.released} == {
        ("front_left", finger) for finger in FINGERS
    }


def test_a_hand_that_is_off_is_a_stance_without_it(recoveries):
    """The plan of the other three alone has the same utilisation."""
    recovery = recoveries["slab"]
    asked = recovery.prepared.question
    others = tuple(h for h in asked.stance.hands if h.limb != "front_left")
    stance = replace(asked.stance, hands=others)
    three = replace(asked, stance=stance, load=None, body_wrench=recovery.prepared.wrench)
    alone = Recovery(prepare_stance(three)).plan(())
    off = recovery.plan((), off=["front_left"])
    assert off.utilisation == pytest.approx(alone.utilisation, abs=2e-3)
    assert off.found.answer.solution.least.value == pytest.approx(
        alone.found.answer.solution.least.value, abs=1e-5
    )


def test_the_check_refuses_what_a_slip_leaves_nobody(recoveries):
    recovery = recoveries["wall-300"]
    tile = LostTile("front_left", "inner_left", "middle")
    whole, without = recovery.plan(()), recovery.plan([tile])
    for found, lost, words in (
        # the spines still carry, as the intact plan says
        (whole, [tile], "another contact than its slip"),
        (without, [], "another contact than its slip"),
        (without, [tile, LostTile("front_left", "inner_left", "distal")], "another contact"),
        (without, [tile, LostTile("front_left", "thumb", "distal")], "not in this stance"),
    ):
        prepared = found.found.prepared
        check = Check(prepared.question, prepared.batch, None, lost)
        wrong = check.problems(found.verified.arrays, found.utilisation, prepared.wrench)
        assert any(words in each for each in wrong), wrong
    prepared = without.found.prepared
    check = Check(prepared.question, prepared.batch, None, [tile])
    arrays = without.verified.arrays
    assert not check.problems(arrays, without.utilisation, prepared.wrench)
    dragging = prepared.batch.touch.slipped[0]
    loads = arrays.loads.copy()
    loads[dragging, 0] += 1.0
    wrong = check.problems(arrays._replace(loads=loads), without.utilisation, prepared.wrench)
    assert any("are not friction" in each for each in wrong)
    loads = arrays.loads.copy()
    loads[dragging, :2] *= -1.0
    wrong = check.problems(arrays._replace(loads=loads), without.utilisation, prepared.wrench)
    assert any("cannot pull" in each for each in wrong)


def test_a_check_that_takes_over_what_stays_is_the_same(recoveries):
    """Residuals of noisy numbers are those of a check that is prepared from the hands alone."""
    noise = np.random.default_rng(0)
    for name, recovery in recoveries.items():
        prepared = recovery.prepared
        whole = Check(prepared.question, prepared.batch, prepared.where)
        for count in (1, 3):
            lost = [recovery.tiles[t] for t in noise.choice(len(recovery.tiles), count, False)]
            found = recovery.plan(lost)
            after, arrays = found.found.prepared, found.verified.arrays
            bare = HandBatch.of(after.batch.hands)
            arrays = arrays._replace(loads=arrays.loads + noise.normal(size=arrays.loads.shape))
            # each of the two works its limits out
            SETTLED_LIMITS.clear()
            checks = [Check(after.question, after.batch, after.where, lost, whole)]
            SETTLED_LIMITS.clear()
            checks.append(Check(after.question, bare, after.where, lost))
            joints = checks[0].joints([], arrays.wrenches, after.wrench)
            (taken, _, used), (own, _, alone) = (c.recompute([], arrays, joints) for c in checks)
            assert used == pytest.approx(alone, abs=1e-9), name
            assert np.abs(checks[0].carry - checks[1].carry).max() == 0.0
            for each, other in zip(taken, own, strict=True):
                assert each.values == pytest.approx(other.values, abs=1e-9), (name, each.text)
    with pytest.raises(ValueError, match="another stance"):
        Check(after.question, after.batch, after.where, lost, other_check(recoveries))


def other_check(recoveries):
    """Return the check of a stance of other hands."""
    prepared = recoveries["slab"].prepared
    return Check(prepared.question, prepared.batch, prepared.where)


def test_the_hand_to_save_first_is_where_strength_helps_most(recoveries):
    """One percent more strength of all tiles of that hand lowers the overload most."""
    recovery = recoveries["wall-300"]
    limb = "front_left"
    lost = [LostTile(limb, f, p) for f in ("inner_left", "inner_right") for p in ("middle",)]
    lost += [LostTile(limb, "outer_left", "middle")]
    found = recovery.plan(lost)
    assert not found.holds
    data = found.found.prepared.hands.data
    gains = []
    for h in range(len(data.hands)):
        hands = list(data.hands)
        stronger = hands[h]
        hands[h] = stronger._replace(L=stronger.L / 1.01, l0=stronger.l0 / 1.01)
        value = Best(type(data).of(tuple(hands), data.wrench)).solve().value
        gains.append(found.found.answer.solution.least.value - value)
    assert found.save_first == recovery.prepared.limbs[int(np.argmax(gains))]


def test_what_cannot_slip_is_refused_by_name(recoveries):
    recovery = recoveries["wall-300"]
    for tile in (
        LostTile("front", "inner_left", "middle"),
        LostTile("front_left", "inner_left", "base"),
    ):
        with pytest.raises(InvalidInputError) as refused:
            recovery.plan([recovery.tiles[0], tile])
        assert refused.value.field == "lost[1]"
    with pytest.raises(UnsupportedError) as refused:
        Recovery(prepare_stance(question(read_request("wall-300-floating"))))
    assert refused.value.field.endswith("wrist")


def test_a_tile_lost_twice_counts_once(recoveries):
    recovery = recoveries["wall-300"]
    tile = recovery.tiles[5]
    twice, once = recovery.plan([tile, tile]), recovery.plan([tile])
    assert twice.lost == once.lost
    assert twice.utilisation == pytest.approx(once.utilisation, rel=1e-12)


@pytest.mark.parametrize("name", ["wall-300", "boulders"])
def test_a_plan_does_not_depend_on_where_its_search_starts(recoveries, name):
    """From plans without one tile each, superposed; and from nothing."""
    known, cold = recoveries[name], Recovery(recoveries[name].prepared)
    losses = [lost for lost in some(known, 7, 12) if len(lost) > 1]
    for tile in {tile for lost in losses for tile in lost}:
        known.plan([tile])
    known.plan(())
    for lost in losses:
        one, two = known.plan(lost), cold.plan(lost)
        assert one.utilisation == pytest.approx(two.utilisation, abs=1e-5)
        tensions = [each.verified.arrays.tensions for each in (one, two)]
        assert tensions[0] == pytest.approx(tensions[1], abs=0.05)


def test_hands_and_starts_of_other_palms_change_no_plan(recoveries):
    """A palm that has slipped, as in a simulation, with and without the whole stance's recovery."""
    whole = recoveries["wall-300"].prepared
    hands = list(whole.batch.hands)
    hands[1] = replace(hands[1], palm=hands[1].palm._replace(shear_limit=1.0))
    weak = whole.with_hands(hands)
    first = Recovery(whole, many=True)
    both = Recovery(weak, many=True, like=first), Recovery(weak)
    for lost in some(first, 9, 5):
        first.plan(lost)
        one, two = (recovery.plan(lost) for recovery in both)
        assert one.verified is not None
        assert one.utilisation == pytest.approx(two.utilisation, abs=1e-6)
        tensions = [each.verified.arrays.tensions for each in (one, two)]
        assert tensions[0] == pytest.approx(tensions[1], abs=0.05)


def test_plans_without_a_finger_are_starts_for_those_without_it_and_more(recoveries):
    recovery = Recovery(recoveries["wall-300"].prepared)
    recovery.plan(())
    recovery.look_ahead()
    tile = LostTile("rear_left", "inner_left", "distal")
    gone = [("front_left", "outer_left")]
    for lost in ([tile], [tile, LostTile("front_left", "outer_left", "middle")]):
        recovery.plan([tile])
        before = WAITING_SOLVERS.info()
        found = recovery.plan(lost, released=gone)
        assert WAITING_SOLVERS.info() == before
        cold = Recovery(recovery.prepared).plan(lost, released=gone)
        assert found.utilisation == pytest.approx(cold.utilisation, abs=1e-5)
        assert found.released == cold.released == tuple(gone)


@pytest.mark.parametrize("name", NAMES)
def test_a_hand_joined_from_fingers_is_that_worked_out_as_one(recoveries, name):
    """With each tile of a finger, two of it, or the whole finger gone, beside another's."""
    recovery, rng = recoveries[name], np.random.default_rng(8)
    prepared = recovery.prepared
    for h, hand in enumerate(prepared.batch.hands):
        on = np.flatnonzero(hand.touching)
        for count in (2, 3, 5):
            tiles = tuple(sorted(rng.choice(on, count, replace=False).tolist()))
            released = (int(rng.integers(len(FINGERS))),)
            ((key, found),) = recovery._hands.find([(h, tiles, released, True)]).items()
            settled = slipped_hand(hand, tiles, released)
            (space,) = wrench_spaces([settled], prepared.question.limits.tendon_tension)
            space = prepared.hands.added[h].on(space)
            assert len(
                {*hand.finger_of[list(tiles)], *released}
            ) == 1 or recovery._hands._by_finger(key)
            for field in ("origin", "generators", "L", "l0", "s", "H", "h"):
                mine, own = getattr(found.space, field), getattr(space, field)
                assert mine == pytest.approx(own, rel=1e-12, abs=1e-12), (h, tiles, released, field)
            assert found.settled.tiles == settled.tiles
            assert found.settled.loads == pytest.approx(settled.loads, abs=1e-12)
            assert found.settled.engagement == pytest.approx(settled.engagement, abs=1e-12)
            torques = [np.array([t for *_, t in each.stops]) for each in (found.settled, settled)]
            assert torques[0] == pytest.approx(torques[1], abs=1e-12)


def test_several_losses_mostly_take_no_solver(recoveries, monkeypatch):
    """Their plans begin at those without one tile each."""
    recovery = recoveries["wall-300"]
    recovery.plan(())
    for tile in recovery.tiles:
        recovery.plan([tile])
    solved, unique = [], programs.unique
    monkeypatch.setattr(programs, "unique", lambda *each: solved.append(each) or unique(*each))
    for lost in some(recovery, 5, 60):
        assert recovery.plan(lost).verified is not None
    assert len(solved) <= 5


@pytest.mark.parametrize("name", ["wall", "slab"])
def test_plans_for_very_many_losses_are_the_same(recoveries, name):
    """Losses far beyond the cap, where fingers are released on trial: no plan, worse or better."""
    recovery = recoveries[name]
    many, chance = Recovery(recovery.prepared, many=True), np.random.default_rng(4)
    tiles, released = recovery.tiles, 0
    for count in (1, 6, 10, 14, 18, 18):
        lost = [tiles[i] for i in chance.choice(len(tiles), count, replace=False)]
        plain, found = recovery.plan(lost), many.plan(lost)
        assert found.released == plain.released
        assert found.utilisation == pytest.approx(plain.utilisation, rel=1e-6)
        released += len(plain.released)
        assert (found.verified is None) == (plain.verified is None)
        if plain.verified is not None:
            loads = plain.verified.arrays.loads
            near = 1e-4 * float(np.abs(loads).max())
            np.testing.assert_allclose(found.verified.arrays.loads, loads, atol=near)
    assert released > 0


@pytest.mark.parametrize("name", ["wall-300", "slab", "boulders"])
def test_fingers_that_cannot_be_spared_make_plans_worse(recoveries, name):
    """Beside plans without these fingers, and in loads that hands can hardly bear."""
    recovery, chance = recoveries[name], np.random.default_rng(8)
    proven = harder = 0
    for _ in range(12):
        wrench = recovery.prepared.wrench * chance.uniform(0.8, 1.5)
        lost = [recovery.tiles[i] for i in chance.choice(len(recovery.tiles), 2, replace=False)]
        found = recovery.plan(lost, wrench)
        fingers = {(tile.limb, tile.finger) for tile in lost} - {*found.released}
        without = recovery.plan(lost, wrench, released=fingers)
        harder += without.utilisation > found.utilisation * 1.001
        if cannot_spare(recovery.prepared, found.found, fingers):
            proven += 1
            assert without.utilisation > found.utilisation
    assert harder / 2 < proven <= harder
