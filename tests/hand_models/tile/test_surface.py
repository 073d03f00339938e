"""What a tile holds: the limit surface over Eq. 21, and half-planes inside and outside it."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models import InvalidInputError, Surface
from hand_models.parameters import experiment_table
from hand_models.tile import (
    bounds_gap,
    directional_strength,
    inner_half_planes,
    outer_half_planes,
    surface_names,
)
from tests.suite.helpers.shares import given_some

LINEAR = st.just(1.0)
"""The exponent of Eq. 21."""

DIRECTIONS = np.linspace(-math.pi / 2, math.pi / 2, 1441)[1:]
"""Loading angles φ, from pressing (< 0) through pure shear (0) to pure pull-off (π/2)."""


def law(surface, angles):
    """Eq. 21 and its extensions, written out anew: the force at which a tile lets go [N]."""
    radii = []
    for angle in angles:
        if angle < 0.0:
            along = math.cos(angle) + surface.compression_gain * math.sin(angle)
            radii.append(surface.shear_limit / along if along > 0.0 else math.inf)
        elif angle < surface.pull_off_angle:
            lost = (angle / surface.pull_off_angle) ** surface.pull_off_exponent
            radii.append(
                surface.shear_limit - (surface.shear_limit - surface.pull_off_limit) * lost
            )
        else:
            radii.append(surface.pull_off_limit)
    return np.array(radii)


def reach(surface, angles):
    """How far the half-planes let a force without lateral load go in each direction [N]."""
    shear, normal = np.cos(angles), -np.sin(angles)
    slopes = np.array([p.a_shear * shear + p.a_normal * normal for p in inner_half_planes(surface)])
    capacities = np.array([p.capacity for p in inner_half_planes(surface)])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(slopes > 1e-15, capacities / slopes, np.inf).min(axis=0)


def boat(surface, directions):
    """The limit surface of the module's first lines, written out anew, along (T, N, Y) [N]."""
    shear, normal, lateral = directions.T
    in_plane = np.hypot(shear, lateral)
    aside = np.where(in_plane > 0.0, in_plane - shear, 0.0)  # cos φ (1 − cos θ)
    angle = np.arcsin(np.clip(-normal, -1.0, 1.0))
    share = surface.lateral_limit / surface.shear_limit
    used = np.clip(angle / surface.pull_off_angle, 0.0, 1.0)
    share = share * (1.0 - used * (1.0 - surface.lateral_pull_off_ratio))
    pulling = law(surface, np.maximum(angle, 0.0)) * (1.0 - (1.0 - share) * aside)
    # pressed: in the plane up to F(0, θ) and γ for each newton
    lost = 1.0 - surface.lateral_limit / surface.shear_limit
    flat = surface.shear_limit * (1.0 - lost * aside / np.maximum(in_plane, 1e-300))
    left = in_plane - surface.compression_gain * normal
    with np.errstate(divide="ignore"):
        pressing = np.where(left > 0.0, flat / np.maximum(left, 0.0), np.inf)
    return np.where(normal <= 0.0, pulling, pressing)


def random_directions(count, seed=0):
    """Evenly spread over the half space of shear ≥ 0."""
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    directions[:, 0] = np.abs(directions[:, 0])
    return directions / np.linalg.norm(directions, axis=1)[:, None]


def edge_directions(surface, count=400):
    """Where a half-plane would leave the surface first: along φ_max, T = 0, N = 0 and the nodes."""
    turn = np.linspace(0.0, np.pi / 2, count)
    cone = np.full(count, surface.pull_off_angle)
    places = [(cone, turn), (turn, np.full(count, np.pi / 2)), (0.0 * turn, turn)]
    for node in np.linspace(0.0, surface.pull_off_angle, surface.half_planes + 1):
        # seen from the side at the angle of a node
        out = turn[:-1]
        pull, shear = np.cos(out) * np.sin(node), np.cos(out) * np.cos(node)
        places.append((np.arcsin(pull), np.arctan2(np.sin(out), shear)))
    found = [
        np.column_stack([np.cos(a) * np.cos(t), -np.sin(a), np.cos(a) * np.sin(t)])
        for a, t in places
    ]
    return np.abs(np.concatenate(found)) * (1.0, -1.0, 1.0)


