"""Answer requests for climbs: a rock as a wall of placements and bodies, search, reply."""

from __future__ import annotations

import io
import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from msgspec import UNSET, UnsetType
from numpy.typing import NDArray

from hand_models import rock, scans
from hand_models.base import Array, InvalidInputError, Pose, errors_under
from hand_models.parameters import ParameterTable, own_hand
from planner import HandOnHold, deadline
from service import requests
from service.answering.holds import hold_of, surface_of
from service.answering.own_models import BUNDLED_ROBOTS, Robots, builder_of
from service.answering.questions import KnotParts, route_request, stage_replies
from service.answering.stances import poses_of
from service.replies import ClimbReply, KnotReply, PartReply, SearchProgress

if TYPE_CHECKING:
    from planner import ClimbProgress, Ends, FoundClimb, MadeWall, WallProgress, WallSource

__all__ = ["SoughtClimb", "answer_climb", "climb_reply", "seek_climb"]

Report = Callable[[PartReply], None]


class SoughtClimb(NamedTuple):
    """Outcome of the search for a climb.

    Attributes
    ----------
    found : FoundClimb
        The climb, and the bound of every other.
    made : MadeWall
        The wall of placements and bodies that was searched.
    rock : Mesh
        The rock, in its own frame.
    rock_pose : Pose
        The rock's frame in W.
    start, goal : Ends
        Where the climb begins and ends.
    """

    found: FoundClimb
    made: MadeWall
    rock: rock.Mesh
    rock_pose: Pose
    start: Ends
    goal: Ends


def seek_climb(
    request: requests.ClimbRequest,
    robots: Robots = BUNDLED_ROBOTS,
    report: Report | None = None,
    make: Callable[[WallSource, WallProgress], MadeWall] | None = None,
) -> SoughtClimb:
    """Search for the climb of a request.

    Parameters
    ----------
    request : ClimbRequest
        Rock, start and goal, and how good the climb has to be.
    robots : Robots, optional
        Robots that a request may name; bundled robots by default.
    report : callable, optional
        Takes how far the search is, some five times a second at most.
    make : callable, optional
        Makes the wall from its source, on other processes; in this process by default.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    DeadlineError
        If the deadline passes before there is a wall to search.
    """
    from planner import (
        WallSource,
        finer_about,
        refuse_limits,
        weakest_state,
        with_compliant_stages,
    )

    build = builder_of(request.robot, robots)
    with errors_under("hand"):
        own = None if request.hand is None else own_hand(ParameterTable.of(request.hand))
        robot = build(own)
    refuse_limits(robot, request.limits, request.objective)
    mesh, pose = _rock(request.rock, robot.hand.table)
    surface = surface_of(request.surface)
    ends = {"start": request.start, "goal": request.goal}
    stances = {name: _stance(name, end, robot.limbs) for name, end in ends.items() if end.body}
    given = {path: at for _, hands in stances.values() for path, at in hands.items()}
    on_rock = partial(HandOnHold, hold=mesh, surface=surface, hold_pose=pose)
    places = [on_rock(limb=hand.limb, pose=at, grasp=hand.grasp) for at, hand in given.values()]
    source = WallSource(
        rock=mesh,
        rock_pose=pose,
        robot=robot,
        surface=surface,
        places=request.places,
        bodies=request.bodies,
        more_places=places,
        more_bodies=[body for body, _ in stances.values()],
    )
    progress = _Progress(request.id, report)
    part = None if request.time is None else request.time / (request.refine + 1)
    search = partial(_search, request, stances, progress, make, part)
    sought = search(source, request.refine)
    for times in range(1, request.refine + 1):
        if sought.found.status == "found" or deadline.expired():
            break
        state = weakest_state(sought.found, sought.start, sought.goal, part)
        if state is None:
            break
        source = finer_about(source, sought.made.wall, state, times)
        again, best = search(source, request.refine - times), sought.found.least
        # without a climb, that there is none among more placements says more
        if best is None or (again.found.least or 0.0) > best:
            sought = again
    if request.wrist == "fixed":
        return sought
    say = partial(progress.compliant, sought.found)
    return sought._replace(found=with_compliant_stages(sought.found, request.wrist_travel, say))


