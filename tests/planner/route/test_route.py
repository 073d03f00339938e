"""A climb: its stages, its crux, what is written of it, and processes that die under it."""

from __future__ import annotations

import csv
import json
import multiprocessing
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from matplotlib.collections import LineCollection

from hand_models.base import InvalidInputError, Pose
from planner.pictures import summary, write_report
from planner.pictures.report import draw_route
from planner.question import ForceCap, Limits, Load
from planner.robots import UnreachableError
from planner.route import Route, evaluate
from planner.route.climb import stages
from planner.solving import plan
from service.answering import questions
from service.commands.cli import run_command_line
from service.commands.stances import bundled, read_request, read_route
from service.tables import console, print_route
from tests.suite.helpers import workshop

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def route() -> Route:
    return questions.route_of(read_route("six-moves"))


@pytest.fixture(scope="module")
def result(route: Route):
    return evaluate(route)


LIGHT = 100.0
NO_JOINTS = "give stance.joints ('solve' finds them), or load.com"
"""How the warning ends that the joints of a stance are not known."""
"""Mass of a robot that climbs the bundled route [kg]; as heavy as it is, its crux is too hard."""


def test_the_bundled_route_has_six_moves_with_a_limb_in_the_air_in_each(route):
    assert len(route.moves) == 6
    lifts = [stage for stage in stages(route) if stage.phase == "lift"]
    assert [stage.move for stage in lifts] == [1, 2, 3, 4, 5, 6]
    for stage in lifts:
        limbs = [hand.limb for hand in stage.question.stance.hands]
        assert len(limbs) == 3
        assert stage.limb not in limbs


def test_a_placed_hand_stays_where_it_was_put(route):
    todo = list(stages(route))
    for number, move in enumerate(route.moves, start=1):
        (placed,) = [s for s in todo if s.move == number and s.phase == "place"]
        assert move.hand in placed.question.stance.hands
    last = {hand.limb: hand for hand in todo[-1].question.stance.hands}
    for move in route.moves:
        latest = [m.hand for m in route.moves if m.hand.limb == move.hand.limb][-1]
        assert last[move.hand.limb] is latest


def test_the_body_shifts_before_the_limb_lifts_and_stays_there(route):
    for stage in stages(route):
        shifts = [m.body for m in route.moves[: stage.move] if m.body is not None]
        expected = shifts[-1] if shifts else route.start.body
        assert stage.question.stance.body is expected
    phases = [s.phase for s in stages(route) if s.move == 2]
    assert phases == ["shift", "lift", "place"]


def test_each_stage_is_planned_as_its_stance_alone_would_be(result):
    for stage, answer in list(zip(result.stages, result.plans, strict=True))[::5]:
        alone = plan(stage.question)
        assert answer.status == alone.status
        assert answer.utilisation == pytest.approx(alone.utilisation, rel=1e-6)
        assert answer.load_factor == pytest.approx(alone.load_factor, rel=1e-6)


def test_the_crux_is_the_stage_with_the_least_margin_and_no_plan_is_worse_than_any(route, result):
    used = [p.utilisation for p in result.plans]
    assert result.crux == int(np.argmax(used))
    heavy = evaluate(replace(route, load=Load(mass=400.0, com=(0.0, 0.0, 0.4))))
    statuses = [p.status for p in heavy.plans]
    worst = heavy.plans[heavy.crux]
    if "infeasible" in statuses:
        assert worst.status == "infeasible"
    else:
        assert worst.utilisation == max(p.utilisation for p in heavy.plans)
    assert not heavy.feasible


