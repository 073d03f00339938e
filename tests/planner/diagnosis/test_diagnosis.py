"""Which tile has slipped: signatures worked by hand, and a thousand simulated slips."""

import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import weibull_min

from hand_models.base import InvalidInputError, UnsupportedError
from hand_models.fixed_wrist import slipped_hand
from hand_models.hand import FINGERS
from hand_models.parameters import bundled_table
from planner.diagnosis import SlipDiagnosis
from planner.prepare import prepare_stance
from planner.solving import plan
from service.answering import question
from service.commands.stances import read_request
from tests.suite.helpers.fingernails import hung, one_hand
from tests.suite.helpers.stances import ask, complying, on_wall

NOISE = 0.02
"""Of a measured tension, over the tension."""


@cache
def diagnosed(name: str):
    """Prepared stance, plan and diagnosis of a bundled stance."""
    asked = question(read_request(name))
    prepared, answer = prepare_stance(asked), plan(asked)
    return prepared, answer, SlipDiagnosis(prepared, answer.hands)


def tensions_of(answer) -> dict[str, np.ndarray]:
    return {hand.limb: hand.tensions.copy() for hand in answer.hands}


def test_the_fall_of_the_tension_is_that_of_springs_in_parallel():
    """c_p² Σ δt / (k + K) + c_p (c_p δt − δT) / K = 0 of a tendon that slides, T = μ N after."""
    prepared, answer, diagnosis = diagnosed("wall-300")
    before, checked = tensions_of(answer), 0
    for each in diagnosis.signatures:
        hand = prepared.batch.hands[each.hand]
        table = hand.hand.table
        c, K = (table.scalar("tile", name) for name in ("pulley_ratio", "spring_stiffness"))
        contact = dict(
            zip(
                ("proximal", "middle", "distal"),
                table.vector("tile", "contact_stiffness"),
                strict=True,
            )
        )
        names = [tile[:2] for tile in hand.tiles]
        slipped = names.index((each.tile.finger, each.tile.phalanx))
        own = np.flatnonzero(hand.finger_of == each.finger)
        if not (hand.engagement[own] == 1.0).all():
            continue
        checked += 1
        f = before[each.tile.limb][each.finger]
        after = slipped_hand(hand, [slipped])
        fall = each.tensions[0] - f
        drags = after.tiles[slipped].contact == "slipped"
        shear = max(after.loads[slipped, 0] @ (1.0, each.tensions[0]), 0.0) * drags
        lost = shear - hand.loads[slipped, 0] @ (1.0, f)
        others = [
            contact.get(hand.tiles[t].phalanx, contact["proximal"]) for t in own if t != slipped
        ]
        given = sum(c**2 * fall / (k + K) for k in others) + c * (c * fall - lost) / K
        assert given == pytest.approx(0.0, abs=1e-7)
        kept = max(after.loads[slipped, 0] @ (1.0, f), 0.0) * drags
        turn = c * (hand.loads[slipped, 0] @ (1.0, f) - kept) / K / hand.hand.drive.winch_radius
        assert each.turns[0] == pytest.approx(turn, rel=1e-6, abs=1e-9)
    assert checked >= 24


def test_a_tendon_that_sticks_hides_slips_far_from_the_motor():
    _, answer, diagnosis = diagnosed("wall-300")
    before = tensions_of(answer)
    for each in diagnosis.signatures:
        slides, sticks = (f - before[each.tile.limb][each.finger] for f in each.tensions)
        if each.tile.phalanx == "distal" and each.use > 0.4:
            assert slides < -2.0
            assert sticks == pytest.approx(0.0, abs=1e-6)
        elif each.tile.phalanx == "base":  # the motor's own strand: no friction on the way
            assert sticks <= slides + 1e-6


def first_to_slip(diagnosis: SlipDiagnosis, rng: np.random.Generator) -> int:
    """Draw strengths of all tiles, and return the one that would slip first as the load grows."""
    uses = np.array([each.use for each in diagnosis.signatures])
    strengths = weibull_min(3.0).rvs(len(uses), random_state=rng)
    return int(np.argmax(uses / strengths))


SIDEWAYS = [pytest.param(name, marks=pytest.mark.slow) for name in ("wall", "wall-300-joints")]
"""Stances of which many tiles are loaded sideways most: their tendons hardly notice a slip."""


