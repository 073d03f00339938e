"""Mesh files are read alone: no other file, no count that is not true, nothing that never ends."""

from __future__ import annotations

import os
from contextlib import suppress

import numpy as np
import pytest
import trimesh

from hand_models import InvalidInputError
from hand_models.rock import read_mesh, read_vertices
from hand_models.scans import SCAN_ENDINGS, read_scan

PLY = (
    "ply\nformat {kind} 1.0\n{more}element vertex {count}\nproperty float x\nproperty float y\n"
    "property float z\n{faces}end_header\n"
)
LIST = "property list uchar int vertex_indices\n"


def ball():
    return trimesh.creation.icosphere(2, radius=0.2)


@pytest.mark.parametrize("line", ["mtllib {}", "mtllib a.mtl\nmtllib {}", "mtllib  {} "])
def test_the_materials_of_an_obj_are_not_opened(line, tmp_path):
    """A pipe as its material file would hang for ever."""
    os.mkfifo(tmp_path / "a.mtl")
    text = ball().export(file_type="obj")
    path = tmp_path / "a.obj"
    path.write_text(line.format("a.mtl") + "\nusemtl stone\n" + text)
    assert len(read_mesh(path)[1]) == len(ball().faces)
    assert len(read_scan(path).faces) == len(ball().faces)


def test_an_obj_of_several_materials_is_one_rock(tmp_path):
    lines = ball().export(file_type="obj").splitlines()
    faces = [line for line in lines if line.startswith("f ")]
    rest = [line for line in lines if not line.startswith("f ")]
    parts = [["usemtl a"], faces[:99], ["usemtl b"], faces[99:]]
    (tmp_path / "a.obj").write_text("\n".join(sum(parts, rest)))
    assert trimesh.Trimesh(*read_mesh(tmp_path / "a.obj")).is_watertight


