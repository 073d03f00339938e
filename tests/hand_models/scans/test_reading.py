"""Every format gives the points that were written, and says in a line what is no scan."""

from __future__ import annotations

import io
import struct
import sys
import zipfile

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.scans import UP_ROTATIONS, read_scan
from tests.suite.helpers.scans import relief, wall, write_cloud, write_esri, write_geotiff

CLOUD = wall(0.02)
CELL = 0.01


def heights(rows=7, columns=9):
    x, y = np.meshgrid(CELL * np.arange(columns), CELL * np.arange(rows)[::-1])
    found = relief(x, y)
    found[2, 3] = np.nan
    return found


@pytest.mark.parametrize(
    ("begin", "words"),
    [
        (b"", "is empty"),
        (b"\x1f\x8b\x08\0", "begins as .gz does; it is packed: unpack it"),
        (b"PK\x03\x04", "it is packed"),
        (b"LASF\0\0", "begins as .las does; save it as PLY"),
        (b"ASTM-E57\1", "begins as .e57 does; save it as PLY"),
        (b"ply\nformat ascii 1.0\n", "begins as .ply does; name it so that it ends in .ply"),
        (b"# .PCD v0.7\n", "ends in .pcd"),
    ],
)
@pytest.mark.parametrize("ending", ["txt", "off"])
def test_a_file_of_another_kind_than_its_ending_is_told(begin, words, ending, tmp_path):
    path = tmp_path / f"scan.{ending}"
    path.write_bytes(begin)
    with pytest.raises(InvalidInputError, match=words) as error:
        read_scan(path)
    assert error.value.field == "file"


# Clouds -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "encoding"),
    [
        ("a.pcd", "ascii"),
        ("b.pcd", "binary"),
        ("c.pcd", "binary_compressed"),
        ("d.ply", "binary"),
        ("d.ply", "ascii"),
        ("e.xyz", ""),
        ("f.csv", ""),
        ("g.txt", ""),
        ("h.asc", ""),
        ("I.XYZ", ""),
    ],
)
def test_every_format_has_the_points_that_were_written(name, encoding, tmp_path):
    scan = read_scan(write_cloud(tmp_path / name, CLOUD, encoding))
    np.testing.assert_allclose(scan.points, CLOUD, atol=1e-7)
    assert (scan.read, scan.dropped) == (len(CLOUD), 0)


@pytest.mark.parametrize(
    ("name", "encoding"),
    [
        ("a.pcd", "ascii"),
        ("b.pcd", "binary"),
        ("c.pcd", "binary_compressed"),
        ("d.ply", ""),
        ("e.xyz", ""),
        ("f.csv", ""),
    ],
)
def test_points_that_are_not_finite_are_dropped_and_told(name, encoding, tmp_path):
    points = CLOUD.copy()
    points[3] = np.nan
    points[7, 2] = np.inf
    scan = read_scan(write_cloud(tmp_path / name, points, encoding))
    np.testing.assert_allclose(scan.points, np.delete(CLOUD, [3, 7], axis=0), atol=1e-7)
    assert (scan.read, scan.dropped) == (len(CLOUD), 2)


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z\n1,2,3\n4,5,6\n7,8,10\n",
        "z,i,y,x\n3,0,2,1\n6,0,5,4\n10,0,8,7\n",
        '"X";"Y";"Z"\n1;2;3\n4;5;6\n7;8;10\n',
        "//X Y Z R\n1 2 3 9\n4 5 6 9\n7 8 10 9\n",
        "# a comment\n\n1 2 3\n4 5 6\n7 8 10\n",
        "x,y,z\n1,2,3\n4,5,6\n1,,6\n7,8,10\n",
    ],
)
def test_columns_may_be_named_and_parted_in_every_usual_way(text, tmp_path):
    path = tmp_path / "cloud.csv"
    path.write_text(text, encoding="utf-8")
    assert read_scan(path).points.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 10]]


