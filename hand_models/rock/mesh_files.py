"""Mesh files: read STL, PLY, OBJ and OFF safely.

No other file that a mesh file names (an OBJ's ``mtllib``, a PLY's texture) is opened, and a PLY's
counts are compared with its size before memory is allocated; in the other formats no count decides
how much is read.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any, Final

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, reading_file

__all__ = ["MESH_ENDINGS", "read_mesh", "read_vertices"]

MESH_ENDINGS: Final = (".stl", ".ply", ".obj", ".off")


def read_mesh(path: Path) -> tuple[Array, Indices]:
    """Read vertices and triangles of an STL, PLY, OBJ or OFF file, which must be in metres.

    Returns
    -------
    vertices : ndarray, shape (n, 3)
        Corners of the triangles [m].
    faces : ndarray of int, shape (m, 3)
        Indices of each triangle's vertices.

    Raises
    ------
    InvalidInputError
        If the file cannot be read, or has no triangles; the field is ``file``.
    """
    vertices, faces = read_vertices(path)
    if not len(faces):
        raise InvalidInputError(
            f"no triangles in {path}: export it again, or make them from a point cloud by `crux "
            "rock`",
            field="file",
        )
    return vertices, faces


def read_vertices(path: Path) -> tuple[Array, Indices]:
    """Read vertices of an STL, PLY, OBJ or OFF file, and its triangles if it has any.

    Returns
    -------
    vertices : ndarray, shape (n, 3)
        Points in the file's unit.
    faces : ndarray of int, shape (m, 3)
        Indices of each triangle's vertices; empty, (0, 3), for a point cloud.

    Raises
    ------
    InvalidInputError
        If the file cannot be read; the field is ``file``.
    """
    import trimesh

    ending = path.suffix.lower()
    if ending not in MESH_ENDINGS:
        raise InvalidInputError(
            f"{path}: a mesh file ends in {', '.join(MESH_ENDINGS)}; export it as one of these",
            field="file",
        )
    with reading_file(path):
        content = path.read_bytes()
        if ending == ".ply":
            _check_counts(content, path)
        elif ending == ".obj":
            content = _absolute(content, path)
        elif ending == ".stl":
            _check_stl(content, path)
        try:
            # from memory, and so without a folder in which it would look for what the file names
            found = trimesh.load(
                io.BytesIO(content), file_type=ending[1:], process=False, skip_materials=True
            )
        except ImportError:
            # what is no text either, trimesh would have another package guess the encoding of
            raise InvalidInputError(f"broken or cut short: {path}; export it again") from None
        except Exception as error:
            if "unexpected length" not in str(error):
                raise
            raise InvalidInputError(
                f"{path} is cut short, or has faces of different numbers of corners: make all "
                "faces triangles before the export"
            ) from None
        # an OBJ with several materials has several
        parts: list[Any] = (
            list(found.geometry.values()) if isinstance(found, trimesh.Scene) else [found]
        )
    vertices = [np.array(part.vertices, dtype=float).reshape(-1, 3) for part in parts]
    begins = np.cumsum([0, *map(len, vertices)])
    faces = [
        start + _corners(np.array(getattr(part, "faces", ())), len(own), path)
        for start, part, own in zip(begins, parts, vertices, strict=False)
    ]
    if not parts:
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.intp)
    return np.vstack(vertices), np.vstack(faces)


def _corners(faces: Array, count: int, path: Path) -> Indices:
    """Return faces of so many vertices, shape (m, 3); refuse one that names no vertex."""
    wrong = faces[(faces < 0) | (faces >= count)]
    if len(wrong):
        raise InvalidInputError(
            f"a triangle's corner is vertex {wrong[0]:.0f}; valid are 0 to {count - 1} in {path}: "
            "export it again",
            field="file",
        )
    return faces.astype(np.intp).reshape(-1, 3)


def _absolute(content: bytes, path: Path) -> bytes:
    """Return an OBJ whose faces count vertices from the first, not back from the last so far.

    The loader would count back from the last of all.
    """
    # a face one of whose vertices is not counted from the first, which is 1
    relative = rb"^[ \t]*f[ \t](?:[^\n]*[ \t])?(?:-|0+(?:[ \t/\r\n]|$))"
    if re.search(relative, content, re.MULTILINE) is None:
        return content
    lines, count = content.splitlines(), 0
    for i, line in enumerate(lines):
        kind, *entries = line.split() or [b""]
        if kind == b"v":
            count += 1
        elif kind == b"f":
            corners = [int(entry.split(b"/")[0]) for entry in entries]
            if 0 in corners:
                raise InvalidInputError(
                    f"a face in line {i + 1} has vertex 0, and an OBJ counts from 1: {path}; "
                    "export it again"
                )
            named = [corner if corner > 0 else count + 1 + corner for corner in corners]
            if min(named, default=1) < 1:
                raise InvalidInputError(
                    f"a face in line {i + 1} has vertex {min(corners)}, counted back from the "
                    f"{count} vertices so far: {path}; export it again"
                )
            lines[i] = b"f " + b" ".join(b"%d" % corner for corner in named)
    return b"\n".join(lines)


def _check_stl(content: bytes, path: Path) -> None:
    """Refuse an STL that is cut short: a text without its end, or fewer triangles than it names."""
    head, one = 84, 50  # bytes before the triangles, and of each
    named = int.from_bytes(content[80:head], "little")
    if len(content) >= head + one * named and len(content) > head:
        return  # binary, whatever its head says
    if content[:5] == b"solid" and b"facet" not in content and b"endsolid" in content:
        return  # a text that is whole, without triangles
    if b"facet" in content[:1000]:
        if b"endsolid" not in content[-1000:]:
            raise InvalidInputError(f"the text has no endsolid, cut short: {path}; export it again")
    elif len(content) < head or named:
        there = max(len(content) - head, 0) // one
        raise InvalidInputError(
            f"the header names {named:,} triangles, and {there:,} are there, cut short, or it is "
            f"no STL: {path}; export it again"
        )


def _check_counts(content: bytes, path: Path) -> None:
    """Refuse a PLY whose header names more than can be in the file."""
    head, end, rest = content.partition(b"end_header")
    words = [line.split() for line in head.decode("utf-8", "replace").splitlines()]
    ascii_ = ["format", "ascii"] in [line[:2] for line in words]
    counts: list[int] = []
    least: list[int] = []
    properties, most_properties = 0, 1000  # reading takes as long as the square of their number
    # bytes of the types; those of one byte, and what is no type, are left out
    sizes = {"short": 2, "int": 4, "uint": 4, "float": 4, "double": 8, "ushort": 2} | {
        f"{kind}{bits}": bits // 8 for kind in ("int", "uint", "float") for bits in (8, 16, 32, 64)
    }
    for line in words:
        if line[:1] == ["element"] and len(line) == 3:
            counts.append(int(line[2]))
            least.append(0)
        elif line[:1] == ["property"] and len(line) > 1 and least:
            properties += 1
            # of a list at least the number that says how long it is; in a text a digit and a blank
            kind = line[2] if line[1] == "list" and len(line) > 2 else line[1]
            least[-1] += 2 if ascii_ else sizes.get(kind, 1)
    needed = sum(count * max(size, 1) for count, size in zip(counts, least, strict=True))
    if not end:
        raise InvalidInputError(f"no PLY header that ends: {path}; export it again")
    if properties > most_properties:
        raise InvalidInputError(
            f"the header may have at most {most_properties} properties, got {properties}: {path}; "
            "export it again with fewer"
        )
    if min(counts, default=0) < 0:
        raise InvalidInputError(
            f"the header's counts must be 0 or more, got {min(counts)}: {path}; export it again"
        )
    if needed > len(rest) + 1:  # a text may end without a blank
        raise InvalidInputError(
            f"the header names at least {needed:,} bytes, and {len(rest):,} are there, cut short: "
            f"{path}; export it again"
        )
