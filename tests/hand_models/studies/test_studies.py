"""The studies of the palm: data by the paper's formulas, claims as the data has them, files."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.experiments import PalmExperiment
from hand_models.parameters import hand_table
from hand_models.studies import STUDY_MODULES, load_study
from service.commands.cli import run_command_line
from tests.hand_models.studies.runs import check_written

PALM_STUDIES = ("fig06", "fig07")
SPRINGS = {1: 1400.0, 2: 2200.0, 3: 4900.0}
MU, KP = 0.34, 840.0


@pytest.fixture(scope="module")
def results():
    """Every study of the palm, and the steps that it told of."""
    found = {}
    for name in PALM_STUDIES:
        steps = []
        found[name] = load_study(name).run(
            lambda done, total, steps=steps: steps.append((done, total)), hand_table()
        )
        totals = {total for _, total in steps}
        assert len(totals) == 1
        assert [done for done, _ in steps] == list(range(totals.pop() + 1))
    return found


def equation_3(k1, k2, mu):
    return (4.0 * k1 * k2 + 2.0 * KP * (k1 + k2)) / ((2.0 - mu) * k1 + 2.0 * KP)


def test_two_tiles_carry_the_load_of_equation_3(results):
    configurations = results["fig06"].data["configurations"]
    assert {tuple(c["springs"]) for c in configurations} == set(
        itertools.product((1, 2, 3), repeat=2)
    )
    for c in configurations:
        k2, k1 = sorted(SPRINGS[number] for number in c["springs"])
        assert c["load_without_friction"] == pytest.approx(equation_3(k1, k2, 0.0))
        # like springs stick, and share alike anyway
        expected = equation_3(k1, k2, MU) if k1 > k2 else k1 + k2
        assert c["load_with_friction"] == pytest.approx(expected)
        assert c["gain"] == pytest.approx(expected / equation_3(k1, k2, 0.0) - 1.0)


def test_the_fitted_claim_says_so_and_the_formulas_hold(results):
    claims = results["fig06"].claims
    assert [c.role for c in claims] == ["calibration"] + ["test"] * (len(claims) - 1)
    assert all(c.holds for c in claims)
    # the k_p that gives the printed 14 % exactly: the calibrated one, rounded down
    stiffness = results["fig06"].data["preload_stiffness_at_printed_gain"]
    experiment = replace(PalmExperiment.from_tables(hand_table()), preload_stiffness=stiffness)
    assert experiment.gain((1, 2)) == pytest.approx(0.14)
    assert stiffness == pytest.approx(KP, abs=10.0)


def test_every_sequence_of_four_springs_is_loaded_once(results):
    configurations = results["fig07"].data["configurations"]
    sequences = [tuple(c["springs"]) for c in configurations]
    assert len(sequences) == len(set(sequences)) == 45
    assert {min(s, s[::-1]) for s in itertools.product((1, 2, 3), repeat=4)} == set(sequences)


def test_without_friction_the_tendon_pulls_every_tile_alike(results):
    """k_i x_i = 2 F + k_p (x − x_i) with Σ x_i = 4 x, worked by hand."""
    for c in results["fig07"].data["configurations"]:
        k = np.array([SPRINGS[number] for number in c["springs"]])
        share = 1.0 / (k + KP)
        pull = (4.0 - KP * share.sum()) / share.sum()
        travel = (pull + KP) * share
        assert travel.sum() == pytest.approx(4.0)
        assert c["load_without_friction"] == pytest.approx((k * travel).sum() / travel[k.argmin()])


def test_the_claims_of_figure_7_are_those_of_its_data(results):
    result = results["fig07"]
    gains = {
        name: [c["gain"][name] for c in result.data["configurations"] if len(set(c["springs"])) > 1]
        for name in ("tiles", "tiles and palm")
    }
    assert [len(values) for values in gains.values()] == [42, 42]
    for name, values in gains.items():
        summary = result.data["variants"][name]
        assert summary["reach_printed"] == sum(gain >= 0.24 for gain in values)
        assert summary["least"] == min(values)
        eight, helpful, _ = [c for c in result.claims if c.claim.endswith(f"rods at {name}")]
        assert eight.holds == (min(values) >= 0.24)
        assert helpful.holds == (min(values) >= 0.0)
        assert f"{summary['reach_printed']} of 42" in str(eight.got)


def test_friction_hurts_only_where_three_weak_tiles_meet_one_strong(results):
    variants = results["fig07"].data["variants"]
    assert variants["tiles"]["hurts"] == [(1, 1, 1, 3), (1, 1, 3, 1)]
    assert variants["tiles and palm"]["hurts"] == []
    one_weak = results["fig07"].data["by_number_of_softest_tiles"][0]
    assert one_weak["softest_tiles"] == 1
    assert one_weak["variants"]["tiles and palm"]["least"] >= 0.24


def test_the_sensitivity_has_the_figures_own_point(results):
    data = results["fig07"].data
    at = {s["preload_stiffness"]: s["variants"] for s in data["sensitivity"]}
    assert at[KP] == data["variants"]
    assert len(at) >= 3


def test_springs_of_two_kinds_give_eight_sequences_of_each_pair(results):
    for group in results["fig07"].data["eight_of_two_springs"]:
        assert {v["configurations"] for v in group["variants"].values()} == {8}


@pytest.mark.slow
def test_a_study_leaves_its_result_and_pictures():
    check_written("fig06", "fig06")
    check_written("fig07", "fig07", "fig07-dependence")


def test_the_command_prints_the_claims_in_80_columns(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run_command_line(["study", "fig07", "-o", str(tmp_path)]) == 0
    out, said = capsys.readouterr()
    assert said == "crux: study fig07: started; it may take minutes\n"
    table = out.split("not tested:")[0]
    assert max(map(len, table.splitlines())) <= 80
    assert "missed" in table
    assert "of 6 claims hold" in table
    assert str(tmp_path / "result.json") in out


def test_the_command_prints_json_and_nothing_else(tmp_path, capsys):
    assert run_command_line(["study", "fig06", "-o", str(tmp_path), "--json"]) == 0
    captured = capsys.readouterr()
    reply = json.loads(captured.out)
    assert captured.err == ""
    written = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert reply == written | {"files": [str(tmp_path / n) for n in ("result.json", "fig06.png")]}
    assert written["v"] == 1
    assert set(written) == {"v", "name", "title", "data", "claims", "hand"}
    assert written["hand"] == {}
    for claim in written["claims"]:
        assert set(claim) == {"claim", "claimed", "got", "holds", "role"}


def test_a_study_that_does_not_exist_is_refused_with_those_that_do(tmp_path, capsys):
    with pytest.raises(InvalidInputError):
        load_study("fig99")
    assert run_command_line(["study", "fig99", "-o", str(tmp_path / "out")]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert all(name in line for name in (*STUDY_MODULES, "fig99"))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("below", ["file", "file/folder"])
def test_a_folder_that_cannot_be_written_is_refused_in_one_line(below, tmp_path, capsys):
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert run_command_line(["study", "fig06", "-o", str(tmp_path / below)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
