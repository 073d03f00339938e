"""Any number of questions: order, back-pressure, faults, and the same answers everywhere."""

from __future__ import annotations

import itertools
import json
import pickle
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, strategies as st

from hand_models.base import CruxError, InvalidInputError
from planner.processes import Workers
from service.answering import dispatch
from service.bulk import answer_all, answer_chunk, answered
from service.bulk.chunks import BULK_SETTINGS, About, Setting, about, grouping_order, own_versions
from service.bulk.pools import Here
from service.requests import ClimbEnd, ClimbRequest, MeshMessage, PlanRequest
from service.wire import Format
from tests.suite.helpers import workshop
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.requests import HEAVY, plan_request, wall_request

CASES = [
    wall_request() | {"id": "light"},
    wall_request(HEAVY) | {"id": "heavy"},
    {"v": 1, "id": "no request"},
    wall_request(HEAVY, ("front_left", "rear_right")) | {"id": "two hands"},
    *(random_request(i) for i in (1, 4)),
]


def timeless(payload: bytes) -> dict:
    """A reply without its time."""
    return {key: value for key, value in json.loads(payload).items() if key != "time"}


def encoded(requests: list[dict]) -> list[bytes]:
    return [msgspec.json.encode(request) for request in requests]


def letters(log: Path, count: int) -> Workers:
    """Processes that answer letters, some of which kill them."""
    return Workers(partial(workshop.letters, str(log)), count)


SETTING = pickle.dumps(Setting(versions=own_versions()))


class Shuffled:
    """A pool whose answers come in an order that is given."""

    def __init__(self, width: int, picks: Iterator[int]) -> None:
        self.width, self._picks = width, picks
        self._line: list = []
        self.most = 0

    def put(self, number: int, chunk: list[bytes], about: object = None) -> None:
        self._line.append((number, chunk))

    def collect(self) -> list:
        self.most = max(self.most, len(self._line))
        number, chunk = self._line.pop(next(self._picks) % len(self._line))
        return [(number, answer_chunk(SETTING, chunk))]


def test_a_chunk_is_answered_as_its_questions_are_alone():
    answers = answer_chunk(SETTING, encoded(CASES))
    for answer, request in zip(answers, encoded(CASES), strict=True):
        alone = dispatch.handle("plan", request)
        assert (answer.good, answer.status) == (alone.good, alone.status)
        assert timeless(answer.payload) == timeless(alone.payload)


def test_processes_answer_to_the_last_digit_as_this_one_does():
    asked = encoded(CASES)
    here = [timeless(answer.payload) for answer in answer_all(asked, "here")]
    assert [reply.get("id") for reply in here] == [case["id"] for case in CASES]
    everywhere = list(answer_all(asked, workers=2))
    assert [timeless(answer.payload) for answer in everywhere] == here


def test_requests_may_be_objects_in_either_format():
    wrong = msgspec.structs.replace(plan_request(), id="x", body_wrench=(object(),) * 6)
    for form in Format:
        good, bad = answer_all([plan_request(), wrong], "here", form=form)
        assert form.decode(good.payload, dict)["status"] == "optimal"
        assert form.decode(bad.payload, dict)["id"] == "x"
        assert (bad.good, bad.status) == (False, "malformed")


def test_explanations_are_left_out_or_asked_for_whatever_requests_say():
    asked = [msgspec.json.encode(wall_request(HEAVY) | more) for more in ({}, {"explain": False})]
    for explain, expected in ((None, [True, False]), (True, [True] * 2), (False, [False] * 2)):
        replies = [
            json.loads(answer.payload) for answer in answer_all(asked, "here", explain=explain)
        ]
        assert [reply["certificate"] is not None for reply in replies] == expected
        assert {reply["status"] for reply in replies} == {"overloaded"}


def test_questions_without_end_are_taken_as_answers_are(tmp_path):
    taken = 0

    def endless() -> Iterator[bytes]:
        nonlocal taken
        for taken in itertools.count(1):
            yield b"%d" % taken

    with letters(tmp_path / "log", 2) as pool:
        found = [answer.payload for answer in itertools.islice(answered(endless(), pool), 3000)]
    assert found == [b"%d" % i for i in range(1, 3001)]
    in_window = BULK_SETTINGS.window * BULK_SETTINGS.most_questions
    # those that are out, those that are made at once, and those that wait for one before them
    assert taken - 3000 <= (BULK_SETTINGS.windows_ahead + 1) * 2 * in_window


def test_a_process_that_is_killed_costs_nothing(tmp_path):
    asked = [b"%d" % i + (b"?" if i in (0, 70, 71) else b"") for i in range(150)]
    with letters(tmp_path / "log", 2) as pool:
        found = [answer.payload for answer in answered(asked, pool)]
    assert found == [each.upper() for each in asked]


def test_a_question_that_kills_its_processes_is_found_and_lost_alone(tmp_path):
    asked = [b'{"id":"%d"}' % i for i in range(120)]
    asked[100] += b"!"
    with letters(tmp_path / "log", 2) as pool:
        found = list(answered(asked, pool))
    lost = [i for i, answer in enumerate(found) if not answer.good]
    assert lost == [100]
    assert found[100].status == "lost"
    assert "killed by signal 9" in json.loads(found[100].payload)["error"]["message"]
    assert [answer.payload for i, answer in enumerate(found) if i != 100] == [
        each.upper() for i, each in enumerate(asked) if i != 100
    ]


