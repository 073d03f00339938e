"""What is given as text, as the request for a climb."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from hand_models.hand import WristTravel
from planner import BodyGrid, PlaceGrid
from planner.climbs import DecidingStage, RefusedMoves
from service.answering import seek_climb
from service.climbs import Sought, climb_end, naming_options, print_verdict
from service.commands.stances import read_request
from service.requests import ClimbEnd, ClimbRequest
from service.tables import console

TEXTS = {
    "start": "0.1,-0.2,0.3",
    "goal": "height:1.5",
    "radius": 0.4,
    "best_within": "7%",
    "at_least": None,
    "time": 60.0,
    "refine": 2,
    "surface": "rock",
    "spacing": 0.2,
    "body_spacing": None,
    "stand_off": (0.6,),
    "lean": 0.0,
    "wrist": None,
    "wrist_travel": None,
}


class AcceptedError(Exception):
    """The ends of the climb were accepted."""


def sought(**changes):
    return Sought(**TEXTS | changes).asking(read_request)(Path("small-wall:3"))


def test_a_request_has_what_the_options_say():
    request = sought()
    assert request.start.near == (0.1, -0.2, 0.3)
    assert request.start.radius == 0.4
    assert request.goal.height == 1.5
    assert request.best_within == pytest.approx(0.07)
    assert (request.rock, request.time, request.places.spacing) == ("small-wall:3", 60.0, 0.2)
    assert request.refine == 2
    assert request.bodies.stand_offs == (0.6,)
    assert sought(stand_off=()).bodies.stand_offs != (0.6,)


def test_wrists_give_where_that_is_asked_for():
    request = sought(wrist="compliant", wrist_travel=(0.01, 0.002, 0.1))
    assert (request.wrist, request.wrist_travel) == ("compliant", WristTravel(0.01, 0.002, 0.1))
    assert (sought().wrist, sought().wrist_travel) == ("fixed", None)


@pytest.mark.parametrize("travel", [(0.1, 0.0, 0.0), (0.01, float("nan"), 0.0), (0.0, 0.0, -0.1)])
def test_a_travel_that_is_none_is_refused(travel):
    with pytest.raises(InvalidInputError, match="must be") as caught, naming_options():
        sought(wrist="compliant", wrist_travel=travel)
    assert caught.value.field.startswith("--wrist-travel")


def test_what_fixed_wrists_alone_have_is_refused():
    with pytest.raises(InvalidInputError, match="requires wrist 'compliant'") as caught:
        sought(wrist_travel=(0.01, 0.002, 0.1))
    assert caught.value.field == "wrist_travel"
    ends = {"start": ClimbEnd(height=0.0), "goal": ClimbEnd(height=1.0)}
    with pytest.raises(InvalidInputError, match="max_margin or min_effort") as caught:
        ClimbRequest(v=1, rock="x", wrist="compliant", objective="max_robust", **ends)
    assert caught.value.field == "wrist"


def test_an_end_may_be_a_bundled_stance():
    stance = read_request("wall-300").stance
    end = climb_end("wall-300", "--to", 0.3, read_request)
    assert end.body == stance.body
    assert [hand.pose for hand in end.hands] == [hand.pose for hand in stance.hands]


@pytest.mark.parametrize(
    "text", ["nan,0,0", "1,2", "1,2,3,4", "height:inf", "height:", "height:high", "a,b,c"]
)
def test_an_end_that_is_no_place_is_refused(text):
    with pytest.raises(InvalidInputError, match="--from"):
        sought(start=text)


def test_a_stance_that_cannot_be_read_is_named_by_its_option(tmp_path):
    file = tmp_path / "stance.json"
    file.write_text('{"v": 1, "stance": {"body": 3}}')
    for text, said in (("no-stance", "--to: no such file"), (str(file), "--to: stance")):
        with pytest.raises(InvalidInputError, match=said):
            sought(goal=text)


def test_a_radius_without_a_point_is_refused():
    assert sought(radius=None).start.radius == ClimbEnd(near=(0.0, 0.0, 0.0)).radius
    with pytest.raises(InvalidInputError, match="x,y,z") as caught:
        sought(start="height:0.8")
    assert caught.value.field == "--radius"


@pytest.mark.parametrize("text", ["-1%", "nan", "1001%", "five", ""])
def test_a_part_that_is_none_is_refused(text):
    with pytest.raises(InvalidInputError, match="--best-within"):
        sought(best_within=text)


def test_a_mesh_stands_in_the_world_as_it_leans(tmp_path):
    file = tmp_path / "flat.ply"
    file.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n0 1 0\n1 0 0\n3 0 1 2\n"
    )
    request = Sought(**TEXTS | {"lean": 0.5}).asking(read_request)(file)
    assert request.name == "flat"
    x, z = (np.array(axis) for axis in (request.rock.pose.x_axis, request.rock.pose.z_axis))
    # up and away from the climber, who looks along x of W
    np.testing.assert_allclose(x, [np.sin(0.5), 0.0, np.cos(0.5)])
    np.testing.assert_allclose([x @ z, z[2]], [0.0, -np.sin(0.5)], atol=1e-12)
    assert len(request.rock.vertices) == 3


def test_an_end_that_a_refusal_names_is_accepted():
    rock, spacing = "small-wall", 0.4
    given = {"places": PlaceGrid(spacing=spacing), "bodies": BodyGrid(spacing=spacing)}

    def said(start, goal):
        request = ClimbRequest(
            v=1, rock=rock, start=ClimbEnd(height=start), goal=ClimbEnd(height=goal), **given
        )

        def make(source, report):
            raise AcceptedError

        with pytest.raises((InvalidInputError, AcceptedError)) as caught:
            seek_climb(request, make=make)
        return str(caught.value)

    for ends, end in (((0.0, 9.0), 0), ((9.0, 9.0), 1)):
        words = said(*ends).split()
        height = float(words[words.index("high,") - 2])
        ends = [9.0, -9.0]
        ends[end] = height
        assert said(*ends) == ""


def test_a_move_of_no_limb_is_told_without_one(capsys):
    refused = [
        RefusedMoves(limb=limb, phase=phase, reason="too far", count=count)
        for limb, phase, count in ((None, "shift", 1), ("rear_left", "swing", 2))
    ]
    found = SimpleNamespace(
        status="unknown",
        least=None,
        climb=None,
        bound=0.7,
        deciding=None,
        result=None,
        compliant=None,
        raises=(),
        about="",
        refused=refused,
    )
    print_verdict(found, None, {}, console())
    printed = capsys.readouterr().out
    assert "1 move had no plan (shift): too far" in printed
    assert "2 moves had no plan (swing of rear_left): too far" in printed


@pytest.mark.parametrize(
    ("moves", "knots", "move", "said"),
    [
        (0, 1, 0, ("no moves of limbs, 1 knot, 0 s long", "stage 0 decides (start; rear at 3)")),
        (1, 2, 1, ("1 move of a limb, 2 knots, 4 s long", "decides (move 1, start; rear at 3)")),
        (
            2,
            3,
            2,
            ("2 moves of limbs, 3 knots, 8 s long", "start; rear at 3); rear: the palm"),
        ),
    ],
)
def test_none_and_one_read_well(moves, knots, move, said, capsys):
    deciding = DecidingStage(
        stage=0,
        move=move,
        phase="start",
        limb=None,
        load_factor=1.2,
        limiting=None,
        placements={"rear": 3},
        body=0,
    )
    found = SimpleNamespace(
        status="found",
        least=1.2,
        gap=0.0,
        bound=1.2,
        found=SimpleNamespace(least=1.2),
        climb=SimpleNamespace(
            route=SimpleNamespace(moves=[None] * moves),
            knots=[SimpleNamespace(time=4.0 * i) for i in range(knots)],
        ),
        deciding=deciding,
        result=SimpleNamespace(plans=[SimpleNamespace(reason="rear: the palm slips", spread=None)]),
        compliant=None,
        raises=(),
        about="",
        refused=(),
    )
    print_verdict(found, None, {}, console())
    printed = capsys.readouterr().out
    for words in said:
        assert words in printed