def test_a_cap_on_the_utilisation_can_make_the_crux_too_hard(route):
    light = replace(route, load=Load(mass=LIGHT))
    free = evaluate(light)
    cap = 0.9 * free.plans[free.crux].utilisation
    capped = evaluate(replace(light, limits=Limits(utilisation=cap)))
    assert free.feasible
    assert not capped.feasible
    assert capped.plans[capped.crux].status == "overloaded"


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.parametrize("cap", [1.0, 0.3])
def test_margin_is_the_cap_minus_the_utilisation(route, tmp_path: Path, cap):
    light = replace(route, load=Load(mass=LIGHT), limits=Limits(utilisation=cap))
    found = evaluate(light)
    with write_report(found, tmp_path)["table"].open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for row, answer in zip(rows, found.plans, strict=True):
        assert float(row["margin"]) == pytest.approx(cap - answer.utilisation)
        assert (float(row["margin"]) >= -1e-6) == (answer.status == "optimal")
        assert row["load_factor_status"] == answer.load_factor_status == "found"


def test_the_table_tells_every_stage_and_the_summary_its_crux(result, tmp_path: Path):
    folder = tmp_path / "new" / "folder"
    folder.mkdir(parents=True)
    for name in ("climb.png", "support.png"):
        (folder / name).write_text("of an earlier climb")
    files = write_report(result, folder)
    assert sorted(path.name for path in folder.iterdir()) == [
        "margin.png",
        "stages.csv",
        "summary.json",
    ]
    with files["table"].open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [*rows[0], "sentence"] == list(summary(result)["crux"])
    assert len(rows) == len(result.plans)
    for row, answer in zip(rows, result.plans, strict=True):
        assert float(row["utilisation"]) == pytest.approx(answer.utilisation)
        assert float(row["margin"]) == pytest.approx(1.0 - answer.utilisation)
        assert float(row["load_factor"]) == pytest.approx(answer.load_factor)
        assert row["limiting_limb"] == answer.limiting.limb
    told = json.loads(files["summary"].read_text(encoding="utf-8"))
    assert told == json.loads(json.dumps(summary(result)))
    assert told["crux"]["stage"] == result.crux
    assert "with rear right in the air" in told["crux"]["sentence"]
    assert files["picture"].read_bytes().startswith(PNG)


def test_the_spread_of_a_route_is_in_its_table_and_its_picture(route, result, tmp_path: Path):
    short = replace(route, moves=route.moves[:1], want=frozenset(["spread"]))
    spread = evaluate(short)
    plans = list(spread.plans)
    low, high = (
        np.array([getattr(each.spread.load_factor, end) for each in plans])
        for end in ("low", "high")
    )
    assert (high - low).max() > 0.05
    table = write_report(spread, tmp_path)["table"].read_text(encoding="utf-8")
    rows = csv.DictReader(table.splitlines())
    for row, answer in zip(rows, plans, strict=True):
        told = answer.spread
        want = (*ends_of(told.utilisation), *ends_of(told.load_factor), told.draws, told.holds)
        got = [float(row[name]) for name in (*ENDS, "draws", "holds")]
        assert got == pytest.approx(want)
    for i, name in enumerate(("utilisation", "load_factor")):
        want = [ends_of(getattr(each.spread, name)) for each in plans]
        assert bars(draw_route(spread).axes[i]) == pytest.approx(np.array(want))
    legend = draw_route(spread).axes[0].get_legend()
    draws = plans[0].spread.draws
    assert f"5 to 95 % of {draws} draws" in [text.get_text() for text in legend.get_texts()]
    # of a stage that has none nothing is drawn, nor of a route that was not asked
    gap = replace(spread, plans=(plans[0], replace(plans[1], spread=None), *plans[2:]))
    assert len(bars(draw_route(gap).axes[1])) == len(plans) - 1
    assert "draws" not in summary(result)["crux"]
    assert not any(axes.collections for axes in draw_route(result).axes)


ONE_DRAW = """
[[draws]]
surfaces.rock.shear_limit = { value = 90, unit = "N", source = "measured" }
"""
ENDS = ("utilisation_low", "utilisation_high", "load_factor_low", "load_factor_high")


def ends_of(quantiles):
    return quantiles.low, quantiles.high