def test_the_texture_of_a_ply_is_not_opened(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    content = ball().export(file_type="ply", encoding="ascii")
    head, rest = content.split(b"element vertex", 1)
    path = tmp_path / "a.ply"
    path.write_bytes(head + b"comment TextureFile a.png\nelement vertex" + rest)
    assert len(read_mesh(path)[1]) == len(ball().faces)


@pytest.mark.parametrize("ending", SCAN_ENDINGS)
@pytest.mark.parametrize("kind", ["pipe", "folder", "device"])
def test_what_may_never_end_is_refused(ending, kind, tmp_path):
    path = tmp_path / f"a{ending}"
    match kind:
        case "pipe":
            os.mkfifo(path)
        case "folder":
            path.mkdir()
        case _:
            path.symlink_to("/dev/zero")
    words = "is a folder" if kind == "folder" else "is a pipe or a device"
    with pytest.raises(InvalidInputError, match=words) as error:
        read_scan(path)
    assert error.value.field == "file"
    if ending in (".ply", ".obj", ".stl", ".off"):
        with pytest.raises(InvalidInputError, match=words):
            read_mesh(path)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    ("count", "more", "faces"),
    [
        (10**12, "", ""),
        (9, "", f"element face {10**12}\n{LIST}"),
        (9, "", f"element nothing {10**12}\n"),
        (9, f"element before {10**12}\nproperty uchar a\n", ""),
        (-9, "", ""),
        (9, "", LIST * 2000),
    ],
)
def test_counts_of_a_ply_beyond_its_size_are_refused(kind, count, more, faces, tmp_path):
    path = tmp_path / "a.ply"
    head = PLY.format(kind=kind, count=count, more=more, faces=faces)
    path.write_bytes(head.encode() + (b"1 2 3\n" * 9 if kind == "ascii" else bytes(108)))
    with pytest.raises(InvalidInputError, match=r"the header|no PLY header") as error:
        read_vertices(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize("size", [2**32 - 1, 2**31, 10**6])
def test_lists_of_a_ply_beyond_its_size_are_refused(size, tmp_path):
    faces = "element face 1\nproperty list uint int vertex_indices\n"
    head = PLY.format(kind="binary_little_endian", count=3, more="", faces=faces)
    path = tmp_path / "a.ply"
    path.write_bytes(head.encode() + bytes(36) + size.to_bytes(4, "little") + bytes(12))
    with pytest.raises(InvalidInputError, match=r"^file: .*a\.ply.* cut short, or"):
        read_vertices(path)


def test_faces_of_different_numbers_of_corners_are_named(tmp_path):
    faces = f"element face 2\n{LIST}"
    head = PLY.format(kind="binary_little_endian", count=4, more="", faces=faces)
    triangle = b"\3" + np.array([0, 1, 2], "<i4").tobytes()
    square = b"\4" + np.array([0, 1, 2, 3], "<i4").tobytes()
    path = tmp_path / "a.ply"
    path.write_bytes(head.encode() + np.eye(4, 3, dtype="<f4").tobytes() + triangle + square)
    with pytest.raises(InvalidInputError, match="make all faces triangles"):
        read_mesh(path)


@pytest.mark.parametrize("counts", ["1000000000 10 0", "10 1000000000 0", f"{10**18} {10**18} 0"])
def test_counts_of_an_off_are_not_believed(counts, tmp_path):
    path = tmp_path / "a.off"
    path.write_text(f"OFF\n{counts}\n" + "0 0 1\n" * 10 + "3 0 1 2\n")
    with suppress(InvalidInputError):
        assert len(read_vertices(path)[0]) == 10


def test_counts_of_an_stl_are_compared_with_its_size(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(bytes(80) + (2**32 - 1).to_bytes(4, "little") + bytes(100))
    with pytest.raises(InvalidInputError, match=r"^file: .* 4,294,967,295 triangles, and 2 are"):
        read_mesh(path)
    for kind, cut in (("stl", -60), ("stl_ascii", -60)):
        content = ball().export(file_type=kind)
        whole = content if isinstance(content, bytes) else content.encode()
        path.write_bytes(whole)
        assert len(read_mesh(path)[1]) == len(ball().faces)
        path.write_bytes(whole[:cut])
        with pytest.raises(InvalidInputError, match="cut short"):
            read_mesh(path)


CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
OTHERS = "v 5 5 5\nv 6 5 5\nv 5 6 5\n"


@pytest.mark.parametrize(
    "faces",
    [
        ("f 1 2 3\n", "f 4 5 6\n"),
        ("f -3 -2 -1\n", "f -3 -2 -1\n"),
        ("f -3/-1/-1 -2/-1/-1 -1/-1/-1\n", "f 4//1 -2//1 6//1\n"),
        ("f  1\t-2 3 \r\n", "  f 4 5 -1\n"),
    ],
)
def test_vertices_of_an_obj_that_are_counted_back_are_the_last_so_far(faces, tmp_path):
    file = tmp_path / "rock.obj"
    file.write_text(CORNERS + faces[0] + OTHERS + faces[1])
    vertices, triangles = read_mesh(file)
    np.testing.assert_array_equal(
        vertices[triangles],
        [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[5, 5, 5], [6, 5, 5], [5, 6, 5]]],
    )


@pytest.mark.parametrize("face", ["0 1 2", "1 2 0", "-4 1 2", "1/1 2/1 0/1", "1 2 99999999"])
def test_a_face_of_an_obj_with_no_vertex_is_refused(face, tmp_path):
    file = tmp_path / "rock.obj"
    file.write_text(f"{CORNERS}f {face}\n{OTHERS}")
    with pytest.raises(InvalidInputError) as caught:
        read_mesh(file)
    assert caught.value.field == "file"


@pytest.mark.parametrize("corner", [-1, -3, 3, 1000, 2**31 - 1])
@pytest.mark.parametrize("ending", [".ply", ".off"])
def test_a_triangle_with_no_vertex_is_refused(ending, corner, tmp_path):
    file = tmp_path / f"rock{ending}"
    head = {
        ".ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
        ".off": "OFF\n3 1 0\n",
    }
    file.write_text(f"{head[ending]}0 0 0\n1 0 0\n0 1 0\n3 0 1 {corner}\n")
    with pytest.raises(InvalidInputError) as caught:
        read_mesh(file)
    assert caught.value.field == "file"
    assert "vert" in caught.value.message
