"""A hand of the caller's own: files with some of its numbers, in every command."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from hand_models import Cylinder, InvalidInputError, Mesh, SpinyHand, spiny_hand
from hand_models.hand import FINGERS
from hand_models.parameters import ParameterTable, Quantity, hand_table, load_own_hand, own_hand
from planner.robots import robosimian
from service.answering import dispatch, read_hand, with_hand
from service.answering.questions import question
from service.commands.cli import run_command_line
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.commands import result
from tests.suite.helpers.hands import PINCH, ROCK, entry_toml
from tests.suite.helpers.own_hands import THICK, own, request_for
from tests.suite.helpers.requests import put, wall_request
from tests.suite.helpers.rocks import cylinder_mesh

X, Z = np.eye(3)[[0, 2]]
BUNDLED = [(section, name) for section, name, _ in hand_table()]


@pytest.fixture
def file(tmp_path: Path):
    """Writes a hand's file, and returns its path."""

    def write(text: str | bytes, name: str = "own.toml") -> str:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return str(path)

    return write


# Numbers ------------------------------------------------------------------------------------------


def test_every_entry_may_be_one_per_cent_off(file) -> None:
    for section, name in BUNDLED:
        value = hand_table().quantity(section, name).value
        off = [1.01 * v for v in value] if isinstance(value, list) else 1.01 * value
        table = own_hand(read_hand(Path(file(entry_toml(section, name, off)))))
        changed = table.difference(hand_table()).sections
        expected = {(section, name): off} if np.any(value) else {}
        assert {(s, n): q.value for s, ns in changed.items() for n, q in ns.items()} == expected


def test_what_is_no_coordinate_may_not_be_negative() -> None:
    for section, name in BUNDLED:
        value = np.asarray(hand_table().quantity(section, name).value)
        negative = (-1.01 * np.abs(value) - 1e-3).tolist()
        if value.min() < 0.0 or (section, name) == ("fingers", "base_tile_surface"):
            SpinyHand(own_hand(own(section, name, (value - 1e-4).tolist())))
        else:
            with pytest.raises(InvalidInputError, match=r"must be (from|above) 0 ") as caught:
                own_hand(own(section, name, negative))
            assert caught.value.field == f"{section}.{name}"


def test_twice_the_pulleys_change_the_normals_by_the_balance_of_the_joints() -> None:
    """Eq. 4: the tendon's added moment f r about each joint is what the added normals take."""
    tension = 100.0
    bundled, thick = spiny_hand(), spiny_hand(own_hand(THICK))
    radii = np.array(hand_table().vector("finger", "pulley_radii"))
    height = hand_table().scalar("finger", "tile_height")
    before, after = (hand.settle(Cylinder(0.3), ROCK, PINCH) for hand in (bundled, thick))
    loads = [settled.tile_loads(np.full(4, tension)) for settled in (before, after)]
    for i in range(len(FINGERS)):
        contacts = after.fingers[i].contacts
        for one, other in zip(contacts, before.fingers[i].contacts, strict=True):
            # twice the pulleys press the bed in twice as far
            assert one.angle == other.angle
            assert one.along == pytest.approx(other.along, abs=6e-4)
        assert all(contact.kind == "face" for contact in contacts)
        moments = np.zeros((3, 3))
        for k in range(3):
            x, z = contacts[k].joint
            for j in range(k, 3):
                u, w = contacts[j].point(height)
                angle = contacts[j].angle
                # of the rock's reaction −N n, n = (−sin, cos), about joint k, from x toward z
                moments[k, j] = (u - x) * math.cos(angle) + (w - z) * math.sin(angle)
        tiles = [n for n, t in enumerate(after.tiles) if t.finger == FINGERS[i] != t.phalanx]
        tiles = [n for n in tiles if after.tiles[n].phalanx in ("proximal", "middle", "distal")]
        added = loads[1][tiles] - loads[0][tiles]
        np.testing.assert_allclose(added[:, 0], 0.0, atol=1e-9)  # shear follows the tendon alone
        np.testing.assert_allclose(
            added[:, 1], np.linalg.solve(moments, tension * radii), rtol=0.03
        )