def bars(axes):
    """Ends of the upright lines of a spread, shape (n, 2), where there are any."""
    (lines,) = (each for each in axes.collections if isinstance(each, LineCollection))
    found = np.array([path.vertices[:, 1] for path in lines.get_paths()])
    return found[np.isfinite(found).all(axis=1)]


@pytest.mark.usefixtures("blank_pictures")
def test_the_command_asks_for_the_spread_of_every_stance(tmp_path: Path, capfd):
    draws = tmp_path / "draws.toml"
    path = tmp_path / "route.json"
    request = msgspec.json.decode(msgspec.json.encode(read_route("six-moves")))
    path.write_bytes(msgspec.json.encode(request | {"moves": []}))
    run_command_line(["route", str(path), "-o", str(tmp_path / "a"), "--spread", "--json"])
    assert json.loads(capfd.readouterr().out)["crux"]["draws"] > 1
    draws.write_text(ONE_DRAW, encoding="utf-8")
    run_command_line(
        ["route", str(path), "-o", str(tmp_path / "b"), "--draws", str(draws), "--json"]
    )
    assert json.loads(capfd.readouterr().out)["crux"]["draws"] == 1
    run_command_line(["route", str(path), "-o", str(tmp_path / "c"), "--json"])
    assert "draws" not in json.loads(capfd.readouterr().out)["crux"]
    path.write_bytes(msgspec.json.encode(request | {"moves": [], "want": ["advice"]}))
    assert run_command_line(["route", str(path), "-o", str(tmp_path / "d")]) == 2
    assert "want" in capfd.readouterr().err


def test_processes_give_what_one_process_gives_and_tell_their_progress(route, result):
    seen: list[tuple[int, int]] = []
    short = replace(route, moves=route.moves[:3])
    spread = evaluate(short, workers=2, progress=lambda done, total: seen.append((done, total)))
    count = len(spread.plans)
    alone = result.plans[:count]
    assert [p.status for p in spread.plans] == [p.status for p in alone]
    np.testing.assert_allclose(
        [p.utilisation for p in spread.plans], [p.utilisation for p in alone], rtol=1e-6
    )
    assert seen == [(i, count) for i in range(1, count + 1)]


def test_a_killed_process_costs_no_stage(route, result):
    killed = []

    def kill_one(done: int, total: int) -> None:
        if not killed:
            child = multiprocessing.active_children()[0]
            child.kill()
            killed.append(child.pid)

    survived = evaluate(replace(route, moves=route.moves[:3]), workers=2, progress=kill_one)
    assert killed
    alone = result.plans[: len(survived.plans)]
    np.testing.assert_allclose(
        [p.utilisation for p in survived.plans], [p.utilisation for p in alone], rtol=1e-6
    )


def test_where_no_process_starts_all_is_planned_here(route, result, monkeypatch):
    monkeypatch.setattr("planner.route.evaluation._planning", workshop.nothing)
    alone = evaluate(replace(route, moves=route.moves[:1]), workers=2).plans
    assert [p.utilisation for p in alone] == [p.utilisation for p in result.plans[: len(alone)]]


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_hold_inside_the_palm_names_its_move(route, workers: int):
    move = route.moves[2]
    nearer = Pose(np.array([0.0, 0.0, -0.05]), np.eye(3))
    into_palm = replace(move.hand, hold_in_hand=nearer)
    broken = replace(route, moves=(*route.moves[:2], replace(move, hand=into_palm)))
    with pytest.raises(InvalidInputError, match="inside the palm") as caught:
        evaluate(broken, workers=workers)
    assert caught.value.field == "moves[2].hold"


def test_a_limb_that_holds_nothing_cannot_move(route):
    lonely = replace(route.start, hands=route.start.hands[:1])
    with pytest.raises(InvalidInputError) as caught:
        evaluate(replace(route, start=lonely))
    assert caught.value.field == "moves[0].limb"


def test_the_only_hand_cannot_lift(route):
    move = next(m for m in route.moves if m.hand.limb == "front_left")
    hands = tuple(hand for hand in route.start.hands if hand.limb == "front_left")
    lonely = replace(route, start=replace(route.start, hands=hands), moves=(move,))
    with pytest.raises(InvalidInputError, match="only hand"):
        evaluate(lonely)


