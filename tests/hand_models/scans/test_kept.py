"""Triangles of a file are the rock: kept, put into a frame, and looked at from outside."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from hand_models import InvalidInputError, Mesh
from hand_models.rock import grid, read_mesh
from hand_models.scans import drop_outliers, mesh_scan, read_scan, write_rock
from tests.suite.helpers.scans import relief, wall, write_cloud


def surface(step=0.01, half=0.2, window=0.0):
    """A wall y = 1 − relief that faces −y, but for a round window, as triangles [m]."""
    line = np.arange(-half, half + 0.5 * step, step)
    x, z = np.meshgrid(line, line, indexing="ij")
    mesh = trimesh.Trimesh(*grid(np.stack([x, 1.0 - relief(x, z), z], axis=-1)), process=False)
    middle = mesh.triangles_center
    mesh.update_faces(np.hypot(middle[:, 0], middle[:, 2]) > 0.5 * window)
    mesh.remove_unreferenced_vertices()
    assert mesh.face_normals[:, 1].max() < 0.0
    return mesh


def written(mesh, path):
    mesh.export(path)
    return path


def corners(vertices, faces):
    """Corners of each triangle in an order that does not depend on its first, sorted."""
    found = np.round(vertices[faces], 6) + 0.0
    first = np.lexsort(found.transpose(2, 0, 1)[::-1], axis=1)[:, 0]
    turned = found[np.arange(len(found))[:, None], (first[:, None] + np.arange(3)) % 3]
    return turned[np.lexsort(turned.reshape(-1, 9).T[::-1])]


@pytest.mark.parametrize("ending", ["ply", "obj", "stl", "off"])
@pytest.mark.parametrize("shape", ["wall", "ball", "box"])
def test_the_files_triangles_are_the_rock(ending, shape, tmp_path):
    mesh = {
        "wall": surface,
        "ball": lambda: trimesh.creation.icosphere(radius=0.2),
        "box": lambda: trimesh.creation.box((0.3, 0.2, 0.4)).subdivide(),
    }[shape]()
    rock = mesh_scan(read_scan(written(mesh, tmp_path / f"rock.{ending}")))
    assert rock.kept
    assert not rock.turned
    there = rock.pose.apply(rock.vertices)
    np.testing.assert_allclose(
        corners(there, rock.faces), corners(np.array(mesh.vertices), mesh.faces), atol=2e-6
    )
    assert (rock.holes, rock.steps) == ((), ())
    write_rock(rock, tmp_path / "made.ply")
    vertices, faces = read_mesh(tmp_path / "made.ply")
    assert len(faces) == len(mesh.faces)
    assert Mesh(vertices, faces).entry((0.0, 0.0, -0.5), (0, 0, 1)) == pytest.approx(0.5, abs=1e-6)


def test_triangles_are_seen_from_where_they_face_and_closed_ones_from_above(tmp_path):
    wall_ = read_scan(written(surface(), tmp_path / "wall.ply"))
    assert wall_.direction()[1] > 0.99
    ball = read_scan(written(trimesh.creation.icosphere(), tmp_path / "ball.ply"))
    assert ball.direction().tolist() == [0.0, 0.0, -1.0]
    assert read_scan(tmp_path / "ball.ply", view=(1, 0, 0)).direction().tolist() == [1, 0, 0]


def test_overhangs_are_kept(tmp_path):
    """A ledge whose underside no height over a plane has."""
    box = trimesh.creation.box((0.2, 0.2, 0.04)).subdivide().subdivide()
    rock = mesh_scan(read_scan(written(box, tmp_path / "ledge.stl"), view=(0, 1, 0)))
    normals = trimesh.Trimesh(rock.vertices, rock.faces, process=False).face_normals
    assert normals[:, 0].min() < -0.99  # downward: x of the rock is up
    assert normals[:, 2].max() > 0.99


@pytest.mark.parametrize("option", [{"view": (0, 1, 0)}, {"viewpoint": (0, -3, 0)}])
def test_triangles_that_show_their_backs_to_a_view_are_turned(option, tmp_path):
    mesh = surface()
    mesh.invert()
    rock = mesh_scan(read_scan(written(mesh, tmp_path / "wall.ply"), **option))
    assert rock.turned
    assert trimesh.Trimesh(rock.vertices, rock.faces, process=False).face_normals[:, 2].max() < 0
    assert not mesh_scan(read_scan(written(surface(), tmp_path / "wall.ply"), **option)).turned


@pytest.mark.parametrize(("window", "count"), [(0.0, 0), (0.05, 1), (0.1, 1)])
def test_a_hole_of_triangles_is_told(window, count, tmp_path):
    rock = mesh_scan(read_scan(written(surface(0.005, window=window), tmp_path / "wall.ply")))
    assert len(rock.holes) == count
    for hole in rock.holes:
        assert hole.width == pytest.approx(window, abs=0.01)
        np.testing.assert_allclose(rock.pose.apply(hole.place)[[0, 2]], 0.0, atol=2e-3)


def test_two_patches_have_two_outlines_and_no_hole(tmp_path):
    other = surface()
    other.apply_translation((0.6, 0.0, 0.0))
    both = trimesh.util.concatenate([surface(), other])
    assert not mesh_scan(read_scan(written(both, tmp_path / "wall.ply"))).holes


def test_unit_up_origin_and_vertices_without_numbers(tmp_path):
    mesh = surface()
    turned = 1e3 * np.array(mesh.vertices)[:, [0, 2, 1]]
    turned = np.vstack([turned, [np.nan] * 3])
    faces = np.array(mesh.faces)[:, ::-1]
    lines = [f"v {x} {y} {z}" for x, y, z in turned] + [
        f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces
    ]
    (tmp_path / "wall.obj").write_text("\n".join([*lines, f"f 1 2 {len(turned)}"]))
    scan = read_scan(tmp_path / "wall.obj", unit="mm", up="y", origin=(50, 0, 1000))
    rock = mesh_scan(scan)
    assert (rock.read, rock.dropped) == (len(turned), 1)
    assert len(rock.faces) == len(mesh.faces)
    np.testing.assert_allclose(rock.pose.position[[0, 2]], [0.05, 0.0], atol=0.006)


def test_triangles_take_no_options_of_points(tmp_path):
    scan = read_scan(written(surface(), tmp_path / "wall.ply"))
    with pytest.raises(InvalidInputError, match=r"^spacing: is for points"):
        mesh_scan(scan, spacing=0.01)
    with pytest.raises(InvalidInputError, match=r"^std_ratio: is for points"):
        drop_outliers(scan, 2.0)
    cloud = read_scan(write_cloud(tmp_path / "cloud.ply", wall(0.01)), view=(0, 1, 0))
    assert cloud.faces is None
    assert not mesh_scan(cloud).kept
