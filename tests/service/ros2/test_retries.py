"""The way back of a hand that slipped while it took its hold."""

from __future__ import annotations

import pytest

from service.replies import ClimbSetPoints, HandKnotReply, KnotReply, PlacedFrame
from service.ros2.retries import retry

PHASES = ("start", "shift", "unload", "open", "swing", "swing", "close", "close", "load", "shift")
PLACE = PlacedFrame([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
TIMES = (0.0, 1.0, 1.5, 3.0, 4.0, 7.0, 7.5, 8.25, 9.0, 11.0)


def knot(index: int) -> KnotReply:
    hand = HandKnotReply(
        limb="front_left",
        pose=PLACE,
        on_rock=True,
        tensions=[float(index)] * 4,
        winch_angles=[0.0] * 4,
        wrench=[0.0] * 6,
        wrench_in_world=[0.0] * 6,
    )
    return KnotReply(
        index=index,
        move=min(index, 1) + (index == 9),
        phase=PHASES[index],
        limb=None if index == 0 else "front_left",
        stage=None,
        time=TIMES[index],
        body=PLACE,
        joints={"front_left": [float(index)]},
        joint_torque={},
        hands=[hand],
        utilisation=0.5,
        bound=None,
        limiting=None,
        verified=True,
    )


KNOTS = [knot(i) for i in range(10)]


def at(index: int, share: float = 0.5) -> ClimbSetPoints:
    """Set-points on the way to a knot."""
    value = index - 1 + share
    return ClimbSetPoints(
        number=7,
        time=TIMES[index - 1] + share * (TIMES[index] - TIMES[index - 1]),
        knot=index,
        move=KNOTS[index].move,
        phase=PHASES[index],
        limb=KNOTS[index].limb,
        body=PLACE,
        joints={"front_left": [value]},
        tensions={"front_left": [value] * 4},
    )


@pytest.mark.parametrize("index", [6, 7, 8])
def test_a_hand_goes_back_until_it_is_off_its_hold_and_forward_to_the_end(index: int) -> None:
    found = retry(KNOTS, at(index), {"front_left"})
    assert found is not None
    back = list(range(index - 1, 4, -1))
    assert [each.index for each in found.knots] == [index, *back, *range(6, 10)]
    # it begins where the robot is, at no step of anything
    assert found.knots[0].joints == {"front_left": [index - 0.5]}
    assert found.knots[0].hands[0].tensions == [index - 0.5] * 4
    assert found.knots[0].time == at(index).time
    times = [each.time for each in found.knots]
    assert times == sorted(times)
    # no part is faster than forward
    for before, after in zip(found.knots, found.knots[1:], strict=False):
        span = abs(TIMES[after.index] - TIMES[before.index])
        assert after.time - before.time >= span - 1e-9
    (turn,) = [each for each in found.knots if each.index == 5]
    assert found.turn == turn.time


@pytest.mark.parametrize(
    ("index", "limbs"),
    [
        (3, {"front_left"}),  # the hand leaves its hold
        (5, {"front_left"}),  # it is in the air
        (9, {"front_left"}),  # it carries
        (7, {"rear_left"}),
        (7, {"front_left", "rear_left"}),
    ],
)
def test_other_slips_have_no_way_back(index: int, limbs: set[str]) -> None:
    assert retry(KNOTS, at(index), limbs) is None