def test_a_pcd_written_by_another_hand_tells_its_viewpoint(tmp_path):
    path = tmp_path / "cloud.pcd"
    rows = "\n".join(f"{x} {y} {z} 7" for x, y, z in CLOUD)
    path.write_text(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
        f"COUNT 1 1 1 1\nWIDTH {len(CLOUD)}\nHEIGHT 1\nVIEWPOINT 0.5 -2 0.25 1 0 0 0\n"
        f"POINTS {len(CLOUD)}\nDATA ascii\n{rows}\n"
    )
    scan = read_scan(path, unit="cm")
    np.testing.assert_allclose(scan.points, 0.01 * CLOUD, atol=1e-8)
    np.testing.assert_allclose(scan.viewpoint, [0.005, -0.02, 0.0025])


@pytest.mark.parametrize("name", ["a.pcd", "a.xyz"])
def test_several_points_at_zero_were_not_measured(name, tmp_path):
    """Organised clouds have them where a scanner got nothing back; one may be rock."""
    points = np.vstack([CLOUD, np.zeros((5, 3))])
    scan = read_scan(write_cloud(tmp_path / name, points))
    assert (scan.dropped, len(scan.points)) == (5, len(CLOUD))
    scan = read_scan(write_cloud(tmp_path / name, points[:-4]))
    assert (scan.dropped, len(scan.points)) == (0, len(CLOUD) + 1)


# Grids --------------------------------------------------------------------------------------------


def grid_files(folder):
    grid = heights()
    np.save(folder / "a.npy", grid)
    np.savez(folder / "b.npz", elevation=grid, dx=CELL, dy=CELL, mask=np.ones((2, 2)))
    yield folder / "a.npy", CELL
    yield folder / "b.npz", None
    yield write_geotiff(folder / "c.tif", grid, CELL), None
    yield write_geotiff(folder / "d.tiff", grid, CELL, compression="tiff_lzw"), None
    yield write_geotiff(folder / "e.tif", grid, 1e-4, degrees=True), CELL
    yield write_esri(folder / "f.asc", grid, CELL), None


def test_every_grid_has_the_heights_that_were_written_and_holes_where_there_are_none(tmp_path):
    for path, cell in grid_files(tmp_path):
        scan = read_scan(path, cell=cell)
        x, y, z = scan.points.T
        assert (scan.read, scan.dropped) == (63, 1), path
        np.testing.assert_allclose(z, relief(x, y), atol=1e-8, err_msg=path.name)
        np.testing.assert_allclose(np.ptp(scan.points, axis=0)[:2], [0.08, 0.06], rtol=1e-9)
        assert scan.direction().tolist() == [0.0, 0.0, -1.0]


@pytest.mark.parametrize("name", ["a.npy", "e.tif"])
def test_a_grid_without_a_cell_in_a_unit_of_length_is_refused(name, tmp_path):
    (path,) = (path for path, _ in grid_files(tmp_path) if path.name == name)
    with pytest.raises(InvalidInputError, match=r"^cell: must be given: the file has no cell size"):
        read_scan(path)


def test_a_cell_that_is_no_length_is_refused_with_the_sides_of_the_file(tmp_path):
    path = tmp_path / "a.asc"
    path.write_text("ncols 2\nnrows 2\ndx inf\ndy 30\n1 2\n3 4\n", encoding="utf-8")
    with pytest.raises(InvalidInputError, match=r"^cell: .*got inf by 30 from the file$"):
        read_scan(path)


# Units, up, width ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("unit", "size"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001)])
def test_units(unit, size, tmp_path):
    path = write_cloud(tmp_path / "a.xyz", CLOUD / size)
    np.testing.assert_allclose(read_scan(path, unit=unit).points, CLOUD, atol=1e-12)


@pytest.mark.parametrize("up", UP_ROTATIONS)
def test_what_points_up_in_the_file_is_z(up, tmp_path):
    sign, axis = (-1.0 if up[0] == "-" else 1.0), "xyz".index(up[-1])
    scan = read_scan(write_cloud(tmp_path / "a.xyz", CLOUD), up=up, viewpoint=(1, 2, 3))
    np.testing.assert_allclose(scan.points[:, 2], sign * CLOUD[:, axis])
    assert scan.viewpoint[2] == sign * (1 + axis)
    assert np.linalg.det(UP_ROTATIONS[up]) == pytest.approx(1.0)


