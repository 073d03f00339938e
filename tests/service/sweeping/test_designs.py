"""Variations and the points that come of them: grids, samples, and values that cannot be."""

from __future__ import annotations

import itertools
import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.base import InvalidInputError
from service.requests import PlanRequest
from service.sweeping import Design, Variation
from tests.suite.helpers.requests import wall_request

REQUEST = msgspec.convert(wall_request(), PlanRequest)
MASS, ACROSS = "load.mass", "body.position.0"


@given(
    low=st.floats(-1e3, 1e3, allow_nan=False),
    width=st.floats(1e-3, 1e3),
    count=st.integers(2, 50),
)
def test_a_range_goes_from_low_to_high_at_equal_distances(
    low: float, width: float, count: int
) -> None:
    found = Variation.parse(f"{ACROSS}={low!r}:{low + width!r}:{count}").values
    assert len(found) == count
    np.testing.assert_allclose(found, np.linspace(low, low + width, count), rtol=1e-9, atol=1e-9)


def test_values_are_numbers_or_words_as_they_are_written() -> None:
    assert Variation.parse("a=20,40.5,1e2").values == (20, 40.5, 100.0)
    assert Variation.parse("a= rock , sandpaper-36").values == ("rock", "sandpaper-36")
    assert Variation.parse("a=true,false,null").values == (True, False, None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("load.mass", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=60-180", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=60..180", "PATH=LOW:HIGH:COUNT"),
        ("=1,2", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=1:2", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=1:2:3:4", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=1:2:x", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=a:b:3", "PATH=LOW:HIGH:COUNT"),
        ("load.mass=2:1:3", "LOW must be below HIGH, got 2:1"),
        ("load.mass=1:1:3", "LOW must be below HIGH, got 1:1"),
        ("load.mass=1:2:1", "COUNT must be from 2"),
        ("load.mass=1:2:0", "COUNT must be from 2"),
        ("load.mass=nan:2:3", "finite"),
        ("load.mass=1:inf:3", "finite"),
        ("load.mass=nan", "finite"),
        ("load.mass=1,inf", "finite"),
        ("load.mass=1,,2", "empty"),
        ("load.mass=1,1", "twice"),
    ],
)
def test_a_variation_that_cannot_be_is_told_in_a_line(text: str, words: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        Variation.parse(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_grid_has_all_values_the_last_variation_fastest() -> None:
    variations = [
        Variation.parse(f"{MASS}=60:80:3"),
        Variation.parse("hands.*.wrist=fixed,floating"),
    ]
    found = Design.of(REQUEST, variations)
    assert found.points == tuple(itertools.product((60.0, 70.0, 80.0), ("fixed", "floating")))


@pytest.mark.parametrize("count", [1, 7, 40])
def test_samples_have_one_value_in_every_part_of_a_range(count: int) -> None:
    ends = {MASS: (60.0, 120.0), ACROSS: (-1.0, 0.5)}
    chosen = [
        Variation.parse(f"{path}={low}:{high}", sampled=True) for path, (low, high) in ends.items()
    ]
    found = Design.of(REQUEST, chosen, count, seed=3)
    assert len(found.points) == count
    for column, (low, high) in zip(zip(*found.points, strict=True), ends.values(), strict=True):
        parts = [math.floor(count * (value - low) / (high - low)) for value in column]
        assert sorted(parts) == list(range(count))
    assert found.points == Design.of(REQUEST, chosen, count, seed=3).points
    assert found.points != Design.of(REQUEST, chosen, count, seed=4).points


def test_samples_have_each_word_and_each_whole_number_as_often() -> None:
    chosen = [
        Variation.parse("hands.front_left.surface=rock,concrete-fine,sandpaper-36"),
        Variation.parse("hands.rear_left.surface.half_planes=1:4", sampled=True),
    ]
    words, planes = zip(*Design.of(REQUEST, chosen, 24, seed=0).points, strict=True)
    assert {word: words.count(word) for word in words} == dict.fromkeys(chosen[0].values, 8)
    assert {each: planes.count(each) for each in planes} == dict.fromkeys((1, 2, 3, 4), 6)
    assert all(isinstance(each, int) for each in planes)
