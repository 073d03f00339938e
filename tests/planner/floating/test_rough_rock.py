"""Plans of compliant hands on rock as a scan has it: the ends of the bundled climb."""

from dataclasses import replace

import pytest

from hand_models import rock, scans
from hand_models.tile import Surface
from planner.prepare import posture
from planner.question import HandOnHold, Question, Stance
from planner.robots import robosimian
from planner.solving import plan
from service.answering.stances import poses_of
from service.climbs import demo_request
from tests.suite.helpers.checks import problems


def end_of_climb(name):
    """Return the stance at an end of the bundled climb, with wrists that comply."""
    robot, asked = robosimian(), demo_request()
    end, wall = getattr(asked, name), scans.generate_wall(asked.rock, 0)
    knobs = rock.Mesh(wall.vertices, wall.faces, robot.hand.table, anywhere=True)
    poses = poses_of({"body": end.body, **{hand.limb: hand.pose for hand in end.hands}})
    hands = [
        HandOnHold(
            limb=hand.limb,
            pose=poses[hand.limb],
            hold=knobs,
            surface=Surface.named("rock"),
            hold_pose=wall.pose,
            grasp=hand.grasp,
            wrist="compliant",
        )
        for hand in end.hands
    ]
    return Question(Stance(robot=robot, body=poses["body"], hands=tuple(hands), joints="solve"))


@pytest.mark.slow
@pytest.mark.parametrize("end", ["start", "goal"])
def test_hands_on_rough_rock_have_a_plan(end):
    question = end_of_climb(end)
    found = plan(question)
    # a finger stands straight on the rock at the start, and no search from rest finds a balance
    assert found.status in ("optimal", "overloaded"), found.reason
    assert found.verified
    assert found.utilisation < 2.0
    stance = replace(question.stance, joints=dict(found.joints))
    given = replace(question, stance=stance)
    assert not problems(given, found, where=posture(given))