@pytest.mark.parametrize("name", ["wall-300", "overhang", "slab", "boulders", *SIDEWAYS])
@pytest.mark.parametrize("held", [True, False], ids=["held", "kept"])
@pytest.mark.parametrize("slips", [150, pytest.param(1000, marks=pytest.mark.slow)])
def test_slips_are_named(name, held, slips):
    _, answer, diagnosis = diagnosed(name)
    rng, named, first, told, sizes = np.random.default_rng(1), 0, 0, 0, []
    limbs = [hand.limb for hand in answer.hands]
    give = np.zeros((len(limbs), len(FINGERS)))
    for each in diagnosis.signatures:
        give[each.hand, each.finger] = each.turn_per_newton
    rest = np.array([hand.tensions for hand in answer.hands])
    for _ in range(slips):
        slipped = diagnosis.signatures[first_to_slip(diagnosis, rng)]
        error = NOISE * rng.normal(size=rest.shape)
        if held:
            true = rest.copy()
            true[slipped.hand, slipped.finger] = slipped.tensions[0]
            data = {"tensions": dict(zip(limbs, true * (1.0 + error), strict=True))}
        else:
            turns = give * rest * error
            turns[slipped.hand, slipped.finger] += slipped.turns[0]
            data = {"turns": dict(zip(limbs, turns, strict=True))}
        found = diagnosis.diagnose(**data)
        named += slipped.tile in found.suspects
        first += found.tiles[0].tile == slipped.tile
        sizes.append(len(found.suspects))
        told += found.seen and found.reason is not None
    assert told <= 0.01 * slips
    assert named >= 0.9 * slips
    # of the slab's ball, tiles of few spines slip first, whose loads hardly show
    least, most = {"slab": (0.45, 24), "wall": (0.45, 24), "wall-300-joints": (0.3, 40)}.get(
        name, (0.65, 4)
    )
    assert first >= least * slips
    assert np.median(sizes) <= most


def test_without_noise_the_tile_or_its_double_comes_first():
    _, answer, diagnosis = diagnosed("wall-300")
    doubles = {frozenset(pair) for pair in diagnosis.ambiguous(held=True)}
    strong = [each for each in diagnosis.signatures if each.use > 0.3]
    assert len(strong) > 20
    for each in strong:
        data = tensions_of(answer)
        data[each.tile.limb][each.finger] = each.tensions[0]
        first = diagnosis.diagnose(tensions=data).tiles[0].tile
        assert first == each.tile or frozenset((first, each.tile)) in doubles
    distal = [each for each in strong if each.tile.phalanx == "distal" and each.use > 0.9]
    for each in distal:
        data = tensions_of(answer)
        data[each.tile.limb][each.finger] = each.tensions[0]
        found = diagnosis.diagnose(tensions=data)
        assert found.seen
        assert found.reason is None
        assert found.tiles[0].tile == each.tile
        assert found.tiles[0].probability > 0.8
        assert found.tiles[0].expected == pytest.approx(
            each.tensions[0] - answer.hands[each.hand].tensions[each.finger]
        )


def test_a_slip_that_is_not_seen_has_a_reason():
    _, answer, diagnosis = diagnosed("wall-300")
    numbers, before = bundled_table("diagnosis.toml", "planner.parameters"), tensions_of(answer)
    f = before["rear_left"][1]
    part, least = (numbers.positive("noise", name) for name in ("tension", "least_tension"))
    deviation = math.hypot(part * f, least)

    def off(by: float):
        measured = tensions_of(answer)
        measured["rear_left"][1] += by
        return diagnosis.diagnose(tensions=measured)

    found = off(-0.5 * deviation)
    assert not found.seen
    told = f"the tension of rear_left inner_left is off most, by {-0.5 * deviation:+.2g} N, 0.5 of "
    assert found.reason.startswith(told)
    shown = [
        abs(each.tensions[0] - before[each.tile.limb][each.finger])
        / math.hypot(part * each.tensions[0], least)
        for each in diagnosis.signatures
    ]
    small = sum(change < numbers.positive("suspects", "seen") for change in shown)
    assert 0 < small < len(shown)
    assert f"those of {small} of {len(shown)} tiles would show less" in found.reason
    # no slip winds a tendon up
    found = off(8.0 * deviation)
    assert not found.seen
    assert "8 of its standard deviation, which the slip of no tile explains" in found.reason
    assert off(min(each.tensions[0] - f for each in diagnosis.signatures if each.finger == 1)).seen