@pytest.mark.parametrize("name", ["radians", "list", "integer"])
def test_a_bare_number_is_in_the_unit_of_its_entry(name: str, tmp_path: Path) -> None:
    """Of hand.toml, and assumed; the entry is that which says so."""
    section, entry, value = {
        "radians": ("seat", "turn", 0.5),
        "list": ("finger", "pulley_radii", [0.005, 0.003, 0.002]),
        "integer": ("hand", "mass", 3),
    }[name]
    path = tmp_path / "mine.toml"
    path.write_text(f"[{section}]\n{entry} = {value}\n")
    assert load_own_hand(path) == own(section, entry, value)


def test_four_heavier_hands_weigh_on_the_body() -> None:
    heavy = robosimian(own_hand(own("hand", "mass", 5.6)))
    assert heavy.mass == pytest.approx(robosimian().mass + 4 * 3.0)
    wrench = question(request_for(own("hand", "mass", 5.6), mass=None)).needed_wrench()
    np.testing.assert_allclose(
        np.linalg.norm(wrench[:3]), 9.81 * (robosimian().mass + 12.0), rtol=1e-12
    )


def test_a_hand_is_built_once_for_each_content() -> None:
    a, b = (own_hand(own("tile", "spine_travel", 0.004)) for _ in range(2))
    assert a is not b
    assert a == b != hand_table()
    assert hash(a) == hash(b)
    assert spiny_hand(a) is spiny_hand(b) is robosimian(a).hand is not spiny_hand()


def test_a_tile_smooths_rock_to_its_own_length() -> None:
    roof = [[-0.3, 0.3], [0.0, 0.0], [0.3, 0.3]]
    asked = put(
        wall_request(), ("stance", "hands", 0, "hold"), {"shape": "profile", "points": roof}
    )
    request = decode_request(msgspec.json.encode(asked), PlanRequest)
    fillets = {}
    for length in (0.024, 0.012):
        small = with_hand(request, own("finger", "tile_length", length))
        section = question(small).stance.hands[0].hold.section(np.zeros(3), X, Z)
        # how deep the roof's sides, raw, lie under the fillet
        fillets[length] = -min(section.clearance((x, x)) for x in np.linspace(0.0, 0.05, 201))
    # a corner is rounded as wide as the tile is long; by 1.8 mm with one of 24 mm
    assert fillets[0.024] == pytest.approx(1.8e-3, abs=1e-4)
    assert fillets[0.012] == pytest.approx(0.5 * fillets[0.024], rel=0.02)


def test_a_large_hand_meets_scanned_rock_as_far_as_it_reaches() -> None:
    longer = {"joint_spacing": 0.12, "tile_centre": 0.06}
    entries = {name: Quantity(value, "m", "assumed") for name, value in longer.items()}
    table = own_hand(ParameterTable({"finger": entries}))
    hand = spiny_hand(table)
    want = hand.settle(Cylinder(1.5), ROCK, PINCH)
    got = hand.settle(Mesh(*cylinder_mesh(1.5, 1024), table), ROCK, PINCH, want.seating.pose)
    assert np.abs(want.positions[:, 1]).max() < 0.06
    assert np.abs(want.positions[:, 0]).max() > 0.3
    np.testing.assert_allclose(got.positions, want.positions, atol=3e-4)


# Files --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stance", ["slab", "ledge"])
def test_a_file_with_the_bundled_numbers_gives_the_same_plan(
    stance: str, file, capfd: pytest.CaptureFixture[str]
) -> None:
    text = ""
    for section, entries in hand_table().sections.items():
        text += f"[{section}]\n" + "".join(
            entry_toml(section, n, q.value).partition("\n")[2] for n, q in entries.items()
        )
    replies = []
    for more in ([], ["--hand", file(text)]):
        assert run_command_line(["plan", stance, "--json", *more]) == 0
        replies.append(msgspec.json.decode(capfd.readouterr().out))
    for reply in replies:
        del reply["time"]
    assert replies[0] == replies[1]


