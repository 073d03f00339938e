"""Holds of triangles: cut, smoothed and mended, against shapes that have formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from hand_models import Cylinder, Grasp, InvalidInputError, Plane, Pose
from hand_models.rock import Mesh, Triangles, read_mesh, weld
from hand_models.rock.smoothing import Scale, smooth
from hand_models.rock.triangles import bridge, cut, without_spikes, wound_alike
from hand_models.sections import PolylineSection
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import (
    cylinder_mesh,
    distance,
    random_axes,
    random_mesh,
    random_profile,
)
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)
X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def sheet(height=lambda x, y: 0.0 * x, half=0.25, count=51):
    """An open sheet of triangles over x and y, seen from the palm."""
    line = np.linspace(-half, half, count)
    x, y = (v.ravel() for v in np.meshgrid(line, line, indexing="ij"))
    i = np.arange(count**2).reshape(count, count)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[1:, :-1], i[:-1, 1:], i[1:, 1:]))
    faces = np.vstack([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    return np.column_stack([x, y, height(x, y)]), faces


def log(x, y, radius=0.15):
    return radius - np.sqrt(np.maximum(radius**2 - x**2, 0.0))


# The same hand as on the shape itself -------------------------------------------------------------


@pytest.mark.parametrize("around", [128, 256, 720])
@pytest.mark.parametrize("rotation", [0.0, 1.0, math.pi])
def test_a_meshed_cylinder_is_the_cylinder(around, rotation):
    want = HAND.settle(Cylinder(0.3), ROCK, Grasp(rotation))
    got = HAND.settle(Mesh(*cylinder_mesh(0.3, around)), ROCK, Grasp(rotation))
    assert got.tiles == want.tiles
    assert got.palm.engaged == want.palm.engaged
    np.testing.assert_allclose(got.seating.pose.position, want.seating.pose.position, atol=1e-4)
    np.testing.assert_allclose(got.positions, want.positions, atol=2e-4)


@pytest.mark.parametrize("rotation", [0.0, 2.0])
def test_a_meshed_wall_is_the_wall(rotation):
    want = HAND.settle(Plane(), ROCK, Grasp(rotation))
    got = HAND.settle(Mesh(*sheet()), ROCK, Grasp(rotation))
    assert got.tiles == want.tiles
    assert got.seating.rule == "flat"
    # the path's bed reaches beyond the tile's ends a little
    np.testing.assert_allclose(got.positions, want.positions, atol=2e-4)
    np.testing.assert_allclose(got.loads, want.loads, atol=0.15)


@pytest.mark.parametrize("turn", [0.3, 1.2])
def test_it_may_be_placed_anyhow(turn):
    tilt = Rotation.from_rotvec([0.05, -0.04, turn]).as_matrix()
    pose = Pose(np.array([0.01, 0.005, 0.004]), tilt)
    want = HAND.settle(Cylinder(0.3), ROCK, Grasp(0.7), pose)
    got = HAND.settle(Mesh(*cylinder_mesh(0.3, 512, 2.0)), ROCK, Grasp(0.7), pose)
    np.testing.assert_allclose(got.positions, want.positions, atol=3e-4)
    np.testing.assert_allclose(got.palm.gaps, want.palm.gaps, atol=3e-5)


def test_rough_rock_holds_a_tile_off_by_its_roughness():
    rng = np.random.default_rng(1)
    rough = sheet(lambda x, y: log(x, y) + rng.uniform(-2e-4, 2e-4, x.shape), 0.2, 201)
    smooth_hand = HAND.settle(Cylinder(0.3), ROCK, Grasp(math.pi), Pose.identity())
    rough_hand = HAND.settle(Mesh(*rough), ROCK, Grasp(math.pi), Pose.identity())
    first = [hand.fingers[1].contacts[0].angle for hand in (smooth_hand, rough_hand)]
    # 0.1 to 0.4 mm higher at 25 mm from the joint
    assert -0.4e-3 / 0.02 < first[1] - first[0] < -0.05e-3 / 0.03


# Cuts ---------------------------------------------------------------------------------------------


@given_some(8, 60, seeds)
def test_a_cut_is_the_surface_in_its_plane_with_the_rock_on_its_left(seed):
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng)
    axes = random_axes(rng, 3.0)
    origin = hold.triangles.vertices.mean(axis=0) + rng.uniform(-0.02, 0.02, 3)
    pieces = cut(hold.triangles, origin, axes[:, 0], axes[:, 2], 10.0)
    assert all(np.array_equal(piece[0], piece[-1]) for piece in pieces)

    def in_hold(points):
        return origin + points[:, :1] * axes[:, 0] + points[:, 1:] * axes[:, 2]

    on_rock = np.concatenate(pieces)[::5]
    np.testing.assert_allclose(distance(hold, in_hold(on_rock)), 0.0, atol=1e-9)
    points = rng.uniform(-0.5, 0.5, (60, 2))
    clear = PolylineSection(pieces).clearances(points @ [1.0, 1j])
    want = distance(hold, in_hold(points))
    assert (np.sign(clear) == np.sign(want)).all()
    assert (np.abs(clear) >= np.abs(want) - 1e-9).all()


def test_a_plane_through_vertices_cuts_as_one_beside_them():
    vertices, faces = sheet(log)
    assert 0.0 in vertices[:, 1]
    at, beside = (
        cut(Triangles(vertices, faces), np.array([0.0, y, 0.0]), X, Z, 1.0) for y in (0.0, 1e-9)
    )
    assert len(at) == len(beside) == 1
    grid = np.linspace(-0.1, 0.1, 101)
    depths = [np.interp(grid, pieces[0][:, 0], pieces[0][:, 1]) for pieces in (at, beside)]
    np.testing.assert_allclose(depths[0], depths[1], atol=1e-7)


@pytest.mark.parametrize("diameter", [0.3, 0.06])
@pytest.mark.parametrize("around", [128, 1000])
def test_smoothing_keeps_the_radius_of_a_cylinder(diameter, around):
    radius = diameter / 2.0
    (ring,) = cut(Triangles(*cylinder_mesh(diameter, around)), np.zeros(3), X, Z, 1.0)
    curve = smooth(ring, Scale.of())
    assert np.abs(np.hypot(curve[:, 0], curve[:, 1] - radius) - radius).max() < 5e-5


def test_a_corner_is_rounded_at_the_scale_of_a_tile_and_never_cut():
    corner = np.array([[-0.1, 0.1], [0.0, 0.0], [0.1, 0.1]])
    section = PolylineSection([smooth(corner, Scale.of())])
    line = np.linspace(-0.09, 0.09, 1001)
    off = section.clearances(line + 1j * np.abs(line))
    assert off.max() < 2e-5
    assert off.min() > -2e-3
    assert off[np.abs(line) > 0.05].min() > -1e-4


@given(seeds)
def test_no_raw_rock_stands_out_of_a_smoothed_cut(seed):
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(-0.2, 0.2, 80))
    raw = np.column_stack([x, 0.05 * rng.random() * np.abs(x) + 4e-3 * rng.random(80)])
    curve = smooth(raw, Scale.of())
    inner = np.abs(raw[:, 0]) < 0.15
    assert PolylineSection([curve]).clearances(raw[inner] @ [1.0, 1j]).max() < 1e-4


def test_cuts_that_begin_a_micrometre_on_are_smoothed_alike():
    """As long as half a step more than whole ones; some rough ones are raised once more, or not."""
    scale, moved = Scale.of(), []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x = np.sort(rng.uniform(-0.2, 0.2, 80))
        raw = np.column_stack([x, 0.05 * rng.random() * np.abs(x) + 4e-3 * rng.random(80)])
        along = (raw[1] - raw[0]) / np.hypot(*(raw[1] - raw[0]))
        odd = np.hypot(*np.diff(raw, axis=0).T).sum() / scale.spacing - 0.5
        raw[0] -= along * ((math.ceil(odd) - odd) * scale.spacing + 0.5e-6)
        on = np.vstack([raw[0] + 1e-6 * along, raw[1:]])
        curve, other = (smooth(each, scale) for each in (raw, on))
        inner = curve[np.abs(curve[:, 0]) < 0.15] @ [1.0, 1j]
        moved.append(np.abs(PolylineSection([other]).clearances(inner)).max())
    assert np.quantile(moved, 0.85) < 0.5e-6


@given_some(5, 60, seeds)
def test_entry_is_where_a_line_first_meets_the_rock(seed):
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng)
    direction = random_axes(rng, 0.5)[:, 2]
    point = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.05)])
    outside = distance(hold, point[None])[0] > 0.0
    found = hold.entry(point, direction)
    steps = np.linspace(0.0, 3.0, 800)
    along = distance(hold, point + steps[:, None] * direction)
    if not math.isfinite(found):
        assert along.min() > 0.0
        return
    assert distance(hold, (point + found * direction)[None])[0] == pytest.approx(0.0, abs=1e-9)
    if outside:
        assert found > 0.0
        assert along[steps < found].min(initial=1.0) > -1e-9


def test_a_palm_inside_the_rock_is_told_how_deep():
    hold = Mesh(*cylinder_mesh(0.3, 1000))
    assert hold.entry([0.0, 0.0, 0.003], Z) == pytest.approx(-0.003, abs=1e-5)
    # past the rock there is none ahead
    assert hold.entry([0.0, 0.0, 0.35], Z) == math.inf


def assert_on_rock(seed):
    """That tiles of a hand on a random mesh or profile are on it, and not in it."""
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng) if rng.random() < 0.6 else random_profile(rng)
    settled = HAND.settle(hold, ROCK, Grasp(float(rng.choice([0.0, 1.0, math.pi]))))
    in_hold = settled.seating.pose.inverse()
    for frame, finger in zip(
        HAND.frames(settled.grasp.outer_rotation), settled.fingers, strict=True
    ):
        for contact in finger.contacts:
            u = np.array([math.cos(contact.angle), math.sin(contact.angle)])
            along = np.linspace(*finger.model.tile_range, 25)[:, None]
            place = np.asarray(contact.joint) + along * u
            place += finger.model.tile_height * np.array([-u[1], u[0]])
            middle = frame.joint + np.column_stack([place[:, :1] * frame.along[:2], place[:, 1]])
            if contact.kind != "none" and contact.stop != "lower":
                assert distance(hold, in_hold.apply(middle)).min() > -1e-4
            if contact.kind in ("face", "edge"):
                aside = np.linspace(-0.0107, 0.0107, 9)[:, None, None] * frame.across
                assert distance(hold, in_hold.apply(middle + aside)).min() < 5.5e-3


@given_some(5, 50, seeds)
def test_tiles_rest_on_the_rock_and_not_in_it(seed):
    assert_on_rock(seed)


@pytest.mark.parametrize("seed", [45, 90, 103, 7984, 16176])
def test_fingers_curl_under_boulders_behind_their_joints(seed):
    assert_on_rock(seed)


@pytest.mark.parametrize("seed", [89, 232, pytest.param(48338, marks=pytest.mark.slow)])
def test_fingers_reach_over_boulders_that_fall_off_steeply(seed):
    assert_on_rock(seed)


# Mending ------------------------------------------------------------------------------------------


def test_turned_triangles_are_wound_like_the_others():
    vertices, faces = sheet(log)
    rng = np.random.default_rng(0)
    turned = np.where((rng.random(len(faces)) < 0.3)[:, None], faces[:, ::-1], faces)
    assert {tuple(sorted(f)) for f in turned} == {tuple(sorted(f)) for f in faces}
    mended = wound_alike(Triangles(vertices, turned)).faces
    normals = np.cross(
        vertices[mended[:, 1]] - vertices[mended[:, 0]],
        vertices[mended[:, 2]] - vertices[mended[:, 0]],
    )
    assert (normals[:, 2] < 0.0).all()
    want, got = (HAND.settle(Mesh(vertices, f), ROCK, Grasp(math.pi)) for f in (faces, turned))
    np.testing.assert_allclose(got.positions, want.positions, atol=1e-12)


def test_a_strip_with_one_side_is_refused():
    turn = np.linspace(0.0, math.tau, 30, endpoint=False)
    across = np.array([-0.02, 0.02])[:, None]
    lean = turn / 2.0
    radius = 0.1 + across * np.cos(lean)
    strip = np.stack([radius * np.cos(turn), radius * np.sin(turn), across * np.sin(lean)], axis=-1)
    i = np.arange(30)
    j = (i + 1) % 30
    # the last step joins each border to the other
    low, high = i, i + 30
    nlow, nhigh = np.where(j == 0, j + 30, j), np.where(j == 0, j, j + 30)
    faces = np.vstack([np.column_stack([low, nlow, high]), np.column_stack([nlow, nhigh, high])])
    with pytest.raises(InvalidInputError, match="one side") as caught:
        Mesh(strip.reshape(-1, 3), faces)
    assert caught.value.field == "faces"


@pytest.mark.parametrize("order", range(5))
def test_where_three_triangles_meet_none_turns_another(order):
    # two boxes that touch along an edge, and a fin on an edge of one; in any order
    box = trimesh.creation.box((0.3, 0.3, 0.2))
    corners = np.asarray(box.vertices)
    vertices = np.vstack([corners, corners + np.array([0.3, 0.0, 0.2]), [[-0.3, 0.0, -0.2]]])
    corner = np.flatnonzero((corners[:, [0, 2]] < 0.0).all(axis=1))
    faces = np.vstack([box.faces, box.faces + 8, [[*corner, 16]]])
    order = np.random.default_rng(order).permutation(len(faces))
    np.testing.assert_array_equal(
        wound_alike(weld(Triangles(vertices, faces[order]))).faces,
        weld(Triangles(vertices, faces[order])).faces,
    )


def test_a_cut_without_end_is_refused():
    rng = np.random.default_rng(0)
    soup = rng.uniform([-0.2, -0.2, 0.0], [0.2, 0.2, 0.2], (3000, 3))
    faces = np.arange(3000).reshape(-1, 3)
    faces = np.where(
        np.cross(*(soup[faces[:, i]] - soup[faces[:, 0]] for i in (1, 2)))[:, 2:] > 0.0,
        faces[:, ::-1],
        faces,
    )
    with pytest.raises(InvalidInputError, match="the maximum is 4 m") as caught:
        HAND.settle(Mesh(soup, faces), ROCK)
    assert caught.value.field == "hold"


def test_triangles_that_share_no_vertices_are_welded():
    vertices, faces = cylinder_mesh(0.3, 128)
    soup = vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    assert len(weld(Triangles(*soup)).vertices) == len(vertices)
    want, got = (HAND.settle(Mesh(*m), ROCK, Grasp(math.pi)) for m in ((vertices, faces), soup))
    np.testing.assert_allclose(got.positions, want.positions, atol=1e-9)


def holed(width):
    """The log with a slit of a width across the inner fingers, 20 mm beyond their joints."""
    vertices, faces = sheet(log, 0.2, 201)
    middle = vertices[faces].mean(axis=1)[:, 0]
    return vertices, faces[np.abs(middle - 0.06) > width / 2.0]


def test_narrow_holes_are_bridged_and_wide_ones_end_the_rock():
    whole, narrow, wide = (
        Mesh(*holed(width)).section(np.array([0.0, 0.0165, 0.0]), X, Z)
        for width in (0.0, 0.004, 0.02)
    )
    assert len(whole.pieces) == len(narrow.pieces) == 1
    assert len(wide.pieces) == 2
    places = np.array([0.05 + 0.02j, 0.06 + 0.012j, 0.07 + 0.02j])
    np.testing.assert_allclose(narrow.clearances(places), whole.clearances(places), atol=1e-4)
    # in the middle of the wide hole the rock is its border, 10 mm away
    assert wide.clearance((0.06, 0.0127)) == pytest.approx(0.01, abs=1.5e-3)


def test_a_lone_spike_is_taken_back_and_a_bump_is_rock():
    vertices, faces = sheet(log, 0.2, 201)
    spiked = vertices.copy()
    lone = int(np.linalg.norm(vertices - [0.09, 0.0165, log(0.09, 0.0)], axis=1).argmin())
    spiked[lone, 2] -= 0.02
    mended = without_spikes(Triangles(spiked, faces), 3.0).vertices
    np.testing.assert_allclose(np.delete(mended, lone, axis=0), np.delete(vertices, lone, axis=0))
    assert np.linalg.norm(mended[lone] - vertices[lone]) < 2e-4
    bumped = vertices.copy()
    near = np.linalg.norm(vertices[:, :2] - vertices[lone, :2], axis=1)
    bumped[:, 2] -= np.maximum(0.01 - near, 0.0)
    np.testing.assert_array_equal(without_spikes(Triangles(bumped, faces), 3.0).vertices, bumped)


def test_ends_are_bridged_nearest_first_and_short_pieces_do_not_bite_their_tails():
    pieces = [np.array([[0.0, 0.0], [0.1, 0.0]]), np.array([[0.103, 0.0], [0.2, 0.0]])]
    (joined,) = bridge(pieces, 0.005)
    np.testing.assert_array_equal(joined[:, 0], [0.0, 0.1, 0.103, 0.2])
    crumb = np.array([[0.0, 0.0], [0.002, 0.0]])
    assert np.array_equal(bridge([crumb], 0.005)[0], crumb)
    assert len(bridge(pieces, 0.002)) == 2


# Errors -------------------------------------------------------------------------------------------

VERTICES, FACES = cylinder_mesh(0.3, 64)


@pytest.mark.parametrize(
    ("vertices", "faces", "field", "words"),
    [
        (np.where(np.arange(128)[:, None] == 7, np.nan, VERTICES), FACES, "vertices[7]", "finite"),
        (VERTICES[:, :2], FACES, "vertices", "at least three points"),
        ([[0, 0, 0], [1, 0]], FACES, "vertices", "three numbers"),
        (VERTICES, FACES + 64, "faces[0]", "vertices 0 to 127"),
        (VERTICES, -FACES - 1, "faces[0]", "vertices 0 to 127"),
        (VERTICES, FACES + 0.5, "faces", "whole numbers"),
        (VERTICES, FACES[:, :2], "faces", "at least one triangle"),
        (VERTICES, np.zeros((0, 3), int), "faces", "at least one triangle"),
        (VERTICES, FACES * 0, "faces", "no triangle has an area"),
        (1e3 * VERTICES, FACES, "vertices", "divide millimetres by 1000"),
        (VERTICES + 1e300, FACES, "vertices", "within 10000 m of the frame's origin"),
        (VERTICES + np.array([2.0, 0.0, 0.0]), FACES, "vertices", "from the hold's origin"),
        (VERTICES, FACES[:, ::-1], "faces", "face away from it"),
    ],
)
def test_impossible_meshes_are_refused_by_field(vertices, faces, field, words):
    with pytest.raises(InvalidInputError, match=words) as caught:
        Mesh(vertices, faces)
    assert caught.value.field == field


def test_vertices_without_numbers_are_left_out_where_no_triangle_names_them():
    want, at = Mesh(VERTICES, FACES), np.array([0, 5, 5, 128])
    numbers = np.insert(VERTICES, at, [[np.nan] * 3, [0, np.nan, 0], [np.inf] * 3, [np.nan] * 3], 0)
    moved = FACES + np.searchsorted(at, FACES, side="right")
    got = Mesh(numbers, moved)
    np.testing.assert_array_equal(got.triangles.vertices, want.triangles.vertices)
    np.testing.assert_array_equal(got.triangles.faces, want.triangles.faces)
    assert want.oddities == ()
    assert got.oddities == (
        "vertices: 4 vertices without numbers, which no triangle names, were left out",
    )
    with pytest.raises(InvalidInputError, match="have three finite coordinates") as caught:
        Mesh(numbers, np.vstack([moved, [[1, 2, 131]]]))
    assert caught.value.field == "vertices[131]"


@given_some(5, 40, seeds)
def test_a_place_is_refused_as_the_mesh_moved_there_is(seed):
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng)
    size = np.ptp(hold.triangles.vertices, axis=0).max()
    at = Pose(rng.uniform(-0.7, 0.7, 3) * size, random_axes(rng, 3.0))
    moved = at.inverse().apply(hold.triangles.vertices)

    def refusal(check):
        try:
            check()
        except InvalidInputError as error:
            return error.field
        return None

    there = refusal(lambda: Mesh(moved, hold.triangles.faces))
    placed = refusal(lambda: hold.check_place(at))
    # a place is to be on the rock, a hold's frame not far from it
    assert placed == {"faces": "place.approach", "vertices": "place.point"}.get(
        there, placed if placed == "place.point" else None
    )


def test_a_mesh_may_begin_anywhere():
    far = VERTICES + np.array([2.0, 0.0, 0.0])
    hold = Mesh(far, FACES, anywhere=True)
    with pytest.raises(InvalidInputError, match="from the hold's origin"):
        hold.check_place()
    hold.check_place(Pose(np.array([2.0, 0.0, 0.0]), np.eye(3)))
    with pytest.raises(InvalidInputError, match="face away"):
        Mesh(far, FACES[:, ::-1], anywhere=True).check_place(
            Pose(np.array([2.0, 0.0, 0.0]), np.eye(3))
        )


# Files --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["stl", "ply", "obj", "off"])
def test_files_are_read(tmp_path, ending):
    vertices, faces = cylinder_mesh(0.3, 256)
    path = tmp_path / f"log.{ending}"
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    got = HAND.settle(Mesh(*read_mesh(path)), ROCK, Grasp(math.pi))
    want = HAND.settle(Mesh(vertices, faces), ROCK, Grasp(math.pi))
    np.testing.assert_allclose(got.positions, want.positions, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("rock.stl", None, "no such file"),
        ("rock.stl", b"", "rock.stl"),
        ("rock.stl", b"no mesh at all", "rock.stl"),
        ("rock.stl", b"solid x\nendsolid x\n", "rock.stl"),
        # what is said depends on whether a guesser of encodings is installed
        ("rock.stl", b"\0" * 80 + b"\xff" * 500, "9 are there, cut short"),
        ("rock", b"solid x", "ends in .stl, .ply, .obj, .off"),
        (".", None, "ends in .stl, .ply, .obj, .off"),
        ("rock" * 100 + ".stl", None, "File name too long"),
    ],
)
def test_what_is_no_mesh_is_refused(tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InvalidInputError) as caught:
        read_mesh(path)
    assert caught.value.field == "file"
    assert any(each in caught.value.message for each in words.split("|"))


def test_a_cut_that_only_touches_the_rock_is_no_rock():
    assert smooth(np.full((3, 2), 0.01), Scale.of()) is None
    assert smooth(np.array([[0.0, 0.0]]), Scale.of()) is None
