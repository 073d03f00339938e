"""Sweeps against plans of requests that were varied by hand: rows, table, borders, pictures."""

from __future__ import annotations

import csv
import io
import itertools
import re
from pathlib import Path

import msgspec
import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

import service
from hand_models.base import InvalidInputError
from service.answering import answer_plan
from service.commands.stances import read_request
from service.requests import PlanRequest
from service.sweeping import Design, Held, Sweep, SweepRow, held, plot_sweep
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.requests import compliant_request, wall_request

SHEAR = "hands.front_left.surface.shear_limit"
TENSION = "hands.front_left.grasp.closing_tension"


def asked(request: dict) -> PlanRequest:
    return msgspec.convert(request, PlanRequest)


def planned(mass: float, limbs: dict[str, dict] | None = None) -> service.PlanRequest:
    request = wall_request(mass) | {"want": ["load_factor"], "explain": False}
    for hand in request["stance"]["hands"]:
        hand |= (limbs or {}).get(hand["limb"], {})
    return answer_plan(asked(request))


WALL = asked(wall_request())


def test_rows_are_what_the_varied_requests_come_to_one_by_one() -> None:
    found = service.sweep(
        WALL, ["load.mass=40:160:4", "hands.front_left.surface=rock,concrete-fine"]
    )
    points = tuple(itertools.product((40.0, 80.0, 120.0, 160.0), ("rock", "concrete-fine")))
    assert tuple(row.point for row in found.rows) == points
    for row in found.rows:
        mass, surface = row.point
        reply = planned(mass, {"front_left": {"surface": surface}})
        assert row.status == reply.status
        assert row.utilisation == pytest.approx(reply.utilisation, rel=1e-6)
        assert row.load_factor == pytest.approx(reply.load_factor, rel=1e-6)
        assert row.error is None
    assert {"optimal", "overloaded"} == {row.status for row in found.rows}


def test_a_sweep_leaves_out_displaced_hands() -> None:
    request = compliant_request() | {"want": ["open_loop"], "open_loop": {"samples": 1}}
    (row,) = service.sweep(asked(request), ["load.mass=40"]).rows
    assert row.error is None
    assert row.utilisation > 0.0


def test_a_preset_whose_shear_limit_varies_passes_through_the_preset() -> None:
    found = service.sweep(WALL, ["load.mass=100", "hands.*.surface.shear_limit=68.1,40"])
    assert found.rows[0].utilisation == pytest.approx(planned(100.0).utilisation, rel=1e-6)
    assert found.rows[1].utilisation > found.rows[0].utilisation


def test_the_border_is_between_plans_that_hold_and_do_not() -> None:
    for tolerance in (1e-2, 1e-4):
        (border,) = service.sweep(WALL, ["load.mass=50:150:5"], tolerance=tolerance).borders
        assert 0.0 < border.fails - border.holds <= border.tolerance
        assert border.tolerance == pytest.approx(100.0 * tolerance)
        assert planned(border.holds).status == "optimal"
        assert planned(border.fails).status == "overloaded"
        assert border.words.startswith("holds up to load.mass = ")


def test_a_border_from_below_is_told_as_one() -> None:
    found = service.sweep(asked(wall_request(100.0)), ["hands.*.surface.shear_limit=30:110:5"])
    (border,) = found.borders
    assert border.holds > border.fails
    for limit, status in ((border.holds, "optimal"), (border.fails, "overloaded")):
        hands = wall_request()["stance"]["hands"]
        weak = {hand["limb"]: {"surface": {"shear_limit": limit}} for hand in hands}
        assert planned(100.0, weak).status == status
    assert "holds from hands.*.surface.shear_limit = " in border.words


def test_a_border_of_a_caps_own_is_where_the_utilisation_is() -> None:
    used = planned(100.0).utilisation
    found = service.sweep(asked(wall_request(100.0)), ["limits.utilisation=0.1:1:4"])
    (border,) = found.borders
    assert border.fails < used <= border.holds + 1e-6
    assert [row.cap for row in found.rows] == [0.1, 0.4, 0.7, 1.0]


def test_there_is_no_border_against_points_without_an_answer() -> None:
    found = service.sweep(WALL, [f"{TENSION}=1,30"])
    assert [row.state for row in found.rows] == ["error", "holds"]
    assert found.rows[0].answered
    assert "closing_tension" in found.rows[0].complaint
    assert found.borders == ()


def test_a_whole_number_has_its_border_between_neighbours() -> None:
    found = service.sweep(asked(wall_request(120.0)), ["hands.*.surface.half_planes=1:16:2"])
    (border,) = found.borders
    assert border.holds - border.fails == 1.0
    for count, status in ((border.holds, "optimal"), (border.fails, "overloaded")):
        (row,) = service.sweep(
            asked(wall_request(120.0)), [f"hands.*.surface.half_planes={count:.0f}"]
        ).rows
        assert row.status == status


def row_at(value: float, status: str, used: float | None) -> SweepRow:
    return SweepRow((value,), status, used)


def test_where_points_hold_is_interpolated_between_them() -> None:
    rows = [
        row_at(0.0, "overloaded", 1.5),
        row_at(1.0, "optimal", 0.5),
        row_at(2.0, "optimal", 0.9),
        row_at(3.0, "overloaded", 1.3),
        row_at(4.0, "infeasible", None),
        row_at(5.0, "optimal", 0.5),
    ]
    first, second = held(rows, 0)
    assert first == Held(pytest.approx(0.5), pytest.approx(2.25))
    assert second == Held(pytest.approx(4.5), None)
    assert list(held(rows[1:3], 0)) == [Held(None, None)]
    assert list(held(rows[3:5], 0)) == []