BAD = {
    "no ratio of pulleys": (
        "[tile]\npulley_ratio = 0",
        "tile.pulley_ratio: must be above 0, got 0",
    ),
    "no stiffness": (
        "[tile]\ncontact_stiffness = 0",
        "tile.contact_stiffness: must be above 0 N/m, got [0.0, 0.0, 0.0]",
    ),
    "a negative number without a unit": (
        "[tile]\npulley_ratio = -1",
        "tile.pulley_ratio: must be from 0 to 2e+04, got -1",
    ),
    "a negative ratio of stiffness": (
        "[tile]\nrock_stiffness_ratio = -1",
        "tile.rock_stiffness_ratio: must be above 0 and at most 1e+04, got -1",
    ),
    "an unknown section": (
        '[fingr]\nlength = { value = 1, unit = "m", source = "assumed" }',
        "fingr: unknown section; known are finger, fingers, hand,",
    ),
    "an unknown entry": (
        '[finger]\npulley_radius = { value = 1, unit = "m", source = "assumed" }',
        "finger.pulley_radius: unknown entry; known are pulley_radii,",
    ),
    "millimetres": (
        entry_toml("finger", "joint_spacing", 43.1, "mm"),
        "finger.joint_spacing: must be in 'm', got 43.1 in 'mm'",
    ),
    "millimetres that say metres": (
        entry_toml("finger", "joint_spacing", 43.1),
        "finger.joint_spacing: must be from 0 to 1 m, got 43.1",
    ),
    "degrees": (
        entry_toml("finger", "joint_upper", [100, 100, 100], "deg"),
        "finger.joint_upper: must be in 'rad', got [100.0, 100.0, 100.0] in 'deg'",
    ),
    "a number for a list": (
        entry_toml("finger", "pulley_radii", 0.005),
        "finger.pulley_radii: a list of 3 numbers is needed, got 0.005",
    ),
    "a list for a number": (
        entry_toml("finger", "joint_spacing", [0.04, 0.04, 0.04]),
        "finger.joint_spacing: one number is needed, got a list of 3",
    ),
    "a short list": (
        entry_toml("palm", "tile_x", [0.01, 0.02]),
        "palm.tile_x: a list of 4 numbers is needed, got [0.01, 0.02]",
    ),
    "a negative length": (
        entry_toml("finger", "tile_height", -0.004),
        "finger.tile_height: must be from 0 to 1 m, got -0.004",
    ),
    "joints in one place": (
        entry_toml("finger", "joint_spacing", 0.0),
        "finger.joint_spacing: must be above 0, got 0",
    ),
    "no pulley": (
        entry_toml("finger", "pulley_radii", [0.005, 0.0, 0.003]),
        "finger.pulley_radii: must be above 0 m, got [0.005, 0.0, 0.003]",
    ),
    "a tile beyond its phalanx": (
        entry_toml("finger", "joint_spacing", 0.03),
        "finger.tile_centre: a tile must lie on its phalanx, from 0 to 0.03 m, got 0.0085 to",
    ),
    "frames narrower than tiles": (
        entry_toml("finger", "frame_width", 0.02),
        "finger.tile_width: must be from 0 to finger.frame_width, 0.02 m, got 0.0215 m; lower it",
    ),
    "tiles wider than frames": (
        entry_toml("finger", "tile_width", 0.03),
        "finger.tile_width: must be from 0 to finger.frame_width, 0.029 m, got 0.03 m; lower it",
    ),
    "a joint that cannot turn": (
        entry_toml("finger", "joint_lower", [1.8, -0.3, -0.3]),
        "finger.joint_upper: must be above finger.joint_lower, both within half a turn, got 1.75",
    ),
    "friction of one": (
        entry_toml("tendon", "friction", 1.0),
        "tendon.friction: must be in [0, 1), got 1",
    ),
    "friction of the palm": (
        entry_toml("palm", "pulley_friction", 2.0),
        "palm.pulley_friction: must be in [0, 2), got 2",
    ),
    "own friction of the palm": (
        entry_toml("palm", "own_pulley_friction", 2.5),
        "palm.own_pulley_friction: must be in [0, 2), got 2.5",
    ),
    "a palm without contact": (
        entry_toml("palm", "contact_stiffness", [0.0] * 8),
        "palm.contact_stiffness: stiffnesses above 0 N/m are needed",
    ),
    "a palm that may not press": (
        entry_toml("palm", "pressing_limit", 0.0),
        "palm.pressing_limit: must be above 0, got 0",
    ),
    "closing beyond the tendon": (
        entry_toml("tendon", "closing_tension", 800.0),
        "tendon.closing_tension: must be at most tendon.maximum_tension, 700 N, got 800 N",
    ),
    "a gear that gains": (
        entry_toml("motor", "efficiency", 1.2),
        "motor.efficiency: must be in (0, 1], got 1.2",
    ),
    "not a number": (
        entry_toml("finger", "pulley_radii", "[0.005, nan, 0.003]"),
        "finger.pulley_radii.value[1]: must be finite, got nan",
    ),
    "no unit": (
        '[hand]\nmass = { value = 1.0, source = "assumed" }',
        "hand.mass: object missing required field unit; an entry is { value, unit, source, note",
    ),
    "an unknown number": ("[hand]\nmasse = 1.0", "hand.masse: unknown entry; known are mass"),
    "no number": (
        "[hand]\nmass = true",
        "hand.mass: expected object, got bool; an entry is { value, unit, source, note",
    ),
    "a source that is none": (
        '[hand]\nmass = { value = 1.0, unit = "kg", source = "guess" }',
        "hand.mass.source: must be one of paper, measured, calibrated, assumed, got 'guess'",
    ),
    "text for a number": (
        '[hand]\nmass = { value = "a", unit = "kg", source = "assumed" }',
        "hand.mass.value: must be a number or a list of numbers, got 'a'",
    ),
    "no section": ("mass = 2.0\n", "mass: a section of entries is needed"),
    "no TOML": ("[hand\n", "is not valid TOML: Expected"),
    "no text": (b"\xff\xfe", "is not in UTF-8 (byte 0xff in line 1); save it as TOML in UTF-8"),
}


