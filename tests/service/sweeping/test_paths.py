"""Paths into a request: what they reach, in which units, and what is valid where they go wrong."""

from __future__ import annotations

import copy

import msgspec
import pytest

from hand_models.base import InvalidInputError, LimitError
from hand_models.tile import Surface
from service.requests import PlanRequest
from service.sweeping import Design, Variation
from tests.suite.helpers.requests import wall_request

LEFT = "hands.front_left"


def design(*variations: str, request: dict | None = None, **options: int) -> Design:
    asked = msgspec.convert(wall_request() if request is None else request, PlanRequest)
    chosen = [Variation.parse(each, sampled="samples" in options) for each in variations]
    return Design.of(asked, chosen, **options)


def asked_at(design: Design, point: tuple) -> dict:
    return msgspec.msgpack.decode(design.payload(point))


def index(request: dict, limb: str) -> int:
    return [hand["limb"] for hand in request["stance"]["hands"]].index(limb)


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("load.mass", "kg"),
        ("load.acceleration.2", "m/s²"),
        ("gravity.2", "m/s²"),
        ("stance.gravity[2]", "m/s²"),
        ("body.position.2", "m"),
        ("body.orientation.2", None),
        (f"{LEFT}.pose.position.0", "m"),
        (f"{LEFT}.hold.diameter", "m"),
        (f"{LEFT}.grasp.closing_tension", "N"),
        (f"{LEFT}.grasp.outer_rotation", "rad"),
        (f"{LEFT}.surface.shear_limit", "N"),
        (f"{LEFT}.surface.pull_off_angle", "rad"),
        (f"{LEFT}.surface.compression_gain", None),
        ("hands.*.surface.shear_limit", "N"),
        ("hands.0.surface.shear_limit", "N"),
        ("limits.tendon_tension", "N"),
        ("limits.utilisation", None),
        ("limits.joint_torque", "N·m"),
        ("limits.joint_torque.front_left", "N·m"),
        ("limits.per_hand.front_left.largest_force", "N"),
    ],
)
def test_a_number_is_found_with_its_unit_and_set_alone(path: str, unit: str | None) -> None:
    request = wall_request() if not path.startswith("load") else wall_request(None)
    found = design(f"{path}=0.25,0.5", request=request)
    assert found.targets[0].unit == unit
    assert found.labels == (path if unit is None else f"{path} [{unit}]",)
    first, second = (asked_at(found, (value,)) for value in (0.25, 0.5))
    assert first != second
    for steps in found.targets[0].steps:
        for document in (first, second):
            place = document
            for step in steps[:-1]:
                place = place[step]
            assert place[steps[-1]] == (0.25 if document is first else 0.5)
            place[steps[-1]] = None
    # what follows a surface's shear limit apart, nothing else is different
    if "shear_limit" not in path:
        assert first == second


def test_two_components_of_a_wrench_have_their_own_units() -> None:
    request = wall_request(None) | {"body_wrench": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}
    found = design("body_wrench.2=1,2", "body_wrench.3=1,2", request=request)
    assert [target.unit for target in found.targets] == ["N", "N·m"]


def test_an_entry_of_a_hand_has_the_unit_that_it_names() -> None:
    entry = {"value": 60.0, "unit": "N", "source": "assumed"}
    request = wall_request()
    request["stance"]["hand"] = {"tendon": {"maximum_tension": entry}}
    path = "hand.tendon.maximum_tension.value"
    found = design(f"{path}=50,70", request=request)
    assert found.labels == (f"{path} [N]",)
    given = asked_at(found, (70,))["stance"]["hand"]["tendon"]["maximum_tension"]
    assert given == entry | {"value": 70}


def test_what_is_left_out_has_its_default_beside_what_varies() -> None:
    found = design("gravity.0=1,2")
    assert asked_at(found, (2.0,))["stance"]["gravity"] == [2.0, 0.0, -9.81]
    found = design("load.acceleration.2=1,2")
    assert asked_at(found, (2.0,))["load"]["acceleration"] == [0.0, 0.0, 2.0]