def _search(
    request: requests.ClimbRequest,
    stances: Mapping[str, tuple[Pose, Mapping[str, object]]],
    progress: _Progress,
    make: Callable[[WallSource, WallProgress], MadeWall] | None,
    part: float | None,
    source: WallSource,
    later: int,
) -> SoughtClimb:
    """Make the wall of a source, and search it for the climb of a request.

    Parameters
    ----------
    stances : mapping of str to tuple
        Ends of the climb that are stances: body, and hands by path in the request.
    part : float or None
        Time that the search may take [s].
    later : int
        Number of searches that may come after this one, in the time that is left.
    """
    from planner import Ends, find_climb, wall_of

    bodies, ends = source.poses(), {"start": request.start, "goal": request.goal}
    origins = np.array([body.position for body in bodies.poses])
    its_body = dict(zip(stances, bodies.given[: len(stances)], strict=True))
    at = {
        name: np.arange(len(origins)) == its_body[name]
        if name in its_body
        else _bodies_near(name, end, origins)
        for name, end in ends.items()
    }
    try:
        if make is None:
            made = wall_of(source, bodies, report=progress.wall)
        else:
            made = make(source, progress.wall)
    except InvalidInputError as error:
        raise _named(error, [path for _, hands in stances.values() for path in hands]) from None
    limbs = len(source.robot.limbs)
    members = {name: made.given[k * limbs : (k + 1) * limbs] for k, name in enumerate(stances)}
    start, goal = (Ends(bodies=at[name], members=members.get(name)) for name in ends)
    left = deadline.left()
    # the rest is for changes that would raise the load factor, for compliant wrists, and the reply
    share = 0.95 if request.wrist == "fixed" else 0.6
    with deadline.within(None if left is None else share * left / (later + 1)):
        found = find_climb(
            made.wall,
            start,
            goal,
            name=request.name,
            limits=request.limits,
            objective=request.objective,
            within=request.best_within,
            at_least=request.at_least,
            seconds=part,
            progress=progress.search,
        )
    return SoughtClimb(found, made, source.rock, source.rock_pose, start, goal)


def climb_reply(
    request: requests.ClimbRequest, sought: SoughtClimb, report: Report | None = None
) -> ClimbReply:
    """Convert what came of a search into the reply.

    Parameters
    ----------
    request : ClimbRequest
    sought : SoughtClimb
        What came of its search.
    report : callable, optional
        Takes the knots, if they are wanted and the request asks for parts; the reply then has none.
    """
    found, wall = sought.found, sought.made.wall
    knots: list[KnotReply] | UnsetType = UNSET
    if "trajectory" in request.want and found.climb is not None:
        if report is not None and request.parts:
            send = KnotParts(request.id, report)
            every = found.climb.knots
            for i, knot in enumerate(every, start=1):
                if i == len(every) or every[i].move != knot.move:
                    send(every[:i])
        else:
            knots = [KnotReply.of(knot) for knot in found.climb.knots]
    return ClimbReply(
        id=request.id,
        name=request.name,
        robot=wall.robot.name,
        status=found.status,
        least=found.least,
        bound=_finite(found.bound),
        gap=None if found.gap is None else _finite(found.gap),
        deciding=found.deciding,
        raises=list(found.raises),
        refused=list(found.refused),
        about=found.about,
        route=None if found.route is None else route_request(request, found.route),
        stages=[] if found.result is None else stage_replies(found.result),
        least_compliant=None if found.compliant is None else found.compliant.load_factor,
        stages_compliant=None if found.compliant is None else stage_replies(found.compliant),
        knots=None if found.climb is None else len(found.climb.knots),
        placements=len(wall.places),
        bodies=len(wall.bodies),
        programs=found.found.programs,
        seconds={**sought.made.seconds, **found.seconds},
        trajectory=knots,
        certificate=_certificate(sought) if "certificate" in request.want else UNSET,
    )


def answer_climb(
    request: requests.ClimbRequest,
    robots: Robots = BUNDLED_ROBOTS,
    report: Report | None = None,
) -> ClimbReply:
    """Search for the climb of a request in this process, and return the reply.

    Parameters
    ----------
    request : ClimbRequest
        Rock, start and goal, and how good the climb has to be.
    robots : Robots, optional
        Robots that a request may name; bundled robots by default.
    report : callable, optional
        Takes the parts of the answer that come before the reply, if the request asks for parts.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    """
    parts = report if request.parts else None
    with deadline.within(request.deadline):
        return climb_reply(request, seek_climb(request, robots, parts), parts)


def _rock(message: requests.MeshMessage | str, numbers: ParameterTable) -> tuple[rock.Mesh, Pose]:
    """Return the rock of a request, and its frame in W."""
    if isinstance(message, str):
        name, _, seed = message.partition(":")
        made = scans.generate_wall(name, int(seed or 0))
        return rock.Mesh(made.vertices, made.faces, numbers, anywhere=True), made.pose
    with errors_under("rock"):
        if message.pose_in_hand is not None:
            raise InvalidInputError(
                "a climb has many hands; give the rock's pose in W", field="pose_in_hand"
            )
        found = hold_of(message, numbers, anywhere=True)
        assert isinstance(found, rock.Mesh)
        return found, poses_of({"pose": message.pose}).get("pose", Pose.identity())


