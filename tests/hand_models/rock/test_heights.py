"""Heights of rock across a finger, against rays, finer triangles and shapes worked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hand_models.rock import Mesh
from hand_models.rock.compiled_heights import facing_triangles, heights_across, rock_ends
from hand_models.rock.compiled_outlines import least_heights, raised_outlines, seen_outlines
from hand_models.rock.surface import Triangles
from hand_models.rock.triangles import weld
from tests.suite.helpers.hands import HAND
from tests.suite.helpers.rocks import fractal_wall, random_mesh
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)
PLACES = np.linspace(-0.1, 0.1, 401)
HALVES, LINES = np.array([0.010, 0.0145]), np.linspace(-0.009, 0.009, 7)
SIZE = HAND.finger.size
LEVEL = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def heights(rock: Triangles, plane: np.ndarray, some: np.ndarray | None = None) -> np.ndarray:
    some = np.arange(len(rock.faces)) if some is None else some
    seen = facing_triangles(*rock, some, plane, HALVES.max(), 0.1)
    return heights_across(seen, PLACES, HALVES, LINES, 1e-9)


def tilted(rng: np.random.Generator) -> np.ndarray:
    """Origin and axes of a plane near z = 0, turned about z and tilted by some 10 degrees."""
    turn = Rotation.from_euler("ZYX", [rng.uniform(-3.0, 3.0), *rng.normal(0.0, 0.15, 2)])
    axes = turn.as_matrix()
    return np.array([rng.normal(0.0, 0.01, 3), axes[:, 0], axes[:, 2]])


@given_some(2, 30, seeds)
def test_heights_are_where_rays_enter_the_rock(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rock = Mesh(*fractal_wall(seed % 1000, size=0.4, count=91, height=0.006), anywhere=True)
    plane = tilted(rng)
    origin, s, t = plane
    across = np.cross(t, s)
    found = heights(rock.triangles, plane)

    def rays(y: float) -> np.ndarray:
        begins = origin + PLACES[:, None] * s + y * across - 0.1 * t
        where = np.array(rock.entries(begins, t)) - 0.1
        return np.where(np.abs(where) <= 0.1, where, np.inf)

    for line, y in zip(found[2:], LINES.tolist(), strict=True):
        np.testing.assert_allclose(line, rays(y), atol=1e-9)
    for row, half in zip(found, HALVES.tolist(), strict=False):
        least = np.min([rays(y) for y in np.linspace(-half, half, 201).tolist()], axis=0)
        # between two of these lines the rock may stand out a little more
        assert (row <= least + 1e-9).all()
        assert (row >= least - 3e-4).all()


def test_heights_do_not_depend_on_how_rock_is_divided_or_ordered() -> None:
    import trimesh

    rng = np.random.default_rng(3)
    rock = weld(Triangles(*map(np.array, fractal_wall(5, size=0.3, count=41, height=0.006))))
    plane = tilted(rng)
    want = heights(rock, plane)
    finer = Triangles(*trimesh.remesh.subdivide(*rock))
    faces = np.ascontiguousarray(finer.faces[rng.permutation(len(finer.faces))])
    divided = Triangles(np.ascontiguousarray(finer.vertices), faces)
    np.testing.assert_allclose(heights(divided, plane), want, atol=1e-12)
    order = rng.permutation(len(rock.faces))
    np.testing.assert_array_equal(heights(rock, plane, order), want)


def test_the_back_of_triangles_is_not_seen() -> None:
    vertices, faces = fractal_wall(1, size=0.3, count=21)
    back = Triangles(vertices, np.ascontiguousarray(faces[:, ::-1]))
    assert np.isinf(heights(back, LEVEL)).all()


def overhanging(rng: np.random.Generator) -> np.ndarray:
    """An outline that goes to and fro along s while t grows, but not at its ends."""
    u = np.linspace(0.0, 1.0, 120)
    waves = rng.uniform(0.0, 0.02) * np.sin(rng.uniform(5.0, 30.0) * u + 1.0) * np.sin(math.pi * u)
    return np.column_stack([0.15 * (u - 0.5) + waves, 0.05 * u + 1e-5 * np.cumsum(rng.random(120))])


@given_some(20, 200, seeds)
def test_what_is_seen_of_an_outline_is_its_least_t_everywhere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    line = overhanging(rng)
    if seed % 2:
        # under lips that end the rock toward −s fingers reach before their joint only
        line = np.ascontiguousarray((line * [-1.0, 1.0])[::-1]) + np.array([0.1, 0.0])
    points, stops, hidden = seen_outlines(line, np.array([len(line)]), math.inf)
    assert (np.diff(points[:, 0]) >= 0.0).all()
    at = np.linspace(line[:, 0].min(), line[:, 0].max(), 997)[1:-1]
    begin, end = line[:-1], line[1:]
    low, high = np.minimum(begin[:, 0], end[:, 0]), np.maximum(begin[:, 0], end[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (at[:, None] - begin[:, 0]) / (end[:, 0] - begin[:, 0])
    t = begin[:, 1] + part * (end[:, 1] - begin[:, 1])
    crossed = (at[:, None] >= low) & (at[:, None] <= high)
    # rock that is seen has its outline going forward
    crossed &= end[:, 0] > begin[:, 0]
    want = np.where(crossed, t, np.inf).min(axis=1)
    np.testing.assert_allclose(least_heights(points, stops, at), want, atol=1e-12)
    lips = np.maximum.accumulate(line[:, 0]) - line[:, 0]
    if seed % 2:
        lips = line[:, 0] - np.minimum.accumulate(line[::-1, 0])[::-1]
    assert hidden == pytest.approx(lips.max(), abs=1e-12)


def test_an_overhang_is_closed_by_an_upright_piece() -> None:
    # a roof that ends at s = 3, rock 1 under it from s = 1 on
    roof = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 0.2], [1.0, 0.2], [1.0, 1.0], [5.0, 1.0]])
    points, _, hidden = seen_outlines(roof, np.array([6]), math.inf)
    assert hidden == pytest.approx(2.0)
    np.testing.assert_allclose(points, [[0, 0], [3, 0], [3, 0.2], [3, 1], [5, 1]])
    mirrored = np.ascontiguousarray((roof * [-1.0, 1.0])[::-1]) + np.array([5.0, 0.0])
    points, _, hidden = seen_outlines(mirrored, np.array([6]), math.inf)
    assert hidden == pytest.approx(2.0)
    np.testing.assert_allclose(points, [[0, 1], [2, 1], [2, 0.2], [2, 0], [5, 0]])


@pytest.mark.parametrize(
    ("begin", "facing", "reach", "hidden"),
    [
        # a lip at s = 3, rock 1 under it from s = 1 on; the outline passes s = 1 at t = 0.2
        (0.0, 1.0, math.inf, 2.0),
        (0.0, 1.0, 3.1, 2.0),
        # no finger passes a lip beyond its reach
        (0.0, 1.0, 2.9, 0.0),
        # a finger curls back under a lip behind its joint, as far as it reaches
        (-4.0, 1.0, math.inf, 2.0),
        (-4.0, 1.0, math.hypot(2.5, 0.2), 1.5),
        # it does not turn away from its hand: under such a lip it reaches before its joint only
        (-5.0, -1.0, math.inf, 0.0),
        (-3.5, -1.0, math.inf, 0.5),
        (1.0, -1.0, math.inf, 2.0),
        (1.0, -1.0, math.hypot(4.0, 0.2), 1.0),
    ],
)
def test_overhangs_hide_rock_where_a_finger_reaches_it(
    begin: float, facing: float, reach: float, hidden: float
) -> None:
    roof = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 0.2], [1.0, 0.2], [1.0, 1.0], [5.0, 1.0]])
    if facing < 0.0:
        roof = (roof * [-1.0, 1.0])[::-1] + np.array([5.0, 0.0])
    line = np.ascontiguousarray(roof + np.array([begin, 0.0]))
    assert seen_outlines(line, np.array([6]), reach)[2] == pytest.approx(hidden, abs=1e-12)


def sheet(low: float, high: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[low, -0.3, z], [low, 0.3, z], [high, 0.3, z], [high, -0.3, z]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def test_rock_behind_other_rock_changes_nothing() -> None:
    front, faces = fractal_wall(2, size=0.4, count=61, height=0.004)
    behind = fractal_wall(3, size=0.4, count=61, height=0.004)[0] + [0.0, 0.0, 0.03]
    alone = Mesh(front, faces, anywhere=True).finger_rock(*LEVEL, SIZE)
    both = Mesh(np.vstack([behind, front]), np.vstack([faces, faces + len(front)]), anywhere=True)
    for one, other in zip(alone.sections, both.finger_rock(*LEVEL, SIZE).sections, strict=True):
        np.testing.assert_allclose(np.vstack(other.pieces), np.vstack(one.pieces), atol=1e-12)


def test_what_stands_out_beside_a_sliver_in_the_plane_is_met() -> None:
    """Two sheets 6 mm before the plane's only rock, which is 0.2 mm wide."""
    left, faces = sheet(-0.2, 0.2, 0.0)
    beside = np.array([0.0, 0.304, 0.0])
    ribs = [left + beside, left - beside]
    sliver = left * [5e-4, 5e-3, 0.0] + [0.0101, 0.0, 0.006]
    vertices, triangles = np.vstack([*ribs, sliver]), np.vstack([faces, faces + 4, faces + 8])
    rock = Mesh(vertices, triangles, anywhere=True).finger_rock(*LEVEL, SIZE)
    for section in rock.sections:
        np.testing.assert_allclose(np.vstack(section.pieces)[:, 1], 0.0, atol=1e-12)