def test_data_that_one_slip_does_not_explain_have_a_reason():
    _, answer, diagnosis = diagnosed("wall-300")
    limb, finger = "front_left", 1
    own = {
        each.tile.phalanx: each
        for each in diagnosis.signatures
        if (each.tile.limb, each.finger) == (limb, finger)
    }
    # a turn that fits a tile, in rad; the same in degrees
    turn = own["distal"].turns[0]
    turns = {limb: np.array([0.0, turn, 0.0, 0.0])}
    found = diagnosis.diagnose(turns=turns)
    assert found.seen
    assert found.reason is None
    found = diagnosis.diagnose(turns={limb: np.degrees(turns[limb])})
    assert found.seen
    assert found.reason.startswith(f"the turn of {limb} inner_left is ")
    assert "one tile explains: several may have slipped; check data, their units" in found.reason
    # one tile each of two fingers
    data = tensions_of(answer)
    for at in (1, 2):
        data[limb][at] = own["distal"].tensions[0]
    found = diagnosis.diagnose(tensions=data)
    assert found.seen
    assert {tile.phalanx for tile in found.suspects} == {"distal"}
    assert re.match(rf"the tension of {limb} inner_(left|right) is ", found.reason)
    # an error of four standard deviations is none
    data = tensions_of(answer)
    data[limb][1] = own["distal"].tensions[0]
    data["rear_left"][0] *= 1.08
    assert diagnosis.diagnose(tensions=data).reason is None


def test_nothing_is_seen_where_nothing_slipped():
    _, answer, diagnosis = diagnosed("wall-300")
    found = diagnosis.diagnose(tensions=tensions_of(answer))
    assert not found.seen
    assert sum(each.probability for each in found.tiles) == pytest.approx(1.0)
    some = {hand.limb: hand.tensions for hand in answer.hands[:1]}
    only = diagnosis.diagnose(tensions=some)
    assert {each.tile.limb for each in only.tiles} == {answer.hands[0].limb}


def test_currents_say_what_tensions_do():
    prepared, answer, diagnosis = diagnosed("wall-300")
    data = tensions_of(answer)
    data["front_left"][1] -= 9.0
    drive = prepared.batch.hands[0].hand.drive
    currents = {limb: drive.current(own) for limb, own in data.items()}
    one, two = diagnosis.diagnose(tensions=data), diagnosis.diagnose(currents=currents)
    assert one.suspects == two.suspects
    assert [each.probability for each in one.tiles] == pytest.approx(
        [each.probability for each in two.tiles], abs=1e-9
    )


def test_the_order_of_hands_does_not_matter():
    asked = question(read_request("wall-300"))
    stance = replace(asked.stance, hands=asked.stance.hands[::-1])
    turned = replace(asked, stance=stance)
    _, answer, diagnosis = diagnosed("wall-300")
    other = SlipDiagnosis(prepare_stance(turned), plan(turned).hands)
    data = tensions_of(answer)
    data["rear_left"][2] -= 8.0
    one, two = diagnosis.diagnose(tensions=data), other.diagnose(tensions=data)
    assert one.suspects == two.suspects
    assert one.tiles[0].probability == pytest.approx(two.tiles[0].probability, rel=1e-3)


def test_what_cannot_be_diagnosed_is_refused():
    _, answer, diagnosis = diagnosed("wall-300")
    data = tensions_of(answer)
    for given in ({}, {"tensions": data, "turns": data}, {"tensions": {}}):
        with pytest.raises(InvalidInputError, match="one of tensions, currents, turns is needed"):
            diagnosis.diagnose(**given)
    with pytest.raises(InvalidInputError, match="no hand of the stance") as caught:
        diagnosis.diagnose(turns={"tail": np.zeros(4)})
    assert caught.value.field == "turns.tail"
    with pytest.raises(InvalidInputError) as caught:
        diagnosis.diagnose(tensions={"rear_left": np.array([1.0, 2.0, math.nan, 3.0])})
    assert caught.value.field.startswith("tensions.rear_left")
    moving = complying(ask(on_wall()))
    with pytest.raises(UnsupportedError, match="fixed wrists only"):
        SlipDiagnosis(prepare_stance(moving), plan(moving).hands)
    nails = hung(one_hand(), 50.0)
    with pytest.raises(UnsupportedError, match="fingernails"):
        SlipDiagnosis(prepare_stance(nails), plan(nails).hands)