def _stance(
    path: str, end: requests.ClimbEnd, limbs: Sequence[str]
) -> tuple[Pose, dict[str, tuple[Pose, requests.EndHand]]]:
    """Return the body of an end that is a stance, and hands by path in the order of the limbs."""
    named = [hand.limb for hand in end.hands]
    if sorted(named) != sorted(limbs):
        raise InvalidInputError(
            f"must have one hand of each of {', '.join(limbs)}, got {', '.join(named)}",
            field=f"{path}.hands",
        )
    paths = [f"{path}.hands[{i}]" for i in range(len(named))]
    given = {f"{at}.pose": hand.pose for at, hand in zip(paths, end.hands, strict=True)}
    poses = poses_of({f"{path}.body": end.body, **given})
    order = sorted(range(len(named)), key=lambda i: limbs.index(named[i]))
    hands = {paths[i]: (poses[f"{paths[i]}.pose"], end.hands[i]) for i in order}
    return poses[f"{path}.body"], hands


def _named(error: InvalidInputError, paths: Sequence[str]) -> InvalidInputError:
    """Return an error of making the wall, with the path of the hand that is to blame, if any."""
    at = re.fullmatch(r"more_places\[(\d+)\](.*)", error.field or "")
    if at is not None:
        error.field = paths[int(at[1])] + at[2]
    return error


def _bodies_near(name: str, end: requests.ClimbEnd, origins: Array) -> NDArray[np.bool_]:
    """Return which poses of the body, by their origins, are at an end of the climb."""
    heights = origins[:, 2]
    if end.near is not None:
        away = np.linalg.norm(origins - end.near, axis=1)
        there = away <= end.radius
        if not there.any():
            raise InvalidInputError(
                f"no pose of the body is within {end.radius:g} m; the nearest is {away.min():.2f} "
                "m away: give another point, a larger radius, or a finer grid (bodies.spacing)",
                field=f"{name}.near",
            )
        return np.asarray(there)
    assert end.height is not None
    # the other height is rounded so that it is accepted
    there, words = heights >= end.height, "at least so high; the highest is"
    other = math.floor(100.0 * heights.max()) / 100.0
    if name == "start":
        there, words = heights <= end.height, "at most so high; the lowest is"
        other = math.ceil(100.0 * heights.min()) / 100.0
    if not there.any():
        raise InvalidInputError(
            f"no pose of the body is {words} {other:.2f} m high, got {end.height:g} m",
            field=f"{name}.height",
        )
    return np.asarray(there)


def _certificate(sought: SoughtClimb) -> bytes | UnsetType:
    """Return the file that proves the bound; unset where nothing is proven."""
    from planner import climb_certificate

    if sought.found.found.proof is None:
        return UNSET
    file = io.BytesIO()
    climb_certificate(sought.made.wall, sought.start, sought.goal, sought.found.found).write(file)
    return file.getvalue()


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


class _Progress:
    """Reports of how far a search is, some five a second at most.

    Parameters
    ----------
    identifier : str or None
        ``id`` of the request.
    report : callable, optional
        Takes each.
    """

    def __init__(self, identifier: str | None, report: Report | None) -> None:
        self._identifier, self._report = identifier, report
        self._begun = time.perf_counter()
        self._last: SearchProgress | None = None

    def wall(self, phase: str, done: int, total: int) -> None:
        """Report how far the wall is made."""
        self._tell(phase, None, None, done, total)

    def search(self, now: ClimbProgress) -> None:
        """Report how far the search of the wall is."""
        self._tell(now.phase, now.best, now.bound, now.done, now.total)

    def compliant(self, found: FoundClimb, done: int, total: int) -> None:
        """Report how many stages are planned with compliant wrists."""
        self._tell("compliant", found.least, _finite(found.bound), done, total)

    def _tell(
        self, phase: str, best: float | None, bound: float | None, done: int, total: int
    ) -> None:
        seconds, last = time.perf_counter() - self._begun, self._last
        # [s] fewer, unless there is something new
        soon = -math.inf if last is None or (last.phase, last.best) != (phase, best) else 0.2
        if self._report is None or (last is not None and seconds - last.seconds < soon):
            return
        gap = bound / best - 1.0 if best and bound is not None else None
        self._last = SearchProgress(
            phase=phase, best=best, bound=bound, gap=gap, done=done, total=total, seconds=seconds
        )
        self._report(PartReply(id=self._identifier, progress=self._last))
