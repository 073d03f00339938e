"""Sets that are listed, and meshes that are welded, are broken off where the time is over."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest

from hand_models.base import broken_off_by
from hand_models.rock import Mesh
from hand_models.rock.surface import Triangles, grid
from hand_models.rock.triangles import weld
from service.answering import handle
from tests.suite.helpers.requests import wall_request


class EnoughError(Exception):
    """Whoever asked has had enough."""


def space_request(half_planes: int, lateral: bool, diameter: float) -> bytes:
    """A small legal question whose answer goes through thousands of candidates."""
    stance = wall_request()["stance"]
    hand = stance["hands"][0]
    hand["hold"]["diameter"] = diameter
    hand["grasp"]["lateral"] = lateral
    numbers = {"shear_limit": 60.0, "pull_off_limit": 15.0, "pull_off_angle": 0.7}
    hand["surface"] = numbers | {"half_planes": half_planes}
    asked = {"v": 1, "stance": stance, "limb": hand["limb"], "want": ["vertices"]}
    return json.dumps(asked).encode()


def listed(payload: bytes) -> object:
    answer = handle("crux/robosimian/wrench_space", payload)
    assert answer.good, answer.payload
    return json.loads(answer.payload)["vertices"]


def mesh(count: int, seed: int) -> Triangles:
    """Triangles with vertices of their own, so that each is there several times."""
    heights = np.random.default_rng(seed).uniform(0.0, 0.005, (count, count))
    x, y = np.meshgrid(*[np.linspace(-0.3, 0.3, count)] * 2, indexing="ij")
    one = grid(np.stack([x, y, heights], axis=-1))
    faces = np.arange(one.faces.size).reshape(-1, 3)
    return Triangles(one.vertices[one.faces[:, ::-1]].reshape(-1, 3), faces)


def looks(work: Callable[[], object], most: float = np.inf) -> int:
    """Do work that is broken off at the so manieth look; return how many there were."""
    count = 0

    def check() -> None:
        nonlocal count
        count += 1
        if count >= most:
            raise EnoughError

    with broken_off_by(check):
        work()
    return count


@pytest.mark.parametrize(
    ("half_planes", "lateral", "diameter", "least"),
    [
        (2, True, 0.26, 10),
        *((planes, False, 0.28 + 0.01 * planes, 2) for planes in (3, 8)),
    ],
)
def test_vertices_are_broken_off_wherever_they_are_and_found_again(
    half_planes: int, lateral: bool, diameter: float, least: int
) -> None:
    def work() -> object:
        return raising(half_planes, lateral, diameter)

    whole = listed(space_request(half_planes, lateral, diameter))
    # each is a chunk of candidates, a cut or a linear program
    count = looks(work)
    assert count > least
    for part in (0.0, 0.5):
        with pytest.raises(EnoughError):
            looks(work, 1 + int(part * count))
    assert listed(space_request(half_planes, lateral, diameter)) == whole


def raising(half_planes: int, lateral: bool, diameter: float) -> object:
    """List vertices beneath the service, which makes an answer of every error."""
    from service.answering import dispatch
    from service.requests import WrenchSpaceRequest
    from service.wire import decode_request

    asked = decode_request(space_request(half_planes, lateral, diameter), WrenchSpaceRequest)
    return dispatch.SERVICES_BY_NAME["wrench_space"].answer(
        asked, dispatch.BUNDLED_ROBOTS, dispatch.LOCAL_STREAMS
    )


def test_a_mesh_is_broken_off_at_each_step_of_its_welding() -> None:
    given = mesh(60, 1)
    whole = Mesh(*given)
    count = looks(lambda: Mesh(*given))
    assert count >= 10
    for step in range(1, count + 1):
        with pytest.raises(EnoughError):
            looks(lambda: Mesh(*given), step)
    np.testing.assert_array_equal(Mesh(*given).triangles.vertices, whole.triangles.vertices)


def merged_one_by_one(given: Triangles) -> Triangles:
    """Weld by a dictionary of the vertices seen so far."""
    places: dict[tuple[int, ...], int] = {}
    vertices: list[np.ndarray] = []
    named = np.zeros(len(given.vertices), dtype=int)
    for i in np.unique(given.faces):
        key = tuple(np.round(given.vertices[i] * 1e8).astype(int))
        if key not in places:
            places[key] = len(vertices)
            vertices.append(given.vertices[i])
        named[i] = places[key]
    faces = []
    seen = set()
    for face in named[given.faces]:
        a, b, c = (vertices[k] for k in face)
        name = tuple(sorted(face))
        if len(set(name)) == 3 and name not in seen and np.linalg.norm(np.cross(b - a, c - a)) > 0:
            faces.append(face)
        seen.add(name)
    used = np.unique(faces)
    return Triangles(np.array(vertices)[used], np.searchsorted(used, faces))


def test_vertices_that_coincide_become_the_first_of_them() -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        whole = mesh(int(rng.integers(3, 12)), seed)
        # some doubled exactly, some to within rounding, some that no triangle names, in any order
        vertices = whole.vertices + rng.choice([0.0, 1e-12], whole.vertices.shape)
        vertices = np.vstack([vertices, rng.normal(size=(5, 3))])
        faces = rng.permutation(np.vstack([whole.faces, whole.faces[:3]]))
        given = Triangles(vertices, faces)
        found, expected = weld(given), merged_one_by_one(given)
        np.testing.assert_array_equal(found.vertices, expected.vertices)
        np.testing.assert_array_equal(found.faces, expected.faces)