def area_between(surface):
    """Between the law and the half-planes, for 0 ≤ φ ≤ φ_max [N²]."""
    angles = np.linspace(0.0, surface.pull_off_angle, 1001)
    gap = law(surface, angles) ** 2 - reach(surface, angles) ** 2
    return float(np.trapezoid(0.5 * gap, angles))


@st.composite
def surfaces(draw, exponents=LINEAR):
    shear_limit = draw(st.floats(0.5, 500.0))
    return Surface(
        shear_limit=shear_limit,
        pull_off_limit=shear_limit * draw(st.floats(0.02, 1.0)),
        pull_off_angle=draw(st.floats(0.1, math.pi / 2)),
        lateral_limit=shear_limit * draw(st.floats(0.1, 2.0)),
        compression_gain=draw(st.sampled_from([0.0, 0.0, 0.3, 1.5])),
        half_planes=draw(st.integers(1, 16)),
        lateral_pull_off_ratio=draw(st.one_of(st.just(1.0), st.floats(0.02, 1.0))),
        pull_off_exponent=draw(exponents),
    )


laws = st.one_of(st.just(1.0), st.sampled_from([0.5, 2.0]), st.floats(0.25, 4.0))
"""Exponents with which strength falls toward pull-off: Eq. 21's, a root, a square, any."""


