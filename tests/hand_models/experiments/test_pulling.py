"""Loads along straight directions until a tile lets go: balance, limits and their symmetry."""

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import EmptySetError
from hand_models.compliance import Gripper, gripper_table, sandpaper
from hand_models.experiments import (
    PLANAR_SCALE,
    even_pulls,
    in_paper_signs,
    pull,
    unloaded,
    wrist_poses,
)

SIZE = np.array([50.0, 20.0, 1.0])


@pytest.fixture(scope="module")
def gripper():
    return Gripper(0.3, 37.0)


@pytest.fixture(scope="module")
def pulled(gripper):
    directions = even_pulls(60, SIZE)
    return directions, pull(gripper, directions)


def test_poses_give_the_wrenches_asked_for(gripper):
    wanted = np.array([[0.0, -5.0, 0.0], [6.0, -4.0, 0.1], [-6.0, -4.0, -0.1]])
    poses, residual = wrist_poses(gripper, wanted, np.repeat(unloaded(gripper)[None], 3, axis=0))
    assert residual.max() < 1e-8
    found = in_paper_signs(gripper.evaluate(poses).wrenches)
    np.testing.assert_allclose(found * PLANAR_SCALE, wanted * PLANAR_SCALE, atol=1e-8)
    # mirrored wrenches, mirrored poses
    np.testing.assert_allclose(poses[2], poses[1] * (-1.0, 1.0, -1.0), atol=1e-9)


def test_directions_are_even_and_mirrored(pulled):
    directions = pulled[0] / SIZE
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    assert (directions[:, 1] < 0.0).all()
    half = len(directions) // 2
    np.testing.assert_array_equal(directions[half:], directions[:half] * (-1.0, 1.0, -1.0))
    # a half sphere's centroid is half way up, if its points are even
    assert directions[:, 1].mean() == pytest.approx(-0.5, abs=0.03)
    nearest = np.sort(directions @ directions.T, axis=1)[:, -2]
    assert np.arccos(nearest).min() > 0.4 * np.sqrt(2.0 * np.pi / len(directions))


def test_every_pull_ends_where_the_tile_named_lets_go(gripper, pulled):
    directions, found = pulled
    length = np.linalg.norm(found.wrenches * PLANAR_SCALE, axis=1)
    unit = directions / np.linalg.norm(directions * PLANAR_SCALE, axis=1)[:, None]
    np.testing.assert_allclose(found.wrenches, length[:, None] * unit, atol=1e-9)
    verdict = gripper.evaluate(found.poses)
    assert verdict.holds.all()
    beyond, residual = wrist_poses(gripper, (length + 0.02)[:, None] * unit, found.poses)
    assert residual.max() < 1e-8
    over = gripper.evaluate(beyond)
    assert not over.holds.any()
    names = [
        None if way == "dragged_backwards" else (side, phalanx, way)
        for side, phalanx, way in zip(found.side, found.phalanx, found.way, strict=True)
    ]
    for k, name in enumerate(names):
        if name is None:
            assert over.violation[k] > 0.0
        else:
            assert tuple(gripper.limits[over.limiting[k]])[:3] == name


def test_mirrored_loads_end_alike_on_the_other_side(pulled):
    found = pulled[1]
    half = len(found.way) // 2
    np.testing.assert_allclose(
        found.wrenches[half:], found.wrenches[:half] * (-1.0, 1.0, -1.0), atol=0.02
    )
    assert found.phalanx[half:] == found.phalanx[:half]
    assert found.way[half:] == found.way[:half]
    assert all(a != b for a, b in zip(found.side[:half], found.side[half:], strict=True))


def test_a_stronger_surface_never_holds_less(pulled):
    directions, found = pulled
    table = gripper_table()
    surface = sandpaper(table)
    stronger = replace(
        surface,
        shear_limit=1.5 * surface.shear_limit,
        pull_off_limit=1.5 * surface.pull_off_limit,
        lateral_limit=1.5 * surface.lateral_limit,
    )
    more = pull(Gripper(0.3, 37.0, stronger, table), directions)
    gain = np.linalg.norm(more.wrenches * PLANAR_SCALE, axis=1) - np.linalg.norm(
        found.wrenches * PLANAR_SCALE, axis=1
    )
    assert gain.min() >= -1e-9
    # where no tile is dragged backwards, something is gained
    assert all(
        g > 0.1 for g, way in zip(gain, found.way, strict=True) if way != "dragged_backwards"
    )


def test_a_gripper_that_does_not_hold_itself_is_refused():
    weak = replace(
        sandpaper(gripper_table()), shear_limit=1.0, pull_off_limit=0.2, lateral_limit=0.9
    )
    with pytest.raises(EmptySetError, match="the closing tension alone is too large"):
        pull(Gripper(0.3, 37.0, weak), np.array([[0.0, -1.0, 0.0]]))