@given_some(5, 40, seeds)
def test_a_boulder_is_met_alike_whichever_of_its_triangles_comes_first(seed: int) -> None:
    """Its outline in a plane is a ring, which begins at some triangle."""
    rng = np.random.default_rng(seed)
    rock, plane = random_mesh(rng), LEVEL.copy()
    plane[0] = [rng.uniform(-0.05, 0.05), 0.0, -0.01]
    met, (vertices, faces) = rock.finger_rock(*plane, SIZE), rock.triangles
    if not len(met.strips.across) > 1:
        # only the cut is smoothed, from where its ring begins
        return
    for _ in range(3):
        again = Mesh(vertices, rng.permutation(faces)).finger_rock(*plane, SIZE)
        for one, other in zip(met.sections, again.sections, strict=True):
            for one_piece, piece in zip(one.pieces, other.pieces, strict=True):
                np.testing.assert_allclose(piece, one_piece, atol=1e-9)


def test_a_place_on_an_edge_of_rock_has_rock() -> None:
    for low, high in ((0.0, 0.2), (-0.2, 0.0)):
        vertices, faces = sheet(low, high, 0.0)
        found = heights(Triangles(vertices, faces), LEVEL)
        np.testing.assert_array_equal(found[:, 200], 0.0)


@pytest.mark.parametrize("turn", [0.0, 0.2, -0.4])
def test_rock_ends_where_its_triangles_do(turn: float) -> None:
    end, half = 0.0601, 0.0145
    corners = np.array([[-0.3, -0.3, 0.0], [-0.3, 0.3, 0.0], [end, 0.3, 0.0], [end, -0.3, 0.0]])
    c, s = math.cos(turn), math.sin(turn)
    plate = Triangles(
        corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    least = heights(plate, LEVEL)[1]
    seen = facing_triangles(*plate, np.arange(2), LEVEL, half, 0.1)
    (ends,) = rock_ends(seen, PLACES, np.array([[-half, half]]), least[None], 0.005)
    (last,) = np.flatnonzero(~np.isnan(ends[1, :, 0]))
    assert np.isnan(ends[0]).all()
    # its edge is the line s cos + y sin = end
    assert ends[1, last, 0] == pytest.approx((end + half * abs(s)) / c, abs=1e-12)
    outline, stops = raised_outlines(np.zeros((0, 2)), PLACES, least, least, ends, 0.005, 1e-9)
    assert len(stops) == 1
    np.testing.assert_allclose(outline[-1], [(end + half * abs(s)) / c, 0.0], atol=1e-12)


@given_some(20, 200, seeds)
def test_corners_between_places_are_raised_no_farther_than_the_envelope_falls(
    seed: int,
) -> None:
    """However steep the rock is: on a face that is all but upright a spike would be centimetres."""
    rng = np.random.default_rng(seed)
    fall = 10.0 ** rng.uniform(-4.0, -1.5, len(PLACES) - 1) * rng.choice([-1.0, 1.0])
    own = np.cumsum(np.append(0.0, fall))
    least = own - rng.uniform(0.0, 0.03) * rng.random(len(own))
    alike = rng.random(len(own)) < 0.5
    least[alike] = own[alike]
    cell = np.sort(rng.integers(0, len(PLACES) - 1, 300))
    s = PLACES[cell] + rng.uniform(0.05, 0.95, 300) * np.diff(PLACES)[cell]
    cell, s = cell[np.argsort(s)], np.sort(s)
    (low, high), (first, last) = (
        np.sort([each[cell], each[cell + 1]], axis=0) for each in (own, least)
    )
    t = low + rng.uniform(-0.5, 1.5, 300) * (high - low)
    ends = np.full((2, len(PLACES), 2), np.nan)
    outline, _ = raised_outlines(np.column_stack([s, t]), PLACES, own, least, ends, 0.005, 0.0)
    corners = outline[np.isin(outline[:, 0], s)]
    np.testing.assert_array_equal(corners[:, 0], s)
    raised, slack = corners[:, 1], 1e-12
    assert (raised <= t + slack).all()
    # no farther off than the envelope itself falls there, and half a place
    off = last - first + 0.5 * np.diff(PLACES)[cell] + slack
    assert (raised >= first - np.maximum(low - t, 0.0) - off).all()
    assert (raised <= last + np.maximum(t - high, 0.0) + off).all()
    same = alike[cell] & alike[cell + 1]
    assert same.any()
    np.testing.assert_allclose(raised[same], t[same], atol=slack)