@given_some(8, 60, surfaces(laws))
def test_strength_is_the_declared_law_of_the_loading_angle(surface):
    angles = DIRECTIONS[:: len(DIRECTIONS) // 200]
    np.testing.assert_allclose(surface.strength(angles), law(surface, angles), rtol=1e-9)


def test_strength_by_hand():
    """60 N in shear, 20 N at 40°: 40 N half way, 20 N from there to pure pull-off."""
    surface = Surface(60.0, 20.0, math.radians(40.0), 30.0, 0.5)
    np.testing.assert_allclose(
        surface.strength(np.radians([0.0, 20.0, 40.0, 60.0, 90.0])), [60, 40, 20, 20, 20]
    )
    # pressed at 45°: T = 60 + N/2 with N = T gives T = 120
    assert surface.strength(-math.pi / 4) == pytest.approx(120.0 * math.sqrt(2.0))


@given_some(8, 150, surfaces(laws))
def test_half_planes_stay_inside_the_law_in_every_direction(surface):
    assert (reach(surface, DIRECTIONS) <= law(surface, DIRECTIONS) * (1.0 + 1e-9)).all()


@given_some(10, 100, surfaces())
def test_half_planes_meet_the_law_at_their_nodes(surface):
    surface = replace(surface, compression_gain=0.0)
    nodes = np.linspace(0.0, surface.pull_off_angle, surface.half_planes + 1)
    np.testing.assert_allclose(reach(surface, nodes), law(surface, nodes), rtol=1e-6)


@given_some(5, 60, surfaces())
def test_the_gap_closes_with_the_square_of_the_number_of_half_planes(surface):
    surface = replace(surface, compression_gain=0.0)
    gaps = [area_between(replace(surface, half_planes=k)) for k in (1, 2, 4, 8, 16)]
    for coarse, fine in itertools.pairwise(gaps):
        assert fine <= coarse * 0.35 + 1e-9 * surface.shear_limit**2


@given_some(10, 100, surfaces())
def test_one_half_plane_more_is_needed_only_where_the_last_leaves_the_curve(surface):
    """Pure pull-off is capped at f_min: by the last chord, or by one more that closes it off."""
    pull = reach(surface, np.array([math.pi / 2]))[0]
    assert pull <= surface.pull_off_limit * (1.0 + 1e-9)
    pieces = [p for p in inner_half_planes(surface) if p.limit == "pull_off"]
    assert len(pieces) in (surface.half_planes, surface.half_planes + 1)
    last_alone = [p.capacity / -p.a_normal for p in pieces[: surface.half_planes]]
    closes = min(last_alone) > surface.pull_off_limit * (1.0 + 1e-9)
    if surface.pull_off_angle < math.pi / 2 - 1e-6:
        assert closes == (len(pieces) == surface.half_planes + 1)


def test_the_closing_chord_by_hand():
    """f_max = f_min = 10 N, φ_max = 45°: the curve is a circle; one chord alone leaves it."""
    surface = Surface(10.0, 10.0, math.pi / 4, 5.0, 0.0)
    shear, first, closing = inner_half_planes(surface)
    assert shear.limit == "shear"
    assert (first.limit, closing.limit) == ("pull_off", "pull_off")
    assert first.a_shear / -first.a_normal == pytest.approx(
        math.sin(math.pi / 4) / (1.0 - math.cos(math.pi / 4))
    )
    assert closing.capacity / -closing.a_normal == pytest.approx(10.0)


def test_one_half_plane_is_the_papers_straight_line():
    """T + k P = T_max through (T_max, 0) and 0.3109 T_max at 45°: k = √2 / 0.3109 − 1.

    It is the one that the gripper was given, from Figs. 12 to 14.
    """
    surface = Surface.named("sandpaper-36")
    _, line = inner_half_planes(surface)
    slope = -line.a_normal / line.a_shear
    assert slope == pytest.approx(math.sqrt(2.0) / 0.3109 - 1.0, rel=1e-9)
    assert slope == pytest.approx(experiment_table().scalar("gripper", "pull_off_slope"), abs=5e-4)
    assert line.capacity / line.a_shear == pytest.approx(19.45)
    assert math.hypot(line.a_shear, line.a_normal) == pytest.approx(1.0)
    # T + 4 P, which the extents of Fig. 13 alone give
    steeper = replace(surface, pull_off_limit=math.sqrt(2.0) / 5.0 * surface.shear_limit)
    _, line = inner_half_planes(steeper)
    assert -line.a_normal / line.a_shear == pytest.approx(4.0, rel=1e-9)


# Out of the finger plane -------------------------------------------------------------------------


def test_strength_out_of_the_finger_plane_by_hand():
    """60 N along, 30 N sideways; at φ_max = 60°, 20 N along and a share of ½ · 0.4 sideways."""
    surface = Surface(60.0, 20.0, math.radians(60.0), 30.0, 0.0, lateral_pull_off_ratio=0.4)
    flat = surface.strength(0.0, np.radians([0.0, 60.0, 90.0, -60.0, 120.0]))
    np.testing.assert_allclose(flat, [60.0, 45.0, 30.0, 45.0, 30.0])
    # 1 − (1 − 0.2) cos 60° = 0.6; half way in φ: 40 N, 1 − (1 − 0.35) cos 30°
    sideways = surface.strength(np.radians([60.0, 30.0, 90.0]), math.pi / 2)
    half_way = 40.0 * (1.0 - 0.65 * math.sqrt(0.75))
    np.testing.assert_allclose(sideways, [12.0, half_way, 20.0], atol=1e-12)
    # pressed at 45° with a gain of ½: Y = 30 + N / 2 and N = Y
    pressed = replace(surface, compression_gain=0.5).strength(-math.pi / 4, math.pi / 2)
    assert pressed == pytest.approx(60.0 * math.sqrt(2.0))


@given(surfaces(laws))
def test_strength_is_the_boat_shaped_surface(surface):
    directions = random_directions(500)
    angle = np.arcsin(-directions[:, 1])
    azimuth = np.arctan2(directions[:, 2], directions[:, 0])
    np.testing.assert_allclose(
        surface.strength(angle, azimuth),
        boat(surface, directions),
        rtol=1e-9,
    )


@pytest.mark.parametrize("name", surface_names())
@pytest.mark.parametrize("count", [1, 2, 8])
def test_on_ten_thousand_directions_inner_bounds_stay_in_and_outer_out(name, count):
    surface = replace(Surface.named(name), half_planes=count)
    directions = random_directions(10_000)
    exact = boat(surface, directions)
    assert (directional_strength(inner_half_planes(surface), directions) <= exact).all()
    assert (directional_strength(outer_half_planes(surface), directions) >= exact).all()


@given_some(8, 150, surfaces(laws), st.integers(0, 1000))
def test_bounds_hold_on_any_surface_and_where_they_touch_it(surface, seed):
    directions = np.concatenate([random_directions(2000, seed), edge_directions(surface)])
    exact = boat(surface, directions)
    assert (
        directional_strength(inner_half_planes(surface), directions) <= exact * (1.0 + 1e-9)
    ).all()
    assert (
        directional_strength(outer_half_planes(surface), directions) >= exact * (1.0 - 1e-9)
    ).all()


def test_a_chord_across_a_dent_is_moved_inward_until_it_touches():
    """Strength that falls with the root of the angle: half-planes lie inside all the same."""
    rock = replace(Surface.named("rock"), pull_off_exponent=0.5)
    ends = rock.straight_strength(np.array([0.0, rock.pull_off_angle]))
    for count in (1, 2, 5):
        _, *pieces = rock.inner(count)
        for i, piece in enumerate(pieces[:count]):
            angles = np.linspace(i, i + 1, 20_001) / count * rock.pull_off_angle
            reaches = piece.capacity / (
                piece.a_shear * np.cos(angles) - piece.a_normal * np.sin(angles)
            )
            kept = (reaches / law(rock, angles)).max()
            assert 1.0 - 3e-4 <= kept <= 1.0 + 1e-12
        # where the curve begins to fall at once, a chord through its ends would be outside
        first = pieces[0]
        assert first.capacity / first.a_shear < ends[0] * (0.999 if count == 5 else 0.99)


@given_some(12, 200, surfaces(laws), st.integers(0, 10**6))
def test_excess_is_what_a_load_is_beyond_the_surface(surface, seed):
    directions = random_directions(200, seed)
    reaches = boat(surface, directions)
    directions, reaches = directions[reaches < 1e6], reaches[reaches < 1e6]
    for size in (0.5, 1.0, 1.5):
        found = surface.excess(*(size * reaches * directions.T))
        np.testing.assert_allclose(found, (size - 1.0) * reaches, rtol=1e-6, atol=1e-6)


@given_some(8, 60, surfaces())
def test_no_bound_could_be_nearer_to_the_surface(surface):
    """Every lateral coefficient and every outer capacity is as good as its normal allows."""
    directions = np.concatenate([random_directions(2000), edge_directions(surface)])
    directions = directions[(directions[:, 1] <= 0.0) & (np.abs(directions[:, 2]) > 1e-3)]
    points = boat(surface, directions)[:, None] * np.abs(directions)
    for piece in outer_half_planes(surface):
        loads = points @ [piece.a_shear, -piece.a_normal, piece.a_lateral]
        assert loads.max() >= piece.capacity * 0.97
    inner = directional_strength(inner_half_planes(surface), directions)
    slack = inner / np.linalg.norm(points, axis=1)
    assert slack.max() >= 0.97


GAPS = {1: (0.100, 3.79), 2: (0.295, 1.71), 4: (0.474, 1.46), 8: (0.501, 1.42)}
"""Volumes within the inner and the outer half-planes, over that within the surface, rounded."""


@pytest.mark.parametrize("count", GAPS)
def test_the_gap_between_the_bounds_is_as_stated(count):
    directions = np.abs(random_directions(100_000)) * [1.0, -1.0, 1.0]
    gap = bounds_gap(replace(Surface.named("rock"), half_planes=count), directions)
    assert (gap.inner_volume, gap.outer_volume) == pytest.approx(GAPS[count], rel=0.01)
    assert gap.inner_worst < gap.inner_volume ** (1.0 / 3.0) < 1.0
    assert gap.outer_worst > gap.outer_volume ** (1.0 / 3.0) > 1.0


def test_the_gap_around_a_ball_by_hand():
    """Without pull-off or lateral loss the surface is a sphere of 10 N, of π / 6 in the octant."""
    surface = Surface(10.0, 10.0, math.pi / 2, 10.0, 0.0)
    directions = np.abs(random_directions(100_000)) * [1.0, -1.0, 1.0]
    gap = bounds_gap(surface, directions)
    # inside, the octahedron T + P + |Y| ≤ 10; outside, its faces √3 times as far
    assert gap.inner_volume == pytest.approx((1.0 / 6.0) / (math.pi / 6.0), rel=0.01)
    assert gap.inner_worst == pytest.approx(1.0 / math.sqrt(3.0), rel=0.01)
    assert gap.outer_worst == pytest.approx(math.sqrt(3.0), rel=0.02)


def test_what_one_straight_line_costs_sideways():
    """Straight sideways, rock holds 0.87 of its shear; convex pieces keep 0.24 to 0.87 of it."""
    rock = Surface.named("rock")
    sideways = np.array([[0.0, 0.0, 1.0]])
    reaches = [
        directional_strength(inner_half_planes(replace(rock, half_planes=k)), sideways)[0]
        for k in (1, 2, 4, 8)
    ]
    assert np.array(reaches) / 68.1 == pytest.approx([0.244, 0.370, 0.692, 0.866], abs=2e-3)
    assert rock.strength(0.0, math.pi / 2) == pytest.approx(rock.lateral_limit)
    # T + k P + a |Y| ≤ 1, with the least a that leaves no direction outside the surface
    directions = np.abs(random_directions(100_000)) * [1.0, -1.0, 1.0]
    shear, normal, lateral = directions[np.abs(directions[:, 2]) > 1e-3].T
    exact = boat(rock, np.column_stack([shear, normal, lateral])) / 68.1
    least = ((1.0 / exact - shear + (math.sqrt(2.0) / 0.3109 - 1.0) * normal) / lateral).max()
    assert reaches[0] / 68.1 == pytest.approx(1.0 / least, rel=0.01)


@given_some(8, 50, surfaces(laws))
def test_purely_sideways_no_piece_goes_beyond_the_lateral_limit(surface):
    for piece in inner_half_planes(surface):
        assert 0.0 < piece.capacity / piece.a_lateral <= surface.lateral_limit * (1.0 + 1e-9)


def test_pressing_raises_the_shear_limit_by_the_compression_gain():
    (shear, *_) = inner_half_planes(replace(Surface.named("rock"), compression_gain=0.2))
    assert shear.capacity - shear.a_normal * 100.0 == pytest.approx(68.1 + 0.2 * 100.0)


def test_presets_are_ordered_from_sandpaper_to_rock():
    names = ["sandpaper-36", "concrete-fine", "concrete-coarse", "rock"]
    assert sorted(surface_names()) == sorted(names)
    limits = [Surface.named(name).shear_limit for name in names]
    assert limits == sorted(limits)
    assert len(set(limits)) == 4
    # "The maximum force on rock is typically 2-5 times greater" (Section 6)
    assert 2.0 <= limits[3] / limits[0] <= 5.0


@pytest.mark.parametrize(
    ("name", "scatter"),
    [("concrete-fine", 8.5), ("concrete-coarse", 18.0), ("sandpaper-36", 5.02), ("rock", 24.8)],
)
def test_presets_carry_their_scatter(name, scatter):
    assert Surface.named(name).shear_scatter == pytest.approx(scatter, rel=0.005)


def test_an_unknown_preset_is_answered_with_the_known_ones():
    with pytest.raises(InvalidInputError, match=r"granite.*sandpaper-36.*rock"):
        Surface.named("granite")


def test_own_values_follow_from_shear_alone_by_the_default_ratios():
    own, preset = Surface.from_values({"shear_limit": 68.1}), Surface.named("rock")
    assert own == preset
    other = Surface.from_values({"shear_limit": 68.1, "lateral_limit": 7.0, "half_planes": 3})
    assert other == replace(preset, lateral_limit=7.0, half_planes=3)


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({}, "shear_limit"),
        ({"shear_limit": 0.0}, "shear_limit"),
        ({"shear_limit": -1.0}, "shear_limit"),
        ({"shear_limit": math.nan}, "shear_limit"),
        ({"shear_limit": math.inf}, "shear_limit"),
        ({"shear_limit": 60.0, "pull_off_limit": 61.0}, "pull_off_limit"),
        ({"shear_limit": 60.0, "pull_off_limit": 0.0}, "pull_off_limit"),
        ({"shear_limit": 60.0, "lateral_limit": 0.0}, "lateral_limit"),
        ({"shear_limit": 60.0, "pull_off_angle": 0.0}, "pull_off_angle"),
        ({"shear_limit": 60.0, "pull_off_angle": 1.6}, "pull_off_angle"),
        ({"shear_limit": 60.0, "compression_gain": -0.1}, "compression_gain"),
        ({"shear_limit": 60.0, "compression_gain": math.nan}, "compression_gain"),
        ({"shear_limit": 60.0, "shear_scatter": -1.0}, "shear_scatter"),
        ({"shear_limit": 60.0, "shear_scatter": 6001.0}, "shear_scatter"),
        ({"shear_limit": 60.0, "lateral_pull_off_ratio": 0.0}, "lateral_pull_off_ratio"),
        ({"shear_limit": 60.0, "lateral_pull_off_ratio": 1.1}, "lateral_pull_off_ratio"),
        ({"shear_limit": 60.0, "pull_off_exponent": 0.0}, "pull_off_exponent"),
        ({"shear_limit": 60.0, "pull_off_exponent": -1.0}, "pull_off_exponent"),
        ({"shear_limit": 60.0, "pull_off_exponent": 11.0}, "pull_off_exponent"),
        ({"shear_limit": 60.0, "pull_off_exponent": math.nan}, "pull_off_exponent"),
        ({"shear_limit": 60.0, "half_planes": 0}, "half_planes"),
        ({"shear_limit": 60.0, "half_planes": 65}, "half_planes"),
        ({"shear_limit": 60.0, "half_planes": 2.5}, "half_planes"),
        ({"shear_limit": 60.0, "shear": 1.0}, "shear"),
    ],
)
def test_impossible_surfaces_are_refused_by_field(values, field):
    with pytest.raises(InvalidInputError) as caught:
        Surface.from_values(values)
    assert caught.value.field == field


