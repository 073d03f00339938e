"""Walls made on workers: the same to the last digit, whatever becomes of workers and of the run."""

import multiprocessing
import os
import signal
from dataclasses import replace

import pytest

from hand_models.base import InvalidInputError
from hand_models.tile import Surface
from planner.walls import BodyGrid, PlaceGrid, WallSource, wall_digest
from service.processes import make_wall
from tests.suite.helpers.climbing_walls import asked_once, tiny_source, tiny_wall
from tests.suite.helpers.processes import PATIENCE


class StopError(Exception):
    """A run that is broken off."""


class Unable(WallSource):
    """A source whose chunks nobody can answer."""

    def answer(self, question, bodies):
        raise AssertionError


class Kept(WallSource):
    """A source of which hands at points are closed once for all walls of these tests."""

    def answer(self, question, bodies):
        (answer,) = asked_once(as_a(WallSource, self), bodies)([question])
        return answer


class Deadly(WallSource):
    """A source of which the chunk with a point at this x kills each worker."""

    def answer(self, question, bodies):
        if multiprocessing.parent_process() is not None and b"\xcb\xbf\xd1\xeb" in question[:20]:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().answer(question, bodies)


def as_a(kind, source):
    return kind(**{name: getattr(source, name) for name in source.__dataclass_fields__})


def test_chunks_in_a_file_are_not_worked_out_again(tmp_path):
    source, kept, seen = as_a(Kept, tiny_source()), tmp_path / "chunks", []

    def stop(phase, done, total):
        seen.append((phase, done, total))
        if seen[-1][:2] == ("placements", 3):
            raise StopError

    with pytest.raises(StopError):
        make_wall(source, "here", kept=kept, report=stop)
    assert seen == [("placements", i, 4) for i in (1, 2, 3)]
    # cut off in the middle of its last chunk
    size = kept.stat().st_size
    with kept.open("r+b") as file:
        file.truncate(size - 10)
    resumed = make_wall(source, "here", kept=kept)
    assert wall_digest(resumed.wall) == wall_digest(tiny_wall().wall)
    whole = kept.read_bytes()
    assert len(whole) > size
    # nothing is left to be worked out
    again = make_wall(as_a(Unable, source), "here", kept=kept)
    assert wall_digest(again.wall) == wall_digest(tiny_wall().wall)
    assert again.refused == tiny_wall().refused
    assert kept.read_bytes() == whole


@pytest.mark.slow
def test_other_bodies_leave_placements_as_they_are(tmp_path):
    kept, other = (
        tmp_path / "chunks",
        replace(tiny_source(), bodies=BodyGrid(margin=0.5, stand_offs=(0.4,))),
    )
    alone = make_wall(other, "here")
    make_wall(tiny_source(), "here", kept=kept)
    seen = len(kept.read_bytes())
    made = make_wall(other, "here", kept=kept)
    assert wall_digest(made.wall) == wall_digest(alone.wall) != wall_digest(tiny_wall().wall)
    # reach was added, and no hand was closed again
    again = make_wall(as_a(Unable, other), "here", kept=kept)
    assert wall_digest(again.wall) == wall_digest(alone.wall)
    assert 0 < len(kept.read_bytes()) - seen < seen


def test_chunks_of_another_wall_are_refused(tmp_path):
    source, kept = tiny_source(), tmp_path / "chunks"
    kept.write_bytes(b"crux finished chunks 1 " + b"0" * 64 + b"\n")
    with pytest.raises(InvalidInputError, match="kept: was begun with another rock, hand"):
        make_wall(source, "here", kept=kept)
    kept.write_text("a letter")
    with pytest.raises(InvalidInputError, match="kept: is not a file of finished chunks"):
        make_wall(source, "here", kept=kept)
    assert kept.read_text() == "a letter"


def test_what_changes_answers_changes_the_digest():
    source = tiny_source()
    assert tiny_source().digest == source.digest
    others = [
        replace(source, gravity=0.5 * source.gravity),
        replace(source, places=PlaceGrid(kept=2)),
        replace(source, rock_pose=source.rock_pose @ source.rock_pose),
        replace(source, surface=Surface.named("sandpaper-36")),
    ]
    assert len({source.digest, *(each.digest for each in others)}) == 5


@pytest.mark.slow
def test_processes_make_the_same_wall_though_one_is_killed():
    killed = []

    def kill_one(phase, done, total):
        if not killed:
            process = multiprocessing.active_children()[0]
            os.kill(process.pid, signal.SIGKILL)
            process.join(PATIENCE)
            killed.append(process)

    made = make_wall(tiny_source(), "processes", workers=2, report=kill_one)
    assert killed
    assert wall_digest(made.wall) == wall_digest(tiny_wall().wall)
    assert (made.lost_trials, made.lost_places) == (0, 0)


@pytest.mark.slow
def test_a_chunk_that_kills_its_workers_is_lost_alone():
    made = make_wall(as_a(Deadly, tiny_source()), "processes", workers=2)
    assert made.lost_trials == 12
    assert made.tried == 28
    assert made.lost_places == 0
    kept = {tuple(place.pose.position) for place in made.wall.places}
    assert kept < {tuple(place.pose.position) for place in tiny_wall().wall.places}


@pytest.mark.slow
def test_a_cluster_makes_the_same_wall():
    pytest.importorskip("distributed")
    made = make_wall(tiny_source(), "dask:local", workers=2)
    assert wall_digest(made.wall) == wall_digest(tiny_wall().wall)