def test_the_table_has_units_and_every_point(tmp_path: Path) -> None:
    found = service.sweep(WALL, [f"{TENSION}=1,30", "load.mass=50,200"])
    found.write_table(tmp_path / "sweep.csv")
    with (tmp_path / "sweep.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0])[:3] == [f"{TENSION} [N]", "load.mass [kg]", "status"]
    assert [line["status"] for line in lines] == ["error", "error", "optimal", "overloaded"]
    for line, row in zip(lines, found.rows, strict=True):
        assert tuple(map(float, list(line.values())[:2])) == row.point
        if row.error is None:
            assert float(line["utilisation"]) == row.utilisation
            assert float(line["load_factor"]) == row.load_factor
            assert line["limb"] == row.limiting.limb
            assert line["limit"] == row.limiting.limit
            assert line["error"] == ""
            assert line["warnings"] == "; ".join(row.warnings)
        else:
            assert line["utilisation"] == line["load_factor"] == line["limb"] == ""
            assert line["error"].startswith("invalid: ")


def test_a_row_has_the_warnings_of_its_plan() -> None:
    odd, plain = service.sweep(WALL, ["load.mass=0.11,100"]).rows
    assert any(each.startswith("load.mass:") for each in odd.warnings)
    assert not any(each.startswith("load.mass:") for each in plain.warnings)


def test_processes_answer_as_this_process_does() -> None:
    variations = ["load.mass=50:150:6"]
    alone, shared = (service.sweep(WALL, variations, workers=count) for count in (1, 2))
    assert alone.rows == shared.rows


VARIATIONS = (
    (["load.mass=50:150:4"], {}),
    (["hands.front_left.surface=rock,concrete-fine"], {}),
    (["load.mass=50:150:4", SHEAR + "=30:80:3"], {}),
    (["load.mass=50:150:4", "hands.front_left.surface=rock,concrete-fine"], {}),
    ([f"{TENSION}=1:40:3", "load.mass=50:150:3", SHEAR + "=30:80:2", "hands.*.wrist=fixed"], {}),
    (["load.mass=50:150", SHEAR + "=30:80", f"{TENSION}=1:40"], {"samples": 8}),
    (["load.mass=50"], {}),
)


@pytest.mark.parametrize(("variations", "options"), VARIATIONS, ids=str)
def test_pictures_have_their_axes_with_units(
    variations: list[str], options: dict, tmp_path: Path
) -> None:
    found = service.sweep(WALL, variations, **options)
    file = tmp_path / "sweep.svg"
    import matplotlib as mpl

    with mpl.rc_context({"svg.fonttype": "none"}):
        plot_sweep(found, file, "wall")
    text = file.read_text(encoding="utf-8")
    for i in found.design.varying[:2]:
        assert found.design.labels[i] in text
    assert "utilisation" in text


def test_a_picture_is_over_the_chosen_pair(tmp_path: Path) -> None:
    found = service.sweep(WALL, ["load.mass=50:150:3", SHEAR + "=30:80:3", f"{TENSION}=20,40"])
    plot_sweep(found, tmp_path / "a.png", "wall", (TENSION, SHEAR))
    with pytest.raises(InvalidInputError, match=r"load\.mass"):
        plot_sweep(found, tmp_path / "b.png", "wall", ("load.mass", "foo"))


@pytest.mark.parametrize(
    ("caps", "words"), [("0.5,1", "utilisation over its cap [1]"), ("1", "utilisation [1]")]
)
def test_colours_of_a_map_are_parts_of_each_points_own_cap(
    caps: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(
        "service.sweeping.pictures.write_picture", lambda figure, *_: drawn.append(figure)
    )
    found = service.sweep(WALL, ["load.mass=50:150:3", f"limits.utilisation={caps}"])
    over = ("load.mass", "limits.utilisation") if "," in caps else None
    if over is None:
        found = service.sweep(WALL, ["load.mass=50:150:3", SHEAR + "=30:80:3"])
    plot_sweep(found, tmp_path / "a.png", "wall", over)
    axes, bar = drawn[0].axes
    assert bar.get_ylabel() == words
    (mesh,) = [each for each in axes.collections if isinstance(each, QuadMesh)]
    shades = {
        round(float(each), 9) for each in np.ma.compressed(np.ma.asarray(mesh.get_array()).ravel())
    }
    assert shades == {round(row.utilisation / row.cap, 9) for row in found.rows}
    # white is at the cap
    assert mesh.norm(1.0) == 0.5


def test_a_sweep_that_is_broken_off_has_a_table(tmp_path: Path) -> None:
    design = Design.of(WALL, [service.Variation.over("load.mass", 50.0, 100.0, 3)])
    done = Sweep(design, (SweepRow((50.0,), "optimal", 0.5, 2.0),))
    done.write_table(tmp_path / "sweep.csv")
    lines = list(csv.reader(io.StringIO((tmp_path / "sweep.csv").read_text("utf-8"))))
    assert lines[1][:4] == ["50.0", "optimal", "0.5", "2.0"]


def test_the_example_of_the_documents_prints_what_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (ROOT / "docs" / "how-to" / "sweeps.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "sweeps.md", "exec"), {})
    assert capsys.readouterr().out == "6 115\n"
    (told,) = re.findall(r"^holds up to load\.mass = .*$", text, re.MULTILINE)
    (border,) = service.sweep(read_request("wall-300"), ["load.mass=60:120:7"]).borders
    assert border.words == told
    assert (tmp_path / "sweep.csv").exists()
