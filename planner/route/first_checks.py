"""Check a route before its climb is planned, and place all rock about the robot."""

from __future__ import annotations

from dataclasses import replace

from msgspec import structs

from hand_models.base import InvalidInputError, UnsupportedError
from planner.motion import CollisionScene, rocks_of
from planner.prepare import settle_each
from planner.route.climb import Route, RouteStage, in_route, stages
from planner.route.evaluation import must_touch
from planner.route.settings import KnotNumbers

__all__ = ["checked_stages", "climb_scene", "refuse"]


def refuse(route: Route) -> None:
    """Refuse what a climb cannot have.

    Raises
    ------
    InvalidInputError
        If tensions may change by so little that there would be too many knots.
    UnsupportedError
        If a wrist is not fixed, a hand's wrench is given, the body accelerates about an axis, palms
        have a margin, or a move gives joint angles of a limb that stays.
    """
    places = [(f"stance.hands[{i}]", hand) for i, hand in enumerate(route.start.hands)]
    places += [(f"moves[{i}]", move.hand) for i, move in enumerate(route.moves)]
    for field, hand in places:
        if hand.wrist != "fixed":
            raise UnsupportedError(
                f"{hand.wrist} is not available in a climb, whose loads are interpolated between "
                "knots; valid is fixed",
                field=f"{field}.wrist",
            )
        if hand.wrench is not None:
            raise UnsupportedError(
                "is not available in a climb, in which every hand is loaded and unloaded; leave it "
                "out",
                field=f"{field}.wrench",
            )
    if any(route.load.angular_acceleration):
        raise UnsupportedError(
            "is not available in a climb, whose loads are those at rest; leave it out",
            field="load.angular_acceleration",
        )
    if route.limits.margins != "required":
        raise UnsupportedError(
            f"{route.limits.margins} is not available in a climb, whose knots must all keep the "
            "same margins; valid is required: leave it out, and give the margins",
            field="limits.margins",
        )
    if route.limits.palm_margin:
        raise UnsupportedError(
            "is not available in a climb, in which the palm of a hand that leaves comes off its "
            "rock; leave it out",
            field="limits.palm_margin",
        )
    for i, move in enumerate(route.moves):
        others = [] if isinstance(move.joints, str) else [*move.joints]
        for limb in others:
            if limb != move.hand.limb:
                raise UnsupportedError(
                    "is not available in a climb: a limb that stays keeps its branch of inverse "
                    f"kinematics; give angles of {move.hand.limb} only",
                    field=f"moves[{i}].joints.{limb}",
                )
    least = KnotNumbers.bundled().least_change
    if route.limits.tension_change is not None and route.limits.tension_change < least:
        raise InvalidInputError(
            f"must be at least {least:g} N in a climb, which would have too many knots, got "
            f"{route.limits.tension_change:g}; a controller interpolates between knots",
            field="limits.tension_change",
        )


def checked_stages(route: Route) -> tuple[RouteStage, ...]:
    """Return the stages of a route.

    Raises
    ------
    InvalidInputError
        If a stance is not valid, or a move ends in the air; the field is relative to the route.
    """
    found = tuple(stages(replace(route, limits=structs.replace(route.limits, tension_change=None))))
    for stage in found:
        if stage.phase == "place":
            try:
                must_touch(stage)
            except InvalidInputError as error:
                raise in_route(error, stage.paths) from None
    return found


def climb_scene(route: Route) -> CollisionScene:
    """Return the robot with all rock of a climb."""
    robot = route.start.robot
    hands = [*route.start.hands, *(move.hand for move in route.moves)]
    settled = settle_each(robot.hand, hands)
    closed = [each for each in settled if not isinstance(each, InvalidInputError)]
    return CollisionScene(robot, rocks_of(zip(hands, closed, strict=True)))