def test_a_width_is_that_of_the_longest_side(tmp_path):
    scan = read_scan(write_cloud(tmp_path / "a.xyz", 17.0 * CLOUD), width=0.5)
    assert np.ptp(scan.points, axis=0).max() == pytest.approx(0.5)


# Which way it was looked at -----------------------------------------------------------------------


def test_a_cloud_is_looked_at_from_its_viewpoint_where_it_varies_least(tmp_path):
    path = write_cloud(tmp_path / "a.xyz", CLOUD)
    assert read_scan(path).direction() @ [0, 1, 0] > 0.99
    away = read_scan(path, viewpoint=(0.3, 5.0, 0.0)).direction()
    np.testing.assert_allclose(away, np.array([-0.3, -4.0, 0.0]) / np.hypot(0.3, 4.0), atol=0.01)
    assert read_scan(path, view=(0, 2, 0)).direction().tolist() == [0, 1, 0]


def test_ground_about_the_origin_is_seen_from_above_and_a_wall_there_is_refused(tmp_path):
    ground = write_cloud(tmp_path / "a.xyz", (CLOUD - [0, 1, 0])[:, [0, 2, 1]])
    assert read_scan(ground).direction()[2] < -0.99
    with pytest.raises(InvalidInputError, match=r"^view: the viewing direction is ambiguous"):
        read_scan(write_cloud(tmp_path / "b.xyz", CLOUD - [0, 1, 0])).direction()


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["pcd", "ply", "npy", "npz", "tif", "asc", "csv", "xyz"])
@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n\0\xff\xfe rock", b"no scan at all\n"])
def test_what_is_no_scan_is_refused_in_one_line(ending, content, tmp_path):
    path = tmp_path / f"a.{ending}"
    path.write_bytes(content)
    with pytest.raises(InvalidInputError) as error:
        read_scan(path)
    assert error.value.field == "file"
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("encoding", ["binary", "binary_compressed"])
def test_a_file_that_is_cut_short_is_refused(encoding, tmp_path):
    path = write_cloud(tmp_path / "a.pcd", CLOUD, encoding)
    path.write_bytes(path.read_bytes()[:-240])
    with pytest.raises(InvalidInputError, match=r"^file: "):
        read_scan(path)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"unit": "inch"}, "unit"),
        ({"up": "w"}, "up"),
        ({"view": (0, 0, 0)}, "view"),
        ({"view": (0, 1)}, "view"),
        ({"viewpoint": (0, np.nan, 0)}, "viewpoint"),
        ({"origin": "here"}, "origin"),
        ({"width": -1.0}, "width"),
        ({"width": 1.0, "unit": "mm"}, "width"),
    ],
)
def test_a_wrong_parameter_is_named(change, field, tmp_path):
    path = write_cloud(tmp_path / "a.xyz", CLOUD)
    with pytest.raises(InvalidInputError) as error:
        read_scan(path, **change)
    assert error.value.field == field


def test_a_cell_of_no_size_and_three_columns_are_no_grid(tmp_path):
    np.save(tmp_path / "a.npy", heights())
    np.save(tmp_path / "b.npy", CLOUD)
    np.savez(tmp_path / "c.npz", one=heights(), two=heights())
    with pytest.raises(InvalidInputError, match=r"^cell: must be finite and above zero"):
        read_scan(tmp_path / "a.npy", cell=0.0)
    with pytest.raises(InvalidInputError, match="an array of three columns holds points"):
        read_scan(tmp_path / "b.npy", cell=0.1)
    with pytest.raises(InvalidInputError, match="one grid of heights is needed"):
        read_scan(tmp_path / "c.npz", cell=0.1)


def test_endings_that_no_scan_has_and_files_that_are_not_there_are_refused(tmp_path):
    for name, words in (("a.step", "a scan's file ends in"), ("a.pcd", "no such file")):
        with pytest.raises(InvalidInputError, match=words):
            read_scan(tmp_path / name)