# The bundled stances ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", bundled())
def test_every_bundled_hand_is_within_its_limbs_reach(name: str):
    stance = questions.question(read_request(name)).stance
    for hand in stance.hands:
        assert stance.robot.stretches(stance.body, [hand.limb], [hand.pose])[0] < 0.95


def test_every_hand_of_the_route_is_within_its_limbs_reach(route):
    for stage in stages(route):
        stance = stage.question.stance
        for hand in stance.hands:
            assert stance.robot.stretches(stance.body, [hand.limb], [hand.pose])[0] < 0.95


@pytest.mark.parametrize(
    ("name", "status"),
    [
        ("wall-300", "optimal"),
        ("wall-300-joints", "optimal"),
        ("wall-700", "overloaded"),
        ("wall", "optimal"),
        ("overhang", "optimal"),
        ("slab", "optimal"),
        ("ledge", "optimal"),
    ],
)
def test_what_the_bundled_stances_come_to(name: str, status: str):
    answer = plan(questions.question(read_request(name)))
    assert answer.status == status
    upper = [h for h in answer.hands if h.limb.startswith("front")]
    lower = [h for h in answer.hands if h.limb.startswith("rear")]
    if name != "slab":
        # the upper hands pull off the rock more than the lower ones
        assert sum(h.wrench[2] for h in upper) < sum(h.wrench[2] for h in lower)
    assert sum(h.wrench[2] for h in upper) < 0.0 or name == "slab"


def laden(mass: float, folder: Path) -> str:
    """A file of the bundled route with that mass [kg]."""
    text = json.loads(read_text("six-moves")) | {"load": {"mass": mass}}
    path = folder / "laden.json"
    path.write_text(json.dumps(text), encoding="utf-8")
    return str(path)


# The command ------------------------------------------------------------------------------------