@pytest.mark.parametrize("count", [2, 2.0, 64])
def test_a_whole_number_of_half_planes_is_used(count):
    surface = Surface.from_values({"shear_limit": 60.0, "half_planes": count})
    assert len([p for p in inner_half_planes(surface) if p.limit == "pull_off"]) >= count


def test_more_strength_under_pressing_never_costs_strength_under_pull_off():
    plain = Surface.from_values({"shear_limit": 60.0})
    for gain in (0.5, 3.9, 4.1, 20.0):
        gained = replace(plain, compression_gain=gain)
        assert (reach(gained, DIRECTIONS) >= reach(plain, DIRECTIONS) * (1.0 - 1e-12)).all()


def test_a_surface_that_no_spines_can_give_is_refused_and_one_that_breaks_them_warned_of():
    refused = (
        ({"shear_limit": 60.0, "lateral_limit": 6000.0}, "lateral_limit", "at most 2 times"),
        ({"shear_limit": 60.0, "compression_gain": 1000.0}, "compression_gain", "at most 20"),
    )
    for values, field, words in refused:
        with pytest.raises(InvalidInputError, match=words) as caught:
            Surface.from_values(values)
        assert caught.value.field == field
    # 40 spines of 70 N
    assert Surface.from_values({"shear_limit": 2800.0}).strongest_tile is None
    assert Surface.from_values({"shear_limit": 1e5}).strongest_tile == 2800.0