def test_tiles_wider_than_frames_are_refused_wherever_a_hand_is_read(tmp_path: Path) -> None:
    narrow = own("finger", "frame_width", 0.02)
    path = tmp_path / "narrow.toml"
    path.write_text(entry_toml("finger", "frame_width", 0.02))
    readers: list[Callable[[], object]] = [
        lambda: load_own_hand(path),
        lambda: own_hand(narrow),
        lambda: SpinyHand(hand_table().replaced(narrow)),
    ]
    for reads in readers:
        with pytest.raises(InvalidInputError, match="lower it, or raise frame_width") as caught:
            reads()
        assert "finger.tile_width" in f"{caught.value.field} {caught.value}"
    # but not where the tiles are made narrower, too
    thin = own_hand(own("finger", "tile_width", 0.015))
    assert own_hand(narrow, thin).scalar("finger", "frame_width") == 0.02


@pytest.mark.parametrize("what", BAD)
def test_a_bad_file_is_refused_in_one_line(
    what: str, file, capfd: pytest.CaptureFixture[str]
) -> None:
    text, complaint = BAD[what]
    path = file(text)
    assert run_command_line(["plan", "wall-300", "--hand", path]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(f"crux: {path}: {complaint}")
    assert err.count("\n") == 1
    assert len(err) < len(path) + 600


@pytest.mark.parametrize("name", ["nowhere.toml", ""])
def test_a_file_that_is_none_is_refused(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    with pytest.raises(InvalidInputError):
        load_own_hand(path)
    assert (
        run_command_line(["study", "fig06", "-o", str(tmp_path / "out"), "--hand", str(path)]) == 2
    )
    assert capfd.readouterr().err.startswith(f"crux: {path}: ")
    assert not (tmp_path / "out").exists()


# Commands -----------------------------------------------------------------------------------------


def test_a_plan_is_for_the_hand_of_the_file(file, capfd: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["plan", "wall-300", "--json"]) == 0
    assert result(capfd)["limiting"]["limit"] != "tendon_tension"
    path = file(entry_toml("tendon", "maximum_tension", 60.0))
    assert run_command_line(["plan", "wall-300", "--json", "--hand", path]) == 3
    reply = result(capfd)
    assert reply["limiting"]["limit"] == "tendon_tension"
    tensions = [f["tendon_tension"] for hand in reply["hands"] for f in hand["fingers"]]
    assert max(tensions) / 60.0 == pytest.approx(reply["utilisation"], rel=1e-6)


def test_the_file_has_the_last_word_over_the_stance(
    file, capfd: pytest.CaptureFixture[str]
) -> None:
    request = put(wall_request(None), ("stance", "hand"), msgspec.to_builtins(THICK.sections))
    request["stance"]["hand"]["hand"] = {"mass": {"value": 9.0, "unit": "kg", "source": "assumed"}}
    stance = file(json.dumps(request), "stance.json")
    assert run_command_line(
        ["plan", stance, "--json", "--hand", file(entry_toml("hand", "mass", 4.6))]
    ) in (
        0,
        3,
    )
    weight = 9.81 * (robosimian().mass + 4 * 2.0)
    got = result(capfd)
    np.testing.assert_allclose(np.linalg.norm(got["body_wrench"][:3]), weight, rtol=1e-9)
    both = own_hand(THICK.replaced(own("hand", "mass", 4.6)))
    want = dispatch.answer_plan(with_hand(request_for(mass=None), both))
    assert got["utilisation"] == pytest.approx(want.utilisation, rel=1e-9)


def test_one_file_is_a_hand_and_a_limb_is_none(file, capfd: pytest.CaptureFixture[str]) -> None:
    path = file(entry_toml("hand", "mass", 3.0))
    assert run_command_line(["plan", "wall-300", "--hand", path, "--hand", path]) == 2
    assert f"one FILE at most may be given, got {path}, {path}" in capfd.readouterr().err
    assert run_command_line(["plan", "wall-300", "--hand", "front_left"]) == 2
    assert "a FILE with numbers of a hand is wanted" in capfd.readouterr().err


def test_a_wrench_space_takes_a_limb_and_a_file(file, capfd: pytest.CaptureFixture[str]) -> None:
    path = file(entry_toml("tendon", "maximum_tension", 60.0))
    limits = {}
    for more in ([], ["--hand", path]):
        assert (
            run_command_line(["wrench-space", "wall-300", "--json", "--hand", "front_left", *more])
            == 0
        )
        rows = result(capfd)["rows"]
        limits[len(more)] = {row["capacity"] for row in rows if row["limit"] == "tendon_tension"}
    assert limits == {0: {700.0}, 2: {60.0}}
    for given in (["--hand", path], ["--hand", "front_left", "--hand", "rear_left"]):
        assert run_command_line(["wrench-space", "wall-300", *given]) == 2
        assert "one LIMB and at most one FILE that ends in .toml" in capfd.readouterr().err


@pytest.mark.slow
def test_a_route_is_climbed_with_the_hand(
    file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = file(entry_toml("structure", "held_mass", 20.0))
    tables = {}
    for workers in ("1", "2"):
        flags = ["--json", "--hand", path, "--workers", workers]
        assert run_command_line(["route", "six-moves", "-o", str(tmp_path / workers), *flags]) == 3
        assert result(capfd)["feasible"] is False
        tables[workers] = (tmp_path / workers / "stages.csv").read_text()
    assert tables["1"] == tables["2"]
    assert "hand_load" in tables["1"]


@pytest.mark.slow
def test_the_demo_asks_for_the_hand(
    file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = file(entry_toml("tendon", "maximum_tension", 60.0))
    assert (
        run_command_line(["demo", "-o", str(tmp_path / "demo.png"), "--json", "--hand", path]) == 3
    )
    assert result(capfd)["limiting"]["limit"] == "tendon_tension"
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")


def test_a_study_is_of_the_hand_and_says_so(
    file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = file(entry_toml("palm", "spring_stiffness", 400.0))
    assert run_command_line(["study", "fig06", "-o", str(tmp_path), "--json", "--hand", path]) == 0
    reply = result(capfd)
    assert reply["hand"]["palm"]["spring_stiffness"]["value"] == 400.0
    k1, k2, mu, kp = 2200.0, 1400.0, 0.34, 400.0
    by_hand = (4.0 * k1 * k2 + 2.0 * kp * (k1 + k2)) / ((2.0 - mu) * k1 + 2.0 * kp)
    (pair,) = [c for c in reply["data"]["configurations"] if c["springs"] == [1, 2]]
    assert pair["load_with_friction"] == pytest.approx(by_hand)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 1.9])
def test_the_studies_of_the_palm_bear_any_possible_palm(
    friction: float, file, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = file(entry_toml("palm", "pulley_friction", friction))
    for name in ("fig06", "fig07"):
        assert run_command_line(["study", name, "-o", str(tmp_path), "--json", "--hand", path]) == 0
        assert result(capfd)["data"]["friction"] == friction


def test_the_help_of_study_lists_the_studies(capfd: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["study", "--help"]) == 0
    text = " ".join(capfd.readouterr().out.split())
    assert "NAME is one of fig06, fig07, fig10" in text