@pytest.mark.usefixtures("blank_pictures")
def test_route_command_writes_its_files_and_prints_json_alone(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    path, out = laden(LIGHT, tmp_path), tmp_path / "out"
    # every stage holds; a limb cannot follow, but the route has no joints
    assert run_command_line(["route", path, "-o", str(out), "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    assert told["feasible"] is True
    assert told["climb"]["failure"]["move"] == 2
    assert {Path(path).name for path in told["files"].values()} == {
        path.name for path in out.iterdir()
    }


@pytest.mark.usefixtures("blank_pictures")
def test_route_command_tells_a_person_the_crux(tmp_path, capfd: pytest.CaptureFixture[str]):
    assert run_command_line(["route", laden(LIGHT, tmp_path), "-o", str(tmp_path)]) == 0
    out = capfd.readouterr().out
    assert "The crux is move 6" in out
    assert max(len(line) for line in out.splitlines() if str(tmp_path) not in line) <= 80


@pytest.mark.usefixtures("blank_pictures")
def test_route_command_ends_with_3_where_it_does_not_go_and_2_for_bad_input(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    hard = Path(laden(300.0, tmp_path))
    assert run_command_line(["route", str(hard), "-o", str(tmp_path / "out")]) == 3
    text = json.loads(hard.read_bytes())
    text["moves"][1]["hold"]["diameter"] = -1.0
    hard.write_text(json.dumps(text), encoding="utf-8")
    capfd.readouterr()
    assert run_command_line(["route", str(hard), "-o", str(tmp_path / "out")]) == 2
    error = capfd.readouterr().err
    assert error.startswith("crux: moves[1].hold.diameter: ")
    assert len(error.splitlines()) == 1


def read_text(name: str) -> bytes:
    import service

    folder = Path(service.__file__).parent / "examples" / "routes"
    return (folder / f"{name}.json").read_bytes()


def test_a_move_that_ends_in_the_air_is_refused(route):
    move = route.moves[0]
    away = replace(move.hand, hold_in_hand=Pose(np.array([0.0, 0.0, 0.5]), np.eye(3)))
    with pytest.raises(InvalidInputError, match="does not touch this hold") as caught:
        evaluate(replace(route, moves=(replace(move, hand=away),)))
    assert caught.value.field == "moves[0].hold"


def test_what_is_wrong_with_a_stance_on_the_way_is_told_where_the_route_has_it(route):
    first, second = route.start.hands[:2]
    start = replace(route.start, hands=(replace(first, pose=second.pose), *route.start.hands[1:]))
    with pytest.raises(InvalidInputError, match="at the same position") as caught:
        evaluate(replace(route, start=start, moves=()))
    assert caught.value.field == "stance.hands[1].pose.position"
    move = route.moves[0]
    (there,) = (hand for hand in route.start.hands if hand.limb == route.moves[1].hand.limb)
    onto = replace(move, hand=replace(move.hand, pose=there.pose))
    with pytest.raises(InvalidInputError, match="at the same position") as caught:
        evaluate(replace(route, moves=(onto,)))
    told = caught.value.field
    far = replace(move.hand, pose=Pose(np.array([0.0, 450.0, 600.0]), move.hand.pose.rotation))
    with pytest.raises(InvalidInputError, match="from the body") as caught:
        evaluate(replace(route, moves=(replace(move, hand=far),)))
    assert (told, caught.value.field) == 2 * ("moves[0].pose.position",)


# Joints -----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_stage_that_no_joints_reach_is_marked_and_the_climb_goes_on(route, tmp_path: Path):
    there = replace(route, start=replace(route.start, joints="solve"), moves=route.moves[:2])
    climbed = evaluate(there)
    statuses = [answer.status for answer in climbed.plans]
    assert statuses == 3 * ["optimal"] + 3 * ["unreachable"]
    assert not climbed.feasible
    assert climbed.crux == 3
    # the distance that is missing is that of the stance alone
    with pytest.raises(UnreachableError) as caught:
        plan(climbed.stages[3].question)
    assert climbed.plans[3].reason == caught.value.message
    for answer in climbed.plans[:3]:
        used = [
            np.abs(torque / answer.joint_torque_limit[limb]).max()
            for limb, torque in answer.joint_torque.items()
        ]
        assert answer.joint_utilisation == pytest.approx(max(used))
        assert 0.0 < answer.joint_utilisation <= answer.utilisation + 1e-9
    files = write_report(climbed, tmp_path)
    with files["table"].open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for row, answer in zip(rows, climbed.plans, strict=True):
        if answer.status == "optimal":
            assert float(row["joint_utilisation"]) == pytest.approx(answer.joint_utilisation)
        else:
            assert row["joint_utilisation"] == row["utilisation"] == row["load_factor"] == ""
            assert "rear_left is out of reach by " in row["reason"]
    told = summary(climbed)
    assert told["statuses"] == {"optimal": 3, "unreachable": 3}
    assert told["crux"]["sentence"].startswith(
        "The crux is move 2, shifting the body before rear right lifts: no plan; rear_right is out"
    )
    assert files["picture"].read_bytes().startswith(PNG)


def test_a_hands_cap_counts_in_every_stage_where_it_holds_on(route):
    lifted = route.moves[0].hand.limb
    cap = {lifted: ForceCap(200.0)}
    capped = evaluate(replace(route, moves=route.moves[:1], limits=Limits(per_hand=cap)))
    for stage, answer in zip(capped.stages, capped.plans, strict=True):
        forces = {hand.limb: np.linalg.norm(hand.wrench[:3]) for hand in answer.hands}
        if stage.phase == "lift":
            assert lifted not in forces
        else:
            assert forces[lifted] <= 200.0 * max(answer.utilisation, 1.0)
    nose = replace(route, limits=Limits(per_hand={"nose": ForceCap(200.0)}))
    with pytest.raises(InvalidInputError, match="no hand of the start stance") as caught:
        evaluate(nose)
    assert caught.value.field == "limits.per_hand.nose"


def test_the_objective_of_a_route_is_that_of_its_stages(route):
    short = replace(route, moves=route.moves[:1])
    for stage, best, least in zip(
        stages(short),
        evaluate(short).plans,
        evaluate(replace(short, objective="min_effort")).plans,
        strict=True,
    ):
        assert stage.question.objective == "max_margin"
        assert least.utilisation <= 1.0
        assert least.effort < best.effort


@pytest.mark.usefixtures("blank_pictures")
def test_a_route_file_takes_joints_and_an_objective(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    text = json.loads(read_text("six-moves"))
    text["stance"]["joints"] = "solve"
    text["objective"] = "min_effort"
    text["moves"] = text["moves"][:2]
    path = tmp_path / "short.json"
    path.write_text(json.dumps(text), encoding="utf-8")
    assert run_command_line(["route", str(path), "-o", str(tmp_path / "out")]) == 3
    out = capfd.readouterr().out
    assert max(len(line) for line in out.splitlines() if str(tmp_path) not in line) <= 80
    assert "unreachable" in out
    assert "joints" in out
    text["objective"] = "max_margins"
    path.write_text(json.dumps(text), encoding="utf-8")
    assert run_command_line(["route", str(path), "-o", str(tmp_path / "out")]) == 2
    assert capfd.readouterr().err.startswith("crux: objective: 'max_margins' is not")


@pytest.mark.usefixtures("blank_pictures")
def test_what_is_odd_about_a_stage_is_told_once_with_its_moves(route, tmp_path: Path, capsys):
    first = route.moves[0].hand
    high = Pose(np.array([*first.pose.position[:2], 3.0]), first.pose.rotation)
    far = replace(route.moves[0], hand=replace(first, pose=high))
    climbed = evaluate(replace(route, moves=(far, *route.moves[1:2])))
    found = [
        [each for each in answer.findings if each.kind != "palm_without_travel"]
        for answer in climbed.plans
    ]
    odd = [bool(each) for each in found]
    holds = [
        any(hand.limb == first.limb and hand.pose is high for hand in stage.question.stance.hands)
        for stage in climbed.stages
    ]
    # from where it is placed on; the body's shift changes how far that is
    assert odd == holds
    assert any(odd)
    told = summary(climbed)
    reached = [each[0] for each in found if each]
    assert {each.kind for each in reached} == {"out_of_reach"}
    reported = [each for each in told["findings"] if each["kind"] != "palm_without_travel"]
    assert [each["message"] for each in reported] == [each.message for each in reached]
    assert {each["move"] for each in reported} == {1, 2}
    odd_ones = [text for text in told["warnings"] if "out of reach" in text]
    assert len(odd_ones) == len({each.message for each in reached})
    assert odd_ones[0].endswith(reached[0].message)
    assert odd_ones[0].startswith("move")
    files = write_report(climbed, tmp_path)
    with files["table"].open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert ["out of reach" in row["warnings"] for row in rows] == odd
    print_route(climbed, files, console())
    assert capsys.readouterr().out.count("warning:") == len(told["warnings"])


def test_a_sound_route_has_nothing_odd_but_unknown_joints(result):
    (finding,) = summary(result)["findings"]
    assert finding["kind"] == "palm_without_travel"
    no_joints, palms = summary(result)["warnings"]
    assert no_joints.endswith(NO_JOINTS)
    assert palms.endswith(finding["message"])


def test_what_palms_lack_is_said_once_for_a_route_where_it_is_most(result):
    alone = [
        finding
        for stage in result.stages
        for finding in plan(stage.question).findings
        if finding.kind == "palm_without_travel"
    ]
    assert len(alone) > 1
    (said,) = [each for answer in result.plans for each in answer.findings]
    assert said.value == max(each.value for each in alone)
    assert sum(said.message in answer.warnings for answer in result.plans) == 1
    every = [text for answer in result.plans for text in answer.warnings]
    assert sum("a fixed wrist does not move" in text for text in every) == 1