@pytest.mark.parametrize(
    ("module", "name"), [("pypcd4.pypcd4", "a.pcd"), ("PIL", "a.tif")], ids=["pcd", "tif"]
)
def test_a_missing_package_is_named_with_what_installs_it(module, name, tmp_path, monkeypatch):
    if name == "a.pcd":
        write_cloud(tmp_path / name, CLOUD)
    else:
        write_geotiff(tmp_path / name, heights(), CELL)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InvalidInputError, match=r"pip install -e '\.\[scans\]'"):
        read_scan(tmp_path / name)


def test_what_64_bit_floats_are_to_be_made_is_said(tmp_path):
    """The smallest TIFF of them, which no version of pillow reads."""
    heights = np.zeros((4, 4), dtype="<f8").tobytes()
    tags = [(256, 3, 4), (257, 3, 4), (258, 3, 64), (259, 3, 1), (262, 3, 1), (273, 4, 8)]
    tags += [(277, 3, 1), (278, 3, 4), (279, 4, len(heights)), (339, 3, 3)]
    entries = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
    head = b"II*\0" + struct.pack("<I", 8 + len(heights))
    path = tmp_path / "wide.tif"
    path.write_bytes(head + heights + struct.pack("<H", len(tags)) + entries + bytes(4))
    with pytest.raises(InvalidInputError, match="gdal_translate -ot Float32"):
        read_scan(path, cell=CELL)


# Counts beyond the file --------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(10**6, 10**6), (10**9, 2), (3, 10**12)])
@pytest.mark.parametrize("ending", ["npy", "npz"])
def test_the_shape_of_an_array_is_compared_with_its_size(shape, ending, tmp_path):
    content = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(content, header)
    content.write(bytes(96))
    path = tmp_path / f"a.{ending}"
    if ending == "npz":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("z.npy", content.getvalue())
    else:
        path.write_bytes(content.getvalue())
    with pytest.raises(InvalidInputError, match=r"^file: "):
        read_scan(path, cell=0.01)


@pytest.mark.parametrize("compression", ["raw", "tiff_lzw", "tiff_adobe_deflate"])
def test_the_size_of_a_picture_is_compared_with_that_of_its_file(compression, tmp_path):
    path = write_geotiff(tmp_path / "a.tif", np.zeros((9, 7)), CELL, compression=compression)
    content = path.read_bytes()
    entry = struct.pack("<HHI", 256, 4, 1)
    if entry not in content:
        entry = struct.pack("<HHI", 256, 3, 1)
    place = content.index(entry)
    wide = struct.pack("<HHII", 256, 4, 1, 2_000_000)
    path.write_bytes(content[:place] + wide + content[place + 12 :])
    with pytest.raises(InvalidInputError, match=r"is too small for .* heights"):
        read_scan(path)


@pytest.mark.parametrize("rows", ["1000000000", "1e300", "-3", "nan"])
def test_the_rows_of_a_text_are_compared_with_what_it_has(rows, tmp_path):
    path = tmp_path / "a.asc"
    path.write_text(f"ncols 3\nnrows {rows}\ncellsize 0,5\n1,5 2 3\n4 5 6\n7 8 9\n")
    with pytest.raises(InvalidInputError, match=r"^file: "):
        read_scan(path)
    path.write_text("ncols 3\nnrows 3\ncellsize 0,5\n1,5 2 3\n4 5 6\n7 8 9\n")
    assert read_scan(path).points[0].tolist() == [0.0, 1.0, 1.5]


@pytest.mark.parametrize("head", ["\ufeff", "  ", "\n"])
def test_a_grid_in_text_is_told_whatever_stands_before_its_name(head, tmp_path):
    path = write_esri(tmp_path / "grid.asc", heights(), CELL)
    path.write_text(head + path.read_text(), encoding="utf-8")
    assert read_scan(path).heights


@pytest.mark.parametrize("kind", [complex, str, bool])
def test_heights_that_are_no_real_numbers_are_refused(kind, tmp_path):
    np.save(tmp_path / "grid.npy", np.zeros((4, 5)).astype(kind))
    with pytest.raises(InvalidInputError, match="must be integers or floats"):
        read_scan(tmp_path / "grid.npy", cell=0.01)