def test_processes_that_cannot_start_end_the_work():
    told = pytest.raises(CruxError, match="processes do not start")
    with Workers(workshop.nothing, 2) as pool, told:
        list(answered([b"{}"], pool))


def test_no_place_to_work_at_is_told():
    for on in ("nowhere", 3):
        with pytest.raises(InvalidInputError, match=r"distributed|valid are processes"):
            list(answer_all([], on))
    for workers in (0, -1, True):
        with pytest.raises(InvalidInputError, match="at least 1"):
            list(answer_all([], workers=workers))


def test_another_version_is_not_answered():
    for name in ("crux-climb", "numpy", "scipy", "clarabel"):
        setting = pickle.dumps(Setting(versions=own_versions() | {name: "0.0.none"}))
        with pytest.raises(CruxError) as caught:
            answer_chunk(setting, [])
        there, here = caught.value.message.split(", and the client ")
        assert there.endswith(f" {name} {own_versions()[name]}")
        assert here.startswith(f"{name} 0.0.none: ")


@given(st.lists(st.integers(0, 9), max_size=60), st.integers(1, 3))
def test_answers_are_in_order_however_chunks_come_back(picks, width):
    """Requests that are none are told so at once, by their names."""
    asked = [b'{"v":1,"id":"%d"}' % i for i in range(40)]
    pool = Shuffled(width, itertools.cycle(picks or [0]))
    found = list(answered(asked, pool))
    assert [json.loads(answer.payload)["id"] for answer in found] == [str(i) for i in range(40)]
    in_window = BULK_SETTINGS.window * BULK_SETTINGS.most_questions
    assert pool.most <= BULK_SETTINGS.windows_ahead * width * in_window


# Groups -------------------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.sampled_from("ab"), st.sampled_from("xy"))))
def test_groups_stand_together_and_keep_their_order(pairs):
    abouts = [About(rock.encode(), hands.encode()) for rock, hands in pairs]
    order = grouping_order(abouts)
    assert sorted(order) == list(range(len(pairs)))
    for keys in ([abouts[i].rock for i in order], [abouts[i] for i in order]):
        runs = [key for key, _ in itertools.groupby(keys)]
        assert len(runs) == len(set(runs))
    for _, run in itertools.groupby(order, lambda i: abouts[i]):
        same = list(run)
        assert same == sorted(same)


def test_what_a_question_is_about_are_its_rocks_and_its_hands():
    first, load, place, hold = wall_request(), wall_request(60.0), wall_request(), wall_request()
    place["stance"]["hands"][0]["pose"]["position"][0] += 0.01
    hold["stance"]["hands"][0]["hold"]["diameter"] = 0.31
    known, *others = (
        about(msgspec.json.encode(each), Format.JSON) for each in (first, load, place, hold)
    )
    assert others[0] == known
    assert others[1].rock == known.rock
    assert others[1].hands != known.hands
    assert others[2].rock != known.rock
    packed = about(msgspec.msgpack.encode(plan_request()), Format.MSGPACK)
    assert packed.rock
    assert about(b"{", Format.JSON) == about(b'{"v":1}', Format.JSON) == About()


@pytest.mark.slow
def test_what_is_about_the_same_goes_to_the_process_that_knows_it(tmp_path):
    log = tmp_path / "log"
    with letters(log, 2) as pool:
        for i in range(20):
            pool.put(i, [b"%d~" % (i % 2)], i % 2)
        left = 20
        while left:
            left -= len(pool.collect())
    seen: dict[str, set[str]] = {}
    for line in log.read_text().splitlines():
        word, pid = line.split()
        seen.setdefault(word, set()).add(pid)
    # who has nothing left to do helps with the other
    assert min(map(len, seen.values())) == 1


def test_here_one_question_is_answered_at_a_time():
    pool = Here(SETTING)
    taken = []

    def asked() -> Iterator[PlanRequest]:
        for i in range(9):
            taken.append(i)
            yield plan_request(wall_request(50.0 + i))

    with pool:
        answers = answered(asked(), pool)
        next(answers)
    assert len(taken) <= BULK_SETTINGS.windows_ahead * BULK_SETTINGS.window


def test_the_rock_of_a_climb_may_be_a_file(tmp_path):
    """Of a mesh that faces the other way, so that the answer is there at once."""
    text = "OFF\n3 1 0\n0 0 0\n0 1 0\n1 0 0\n3 0 2 1\n"
    (tmp_path / "rock.off").write_text(text)
    ends = {"start": ClimbEnd(height=0.0), "goal": ClimbEnd(height=1.0)}
    asked = [ClimbRequest(v=1, rock=MeshMessage(file="rock.off"), **ends)]

    def field(**options):
        (answer,) = answer_all(asked, "here", kind="climb", **options)
        return json.loads(answer.payload)["error"]["field"]

    assert field(folder=tmp_path) == "bodies.sample"
    assert field().startswith("rock")
