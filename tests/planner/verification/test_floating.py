"""Plans of hands whose wrists give, with one number made wrong."""

from dataclasses import replace

import numpy as np
import pytest

from planner.solving import KnownStance, plan
from planner.solving.verified import prepare_checks
from planner.verification import Check
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.stances import complying, random_question


@pytest.fixture(scope="module")
def known():
    """The check, the plan's numbers, and what else the check is told."""
    stance = KnownStance(complying(questions.question(read_request("wall-300"))))
    answer = stance.answer(stance.prepared.wrench, 0.0).answer
    check = prepare_checks(stance.prepared).check
    return check, answer.arrays, (answer.whole, stance.prepared.wrench)


def problems(known, **changed):
    check, arrays, rest = known
    return check.problems(arrays._replace(**changed), *rest)


def off(values, entry, part=1e-3):
    """The values, one of which is larger by a part of itself."""
    changed = values.copy()
    changed[entry] *= 1.0 + part
    return changed


def of_first_wrist(arrays, **changed):
    wrist, *others = arrays.wrists
    return (replace(wrist, **changed), *others)


def test_the_plan_itself_passes(known):
    assert problems(known) == []


def test_a_contact_that_goes_from_a_fillet_to_a_face_has_no_slip_of_a_circle():
    """Two tiles of a hand on an edge do; by a circle they would slip 0.2 μm less, and hold 1 mN."""
    found = plan(complying(random_question(55)))
    assert found.verified, found.reason


def test_a_tension_or_a_load_that_is_off_is_refused(known):
    arrays = known[1]
    for finger in range(len(arrays.tensions)):
        assert problems(known, tensions=off(arrays.tensions, finger))
    for entry in np.argwhere(np.abs(arrays.loads) > 1.0):
        assert problems(known, loads=off(arrays.loads, tuple(entry))), entry


def test_a_place_that_is_off_is_refused(known):
    arrays = known[1]
    for tile in known[0].known.places.phalanges.ravel():
        found = problems(known, points=off(arrays.points, (tile, 2)))
        assert any("contact is" in text for text in found), tile


def test_a_wrist_that_is_elsewhere_is_refused(known):
    arrays = known[1]
    twist = arrays.wrists[0].twist
    for axis in range(6):
        step = 1e-3 * np.abs(twist[3 * (axis // 3) :][:3]).max() * np.eye(6)[axis]
        found = problems(known, wrists=of_first_wrist(arrays, twist=twist + step))
        assert any("does not hold" in text or "contact is" in text for text in found)
    found = problems(known, wrists=of_first_wrist(arrays, twist=off(twist, 1, np.nan)))
    assert any("contact is nan" in text for text in found)


def test_stretches_that_are_off_or_missing_are_refused(known):
    arrays = known[1]
    stretches = arrays.wrists[0].stretches
    held = int(np.argmax(np.abs(stretches)))
    for given, word in (
        (off(stretches, held), "are not stretched"),
        (stretches[:5], "does not say"),
        (None, "does not say"),
    ):
        found = problems(known, wrists=of_first_wrist(arrays, stretches=given))
        assert any(word in text for text in found)


def test_a_motor_that_would_stand_still_holds_other_loads(known):
    check, arrays, rest = known
    first, *others = check.question.stance.hands
    still = (replace(first, wrist="floating", tendon_preload=arrays.tensions[:4]), *others)
    asked = replace(check.question, stance=replace(check.question.stance, hands=still))
    wrists = of_first_wrist(arrays, driven=False)
    found = Check(asked, check.known, None).problems(arrays._replace(wrists=wrists), *rest)
    assert any("does not hold" in text or "carries" in text for text in found)


def test_a_wrist_of_another_kind_is_refused(known):
    found = problems(known, wrists=of_first_wrist(known[1], driven=False))
    assert any("the wrist is not compliant" in text for text in found)
