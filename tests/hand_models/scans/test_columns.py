"""Tables in text, written as programs and people write them, and what is no table of points."""

from __future__ import annotations

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.scans import read_scan

POINTS = [
    [402117.25, 5310842.5, 812.125],
    [402117.5, 5310842.25, 812.5],
    [402118.0, 5310843.0, 1.0],
]


def table(mark: str, decimal: str = ".", before: str = "", after: str = "", head: str = "") -> str:
    rows = (mark.join(repr(x).replace(".", decimal) for x in row) for row in POINTS)
    return head + "\n".join(before + row + after for row in rows)


@pytest.mark.parametrize(
    "text",
    [
        table(";", ","),
        table(";", ",", head="X;Y;Z\n"),
        table("\t", ","),
        table(" ", ","),
        table(", "),
        table(" ", after=" 10 20 0 0 1", head="//X Y Z R G Nx Ny Nz\n"),
        table(",", after=",10,20", head="//X,Y,Z,R,G\n"),
        table(",", before="7,", head='"RTData","Points:0","Points:1","Points:2"\n'),
        table(",", before="1,", head="id,Easting,Northing,Elevation\n"),
        table(",", head="X [m],Y [m],Z [m]\n"),
        table(" ", after=" 3", head="x [m] y [m] z [m] i\n"),
        table(" ", after=" 200 1 2 3", head="3\n"),
        table(",", after=","),
        table(" ", head="x,y,z\n"),
        table(";", after=";4", head="X_m;Y_m;Z_m;i\n"),
        table('","', before='"', after='"'),
        table(",", before="0.5,", head="n,x,y,z\n"),
        table(" ", after=" 7", head="//X Y Z I\n3\n"),
        table(" ") + "\n\x1a",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-8-sig"])
def test_every_usual_table_has_the_points_that_were_written(text, encoding, tmp_path):
    path = tmp_path / "cloud.csv"
    path.write_bytes(text.replace("\n", "\r\n").encode(encoding))
    assert read_scan(path).points.tolist() == POINTS


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (table(",", ","), "commas separate the columns and are in the numbers"),
        (
            "".join(f"{i} 1.5 2.5 3.5\n" for i in range(1, 5)),
            "the first column is the index",
        ),
        ("lat,lon,alt\n47.1,8.1,300\n47.2,8.2,301\n", "column lat is in degrees"),
        ("id;longitude;latitude;h\n1;8.1;47.1;300\n2;8.2;47.2;301\n", "is in degrees"),
        ("a,b,c,d\n1,2,3,4\n5,6,7,8\n", "no columns are named x, y and z, got a, b, c, d"),
        ("x,y,z\n1,2,3\n4,5\n6,7,8\n", "line 3, '4,5', has 2 columns, 3 are needed"),
        (
            "x,y,z,i\n1,2,3\n4,5,6\n6,7,8\n",
            r"4 columns have names \(x, y, z, i\), and the next line has 3",
        ),
        ("1 2\n3 4\n5 6\n", "no line has three numbers"),
        ("5\n1 2 3\n4 5 6\n7 8 1\n", "as the number of points it is wrong, as 3 lines follow"),
        ("1 2 b\n4 5 6\n7 8 9\n1 1 1\n", "line 1, '1 2 b', has numbers among other words"),
        ("nan nan nan\nnan nan nan\n", "all numbers are nan"),
        ("1|2|3\n4|5|6\n", r"without other marks, not '4\|5\|6'"),
        ("POINT (1 2 3)\nPOINT (4 5 6)\n", "no line has three numbers"),
        ("1 2 3\n4 5 6\n7 8 1e38\n", "write nan"),
        ("1 2 3\n4 5 b\n7 8 9\n1 1 1\n", "line 2, '4 5 b', is not three .* 'b' is not a number: "),
        *(
            (text, f"line {line}, .*: '{own}5' has a decimal {mark}, but the file's decimals are")
            for text, line, own, mark in (
                ("1,5 2,5 3,5\n1,5 2,5 3,6\n1.5 2.5 3.5\n", 3, r"1\.", "point"),
                ("1.5 2.5 3.5\n1,5 2,5 3,6\n1,5 2,5 3,5\n", 1, r"1\.", "point"),
                ("1.5 2.5 3.5\n1,5 2,5 3,6\n1.5 2.5 3.6\n", 2, "1,", "comma"),
            )
        ),
    ],
)
def test_what_is_no_table_of_points_is_refused_with_its_cause(text, words, tmp_path):
    path = tmp_path / "cloud.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInputError, match=words) as error:
        read_scan(path)
    assert error.value.field == "file"


@pytest.mark.parametrize(
    ("name", "text", "points"),
    [
        (
            "cloud.csv",
            "x;y;z\n1,5;2;3\n4;;6\n5;6;7\n8;9;1\n",
            [[1.5, 2, 3], [5, 6, 7], [8, 9, 1]],
        ),
        ("cloud.xyz", "nan nan nan\n1 2 3\n4 5 6\n7 8 1\n", [[1, 2, 3], [4, 5, 6], [7, 8, 1]]),
        ("cloud.csv", "x,y,z\n,,\n1,2,3\n4,5,6\n7,8,1\n", [[1, 2, 3], [4, 5, 6], [7, 8, 1]]),
    ],
    ids=["one cell is empty", "a first line of nan is no names", "all cells of a line are empty"],
)
def test_what_is_empty_or_nan_is_a_point_that_is_not_finite(tmp_path, name, text, points):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    scan = read_scan(path)
    np.testing.assert_array_equal(scan.points, points)
    assert scan.dropped == 1
