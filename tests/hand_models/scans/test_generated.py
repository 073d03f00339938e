"""Generated walls: the same ones from the same numbers, of rock that a hand can be put on."""

from pathlib import Path

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable, wall_table
from hand_models.rock import Mesh
from hand_models.scans import generate_wall, read_rock, wall_names


def changed(name, **numbers):
    """The bundled table with other numbers for a wall."""
    entries = {key: {**entry_of(name, key), "value": value} for key, value in numbers.items()}
    return wall_table().replaced(ParameterTable.of({name: entries}))


def entry_of(name, key):
    quantity = wall_table().quantity(name, key)
    return {"unit": quantity.unit, "source": quantity.source, "note": quantity.note}


def heights(wall):
    """Heights out of the wall of its grid's points, by x and y."""
    columns = len(np.unique(wall.vertices[:, 1]))
    return -wall.vertices[:, 2].reshape(columns, -1).T


def test_a_seed_is_a_wall():
    first, again, other = (generate_wall("small-wall", seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.vertices, again.vertices)
    assert np.abs(first.vertices - other.vertices).max() > 0.01
    assert read_rock(Path("small-wall:3")).vertices.tobytes() == first.vertices.tobytes()


@pytest.mark.parametrize("name", ["small-wall", "blocked-wall", "knob-wall"])
def test_it_has_the_size_and_the_side_that_it_says(name):
    wall, table = generate_wall(name), wall_table()
    sides = [table.scalar(name, "height"), table.scalar(name, "width")]
    np.testing.assert_allclose(np.ptp(wall.vertices[:, :2], axis=0), sides, atol=1e-12)
    corners = wall.vertices[wall.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] < 0.0).all()  # toward the climber
    np.testing.assert_allclose(-normals[:, 2].sum() / 2.0, np.prod(sides) - gap_of(name) * sides[1])
    assert not Mesh(wall.vertices, wall.faces, anywhere=True).oddities


def gap_of(name):
    low, high = wall_table().vector(name, "gap")
    return high - low


def test_it_leans_back_from_its_foot():
    for lean in (0.0, 0.8):
        wall = generate_wall("small-wall", lean=lean)
        up, into = wall.pose.rotation[:, 0], wall.pose.rotation[:, 2]
        np.testing.assert_allclose(up, [np.sin(lean), 0.0, np.cos(lean)], atol=1e-15)
        np.testing.assert_allclose(into, [np.cos(lean), 0.0, -np.sin(lean)], atol=1e-15)
        np.testing.assert_allclose(np.cross(into, up), wall.pose.rotation[:, 1], atol=1e-15)
        foot = wall.vertices[:, 0] == wall.vertices[:, 0].min()
        middle = np.append(wall.vertices[foot, :2].mean(axis=0), 0.0)
        np.testing.assert_allclose(wall.pose.apply(middle), np.zeros(3), atol=1e-12)


def test_rough_rock_has_the_height_and_the_slope_of_its_spectrum():
    # without knobs; steps over 8 points are 8^hurst times those over one of a fractal
    for hurst in (0.3, 0.7):
        table = changed("small-wall", knobs=0, hurst=hurst, roughness=0.02, height=3.0, width=3.0)
        z = heights(generate_wall("small-wall", 1, table=table))
        assert z.std() == pytest.approx(0.02)
        steps = [np.sqrt(np.mean((z[n:] - z[:-n]) ** 2)) for n in (4, 16)]
        assert np.log(steps[1] / steps[0]) / np.log(4.0) == pytest.approx(hurst, abs=0.12)


def test_knobs_stand_out_of_a_smooth_wall():
    ball = {"knob_radius": [0.1, 0.1], "knob_height": [0.04, 0.04], "knob_shape": 0.5}
    table = changed("small-wall", knobs=1, roughness=0.0, **ball)
    wall = generate_wall("small-wall", 2, table=table)
    z = heights(wall) - heights(wall).min()
    assert z.max() == pytest.approx(0.04, abs=1e-3)
    # half an ellipsoid, in whole or cut off by the wall's border
    volume = z.sum() * 1e-4
    assert 0.2 < volume / (2.0 / 3.0 * np.pi * 0.1**2 * 0.04) < 1.01


def test_nothing_is_left_of_what_is_in_the_gap():
    wall = generate_wall("blocked-wall")
    low, high = wall_table().vector("blocked-wall", "gap")
    x = wall.vertices[:, 0]
    assert not ((x > low + 1e-9) & (x < high - 1e-9)).any()
    assert len(np.unique(wall.faces)) == len(wall.vertices)
    sides = np.sign(x)[wall.faces]
    assert (np.ptp(sides, axis=1) == 0.0).all()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("no-wall", "no file no-wall, and no wall of this name; generated walls are leaning-wall"),
        ("small-wall:-1", "the seed of a wall must be a whole number, got '-1'"),
        ("small-wall:", "the seed of a wall must be a whole number, got ''"),
        ("gone.ply", "no such file: gone.ply"),
    ],
)
def test_what_is_neither_a_file_nor_a_wall(asked, said):
    with pytest.raises(InvalidInputError) as caught:
        read_rock(Path(asked))
    assert said in str(caught.value)


def test_a_file_comes_before_a_wall_of_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("small-wall").write_text("not a mesh")
    with pytest.raises(InvalidInputError, match="a mesh file ends in"):
        read_rock(Path("small-wall"))


def test_impossible_numbers():
    assert wall_names() == ("leaning-wall", "blocked-wall", "small-wall", "knob-wall")
    with pytest.raises(InvalidInputError, match="unknown wall 'high'"):
        generate_wall("high")
    with pytest.raises(InvalidInputError, match="at least 0, got -1"):
        generate_wall("small-wall", -1)
    with pytest.raises(InvalidInputError, match=r"small-wall\.spacing: must be at most the wall"):
        generate_wall("small-wall", table=changed("small-wall", spacing=3.5))
