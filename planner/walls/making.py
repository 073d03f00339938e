"""Make a wall of a rock: questions and answers of its chunks, and the wall made of all answers.

A chunk's answer depends on its question and the wall's source alone, whatever process gives it.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from hashlib import sha256
from itertools import product
from typing import Any, Protocol

import msgspec
import numpy as np

from hand_models.base import (
    BASE_TOLERANCES,
    Array,
    InvalidInputError,
    Pose,
    UnsupportedError,
    errors_under,
    go_on,
)
from hand_models.fixed_wrist import REFUSAL_WORDS, HoldTrial, input_digests, wrench_space
from hand_models.hand import Grasp
from hand_models.rock import Mesh
from hand_models.tile import Surface
from planner import deadline
from planner.motion import Rock
from planner.prepare import settle_each
from planner.question import EARTH_GRAVITY, HandOnHold
from planner.reach import ReachTable, reach_table
from planner.robots import Robot
from planner.screening import HandParts
from planner.search import Wall
from planner.walls.answers import place_arrays, places_of, read, written
from planner.walls.assembly import assemble_wall
from planner.walls.bodies import BodyPoses, body_poses, equal_poses
from planner.walls.files import robot_digest
from planner.walls.grids import BodyGrid, PlaceGrid
from planner.walls.places import HandPlace, best_places, hand_at, place_trials

__all__ = ["Ask", "MadeWall", "WallProgress", "WallSource", "wall_of"]

Ask = Callable[[Sequence[bytes]], Iterable[bytes | None]]
"""Answers encoded questions of chunks in their order (`WallSource.answer`); None for a lost one."""


class WallProgress(Protocol):
    """Is called with the phase, ``placements`` or ``reach``, and how much of it is done."""

    def __call__(self, phase: str, done: int, total: int, /) -> None: ...


class Chunk(msgspec.Struct, omit_defaults=True):
    """A question of a chunk: hands to try at points, or placements to reach.

    Attributes
    ----------
    points : list of list of HoldTrial
        Hands to try at each of some points.
    poses : list of list of float
        Rows of (3, 4) arrays: axes and origins in W of hand frames to reach [1, m].
    bodies : str
        Digest of the poses of the body from which they are to be reached.
    given : bool
        Whether these are the poses of the body that were given, not those of the grid.
    """

    points: list[list[HoldTrial]] = []
    poses: list[list[float]] = []
    bodies: str = ""
    given: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class WallSource:
    """Source of a wall: all that it is made from; it can be pickled.

    All limbs of a robot have the same hand, so any limb may take any placement.

    Attributes
    ----------
    rock : Mesh
    rock_pose : Pose
        The rock's frame in the world frame W.
    robot : Robot
    surface : Surface
        The rock's, the preset ``rock`` by default.
    places : PlaceGrid
    bodies : BodyGrid
    gravity : ndarray, shape (3,)
        Acceleration of gravity, in W [m/s²].
    more_places : sequence of HandOnHold
        Further placements, such as those of a given stance. Those that the grid has, too, count
        once; the others are put at the end.
    more_points : sequence of (float, float)
        Further points at which hands are tried, along x and y of the rock's frame [m].
    more_bodies : sequence of Pose
        Further poses of B in W; likewise. The body may be shifted from them to those of the grid
        that are nearer than one and a half of its spacings, and turned by `BodyGrid.turn` at most.
    together : int
        Points at which hands are closed together, and placements that are reached together, in one
        chunk.
    """

    rock: Mesh
    rock_pose: Pose
    robot: Robot
    surface: Surface = field(default_factory=lambda: Surface.named("rock"))
    places: PlaceGrid = field(default_factory=PlaceGrid)
    bodies: BodyGrid = field(default_factory=BodyGrid)
    gravity: Array = field(default_factory=lambda: np.array(EARTH_GRAVITY))
    more_places: Sequence[HandOnHold] = ()
    more_points: Sequence[tuple[float, float]] = ()
    more_bodies: Sequence[Pose] = ()
    together: int = 12

    @property
    def digest(self) -> str:
        """Digest of all that the answers of chunks depend on, besides the questions.

        What is known of placements stays so where only the bodies change.
        """
        inputs = input_digests(self.rock, self.surface, self.robot.hand.table.sections)
        arrays = [self.rock_pose.position, self.rock_pose.rotation, np.asarray(self.gravity)]
        every = inputs, [each.tolist() for each in arrays], self.places.kept
        return sha256(f"{every}{robot_digest(self.robot)}".encode()).hexdigest()

    def poses(self) -> BodyPoses:
        """Return the poses of the body: of the grid, then those that are given.

        Raises
        ------
        InvalidInputError
            If no pose of the grid is clear of the rock.
        """
        with errors_under("bodies"):
            found = body_poses(self.bodies, self.rock, self.rock_pose, self.robot)
        near = 1.5 * self.bodies.spacing
        return found.with_more(self.more_bodies, near, self.bodies.turn)

    def answer(self, question: bytes, bodies: BodyPoses) -> bytes:
        """Answer a chunk's question.

        Parameters
        ----------
        question : bytes
            As `wall_of` asks it.
        bodies : BodyPoses
            Of `poses`.
        """
        chunk = msgspec.msgpack.decode(question, type=Chunk)
        if chunk.points:
            up = -self.rock_pose.rotation.T @ self.gravity
            hand, kept = self.robot.hand, self.places.kept
            found = best_places(hand, self.rock, self.surface, chunk.points, up, kept)
            return written(place_arrays(*found))
        poses = [Pose(row[:, 3], row[:, :3]) for row in np.reshape(chunk.poses, (-1, 3, 4))]
        rock = Rock("the rock", self.rock, self.rock_pose, frozenset(self.robot.limbs))
        grid, given = _parts(bodies)
        own = given if chunk.given else grid
        return written(vars(reach_table(self.robot, poses, own, rock=rock)))


@dataclass(frozen=True, eq=False, kw_only=True)
class MadeWall:
    """A wall, and what came of making it.

    Attributes
    ----------
    wall : Wall
    tried : int
        Number of hands that were tried on the rock.
    refused : dict of str to int
        Number of those that were not kept, by reason (`best_places`), the most frequent first.
    lost_trials, lost_places : int
        Number of hands that were not tried, and of placements whose reach is unknown and counts as
        none, as workers died of them.
    in_rock : int
        Number of poses of the body that were left out as the body would touch the rock.
    given : tuple of int
        Indices of the placements that the source was given.
    seconds : dict of str to float
        Duration of each phase: ``placements``, ``reach`` and ``tables`` [s].
    """

    wall: Wall
    tried: int
    refused: dict[str, int]
    lost_trials: int
    lost_places: int
    in_rock: int
    given: tuple[int, ...]
    seconds: dict[str, float]


def wall_of(
    source: WallSource,
    bodies: BodyPoses,
    ask: Ask | None = None,
    report: WallProgress | None = None,
) -> MadeWall:
    """Make a wall from its source.

    Parameters
    ----------
    source : WallSource
    bodies : BodyPoses
        Its `WallSource.poses`.
    ask : callable, optional
        Answers questions of chunks with `WallSource.answer`, somewhere else; in this process by
        default.
    report : callable, optional
        Called with the phase, ``placements`` or ``reach``, the number of finished chunks, and that
        of all.

    Raises
    ------
    InvalidInputError
        If no hand holds anything on the rock, or a given placement is impossible.
    DeadlineError
        If the deadline passes first.
    """
    started = time.perf_counter()
    asked = ask or (lambda every: (source.answer(each, bodies) for each in every))
    with errors_under("places"):
        points = place_trials(source.places, source.rock, source.robot.hand, source.more_points)
    cut = range(0, len(points), source.together)
    chunks = [points[i : i + source.together] for i in cut]
    questions = [msgspec.msgpack.encode(Chunk(points=chunk)) for chunk in chunks]
    found, refused, lost_trials = list[HandPlace](), Counter[str](), 0
    for chunk, answer in zip(chunks, _asked("placements", questions, asked, report), strict=True):
        if answer is None:
            lost_trials += sum(map(len, chunk))
            continue
        places, others = places_of(answer)
        found += places
        refused += others
    limb, rock = source.robot.limbs[0], (source.rock, source.rock_pose, source.surface)
    hands = [hand_at(place, *rock, limb) for place in found]
    parts, given = [place.parts for place in found], list[int]()
    for hand, its_parts in _given_places(source):
        same = equal_poses([each.pose for each in hands], hand.pose)
        there = [
            i for i in np.flatnonzero(same).tolist() if _closed_alike(hands[i].grasp, hand.grasp)
        ]
        given.append(there[0] if there else len(hands))
        if not there:
            hands.append(hand)
            parts.append(its_parts)
    if not hands:
        tried = sum(map(len, points))
        counts = {REFUSAL_WORDS[kind]: count for kind, count in refused.most_common()}
        if lost_trials:
            counts["not tried, as processes died of them"] = lost_trials
        reasons = "; ".join(f"{count} of {tried} hands: {words}" for words, count in counts.items())
        raise InvalidInputError(
            f"no hand holds anything on this rock ({reasons}); try a smaller spacing",
            field="places.spacing",
        )
    placed = time.perf_counter()
    reach, lost_places = _reach(source, [hand.pose for hand in hands], bodies, asked, report)
    reached = time.perf_counter()
    apart, gravity = source.places.apart, source.gravity
    wall = assemble_wall(source.robot, hands, parts, bodies, reach, apart=apart, gravity=gravity)
    return MadeWall(
        wall=wall,
        tried=sum(map(len, points)) - lost_trials,
        refused=dict(refused.most_common()),
        lost_trials=lost_trials,
        lost_places=lost_places,
        in_rock=bodies.in_rock,
        given=tuple(given),
        seconds={
            "placements": placed - started,
            "reach": reached - placed,
            "tables": time.perf_counter() - reached,
        },
    )


def _reach(
    source: WallSource,
    poses: Sequence[Pose],
    bodies: BodyPoses,
    ask: Ask,
    report: WallProgress | None,
) -> tuple[ReachTable, int]:
    """Return what limbs reach, and the number of placements that are not known to be reached.

    The bodies of the grid are asked about apart from those that are given: what is known of them
    stays so whatever these are.
    """
    rows, lost = _rows(poses), set[int]()
    groups = [rows[i : i + source.together] for i in range(0, len(rows), source.together)]
    parts = [each for each in _parts(bodies) if each]
    digests = [sha256(repr(_rows(part)).encode()).hexdigest() for part in parts]
    asked = list(product(range(len(parts)), range(len(groups))))
    chunks = [Chunk(poses=groups[g], bodies=digests[i], given=i > 0) for i, g in asked]
    questions = [msgspec.msgpack.encode(chunk) for chunk in chunks]
    tables = [list[ReachTable]() for _ in parts]
    for (i, g), answer in zip(asked, _asked("reach", questions, ask, report), strict=True):
        if answer is None:
            lost.add(g)
            tables[i].append(_unknown(len(groups[g]), len(parts[i]), source.robot))
        else:
            tables[i].append(ReachTable(**answer))
    whole = reduce(ReachTable.beside, map(ReachTable.joined, tables))
    return whole, sum(len(groups[g]) for g in lost)


def _parts(bodies: BodyPoses) -> tuple[Sequence[Pose], Sequence[Pose]]:
    """Return the poses of the grid, and those that are given."""
    return bodies.poses[: bodies.on_grid], bodies.poses[bodies.on_grid :]


def _asked(
    phase: str, questions: Sequence[bytes], ask: Ask, report: WallProgress | None
) -> Iterator[dict[str, Any] | None]:
    """Yield the answers as arrays by name, and report the progress."""
    for i, answer in enumerate(ask(questions)):
        go_on()
        deadline.check("the wall was made")
        if report is not None:
            report(phase, i + 1, len(questions))
        yield None if answer is None else read(answer)


def _rows(poses: Sequence[Pose]) -> list[list[float]]:
    return [np.column_stack([each.rotation, each.position]).ravel().tolist() for each in poses]


def _closed_alike(one: Grasp, other: Grasp) -> bool:
    """Return whether two grasps are the same, up to rounding."""
    turn = other.outer_rotation
    near = abs(one.outer_rotation - turn) <= BASE_TOLERANCES.angle
    return near and msgspec.structs.replace(one, outer_rotation=turn) == other


def _given_places(source: WallSource) -> Iterator[tuple[HandOnHold, HandParts]]:
    """Yield given placements, closed, and their sets."""
    outcomes = settle_each(source.robot.hand, source.more_places)
    for i, (hand, outcome) in enumerate(zip(source.more_places, outcomes, strict=True)):
        if hand.wrist != "fixed":
            raise UnsupportedError(
                f"must have a fixed wrist, got {hand.wrist!r}", field=f"more_places[{i}].wrist"
            )
        if isinstance(outcome, InvalidInputError):
            raise outcome.within(f"more_places[{i}]")
        if not (outcome.holding.any() or outcome.palm.layers):
            raise InvalidInputError(
                "no tile is on the rock here; give the pose in W of a hand on this rock",
                field=f"more_places[{i}].pose",
            )
        at = outcome.seating.pose
        closed = replace(
            hand, hold_pose=None, hold_in_hand=at, at=None, seat="rest", seat_direction=None
        )
        yield closed, HandParts.of(wrench_space(outcome))


def _unknown(places: int, bodies: int, robot: Robot) -> ReachTable:
    """Return a table in which no limb is known to reach anything, and none is known not to."""
    shape = places, bodies, len(robot.limbs)
    none = [np.zeros((0, len(robot.chains[limb].joints))) for limb in robot.limbs]
    return ReachTable.of(np.zeros(shape, dtype=np.intp), np.ones(shape, dtype=bool), none)