@pytest.mark.parametrize("name", ["rock", "sandpaper-36", "concrete-fine"])
def test_a_preset_is_expanded_to_its_numbers_and_forces_follow_its_shear_limit(name: str) -> None:
    request = wall_request()
    hand = request["stance"]["hands"][index(request, "front_left")]
    hand["surface"] = name
    preset = Surface.named(name)
    found = design(f"{LEFT}.surface.shear_limit={preset.shear_limit},10", request=request)
    surfaces = [
        Surface.from_values(
            asked_at(found, (value,))["stance"]["hands"][index(request, "front_left")]["surface"]
        )
        for value in (preset.shear_limit, 10.0)
    ]
    assert surfaces[0] == preset
    assert surfaces[1].pull_off_limit / 10.0 == pytest.approx(
        preset.pull_off_limit / preset.shear_limit
    )
    assert surfaces[1].lateral_limit / 10.0 == pytest.approx(
        preset.lateral_limit / preset.shear_limit
    )
    assert surfaces[1].pull_off_angle == preset.pull_off_angle
    # of a preset whose strength is not varied nothing else changes
    found = design(f"{LEFT}.surface.friction=0.1", request=request)
    given = asked_at(found, (0.1,))["stance"]["hands"][index(request, "front_left")]["surface"]
    assert Surface.from_values(given).shear_limit == preset.shear_limit
    # what is varied itself follows nothing
    found = design(
        f"{LEFT}.surface.pull_off_limit=3", f"{LEFT}.surface.shear_limit=10", request=request
    )
    given = asked_at(found, (3.0, 10.0))["stance"]["hands"][index(request, "front_left")]["surface"]
    assert (given["pull_off_limit"], given["shear_limit"]) == (3.0, 10.0)


def test_numbers_of_a_surface_of_the_callers_own_stay() -> None:
    request = wall_request()
    hand = request["stance"]["hands"][index(request, "front_left")]
    hand["surface"] = {"shear_limit": 60.0, "lateral_limit": 30.0}
    before = copy.deepcopy(hand["surface"])
    found = design(f"{LEFT}.surface.shear_limit=20,40", request=request)
    given = asked_at(found, (40.0,))["stance"]["hands"][index(request, "front_left")]["surface"]
    assert given == before | {"shear_limit": 40.0}


@pytest.mark.parametrize(
    ("variation", "words"),
    [
        ("load.mas=1,2", ["load.mas", "mass, com, acceleration"]),
        ("foo=1,2", ["foo", "load", "hands, ".strip(", "), "gravity"]),
        ("hands.front_lft.wrist=fixed", ["front_right, rear_right, rear_left, front_left"]),
        (f"{LEFT}.hold.radius=1,2", ["radius", "diameter"]),
        (f"{LEFT}.hold=1", ["not a number or a word", "diameter"]),
        (f"{LEFT}.surface.strength=1", ["shear_limit, pull_off_limit"]),
        ("gravity.3=1,2", ["known are 0, 1, 2"]),
        ("gravity=1,2", ["entries: 0, 1, 2"]),
        ("load.mass.x=1,2", ["load.mass is a number"]),
        ("load.com.2=1,2", ["load.com has no value"]),
        ("joints.front_left.0=1,2", ["joints.front_left has no value"]),
        ("limits.joint_torque.x=1,2", ["front_right, rear_right"]),
        ("v=1,2", ["known are stance"]),
        ("want=spread", ["known are stance"]),
        ("load.mass=heavy", ["load.mass", "number"]),
        ("load.mass=-1:5:3", ["load.mass", ">= 0.001"]),
        (f"{LEFT}.surface=rock,rok", ["unknown surface 'rok'", "concrete-fine"]),
        (f"{LEFT}.wrist=loose", ["fixed, floating"]),
        (f"{LEFT}.surface.half_planes=1:4:5", ["whole numbers"]),
    ],
)
def test_what_is_wrong_is_told_in_a_line_with_what_is_valid(
    variation: str, words: list[str]
) -> None:
    with pytest.raises(InvalidInputError) as caught:
        design(variation, request=wall_request(None))
    line = str(caught.value)
    assert "\n" not in line
    for each in words:
        assert each in line


def test_a_number_or_a_word_that_is_given_has_no_entries() -> None:
    for path in ("load.mass.x", f"{LEFT}.wrist.0"):
        with pytest.raises(InvalidInputError, match="is a number or a word, without entries"):
            design(f"{path}=1", request=wall_request(50.0))
    request = wall_request()
    request["stance"]["joints"] = "solve"
    with pytest.raises(InvalidInputError, match="joints is 'solve' in the request"):
        design("joints.front_left.0=1", request=request)


@pytest.mark.parametrize(
    "pair",
    [
        ("load.mass=1,2", "load.mass=3,4"),
        (f"{LEFT}.surface=rock", f"{LEFT}.surface.shear_limit=3,4"),
        ("hands.*.surface.friction=0,1", f"{LEFT}.surface.friction=0,1"),
    ],
)
def test_a_value_is_not_varied_twice(pair: tuple[str, str]) -> None:
    with pytest.raises(InvalidInputError, match=r"varies the same field as|is given twice"):
        design(*pair)


def test_too_many_points_are_refused_before_anything_is_planned() -> None:
    with pytest.raises(LimitError, match=r"100,000"):
        design("load.mass=1:2:1000", "body.position.0=0:1:1000")
    with pytest.raises(InvalidInputError, match="at least one"):
        design()
