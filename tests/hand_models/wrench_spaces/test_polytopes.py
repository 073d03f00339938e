"""The views of a WrenchSpace on sets made to be known, thin, flat, unbounded or empty."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given, reject, strategies as st
from scipy.linalg import block_diag
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from hand_models import EmptySetError, InvalidInputError, WrenchSpace
from hand_models.base import LimitError, SolverError, UnsupportedError
from hand_models.wrench_spaces import WRENCH_SCALE, Row, hull_facets
from hand_models.wrench_spaces.clipping import clipped
from hand_models.wrench_spaces.half_spaces import Facets
from hand_models.wrench_spaces.linear_programs import linear_program
from hand_models.wrench_spaces.polytopes import polytope
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)

BOX = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
INTERVAL = np.array([[1.0], [-1.0]])


def space(A, b, V, origin=None):
    """{ o + V y : A y ≤ b } with V in scaled wrenches [N] and every row hard."""
    A, V = np.asarray(A, dtype=float), np.asarray(V, dtype=float)
    m = V.shape[1]
    return WrenchSpace(
        origin=np.zeros(6) if origin is None else np.asarray(origin, dtype=float),
        generators=V / WRENCH_SCALE[:, None],
        columns=tuple(f"y{i}" for i in range(m)),
        rows=tuple(Row(None, None, "made", "hard", f"row {i}") for i in range(len(b))),
        L=np.zeros((0, m)),
        l0=np.zeros(0),
        s=np.zeros(0),
        H=A.reshape(len(b), m),
        h=np.asarray(b, dtype=float),
    )


def polygon(rng, k):
    """Rows of a bounded polygon with up to k sides about the origin."""
    turns = np.append(rng.uniform(0.0, math.tau, k), rng.uniform(0.0, 0.1) + np.arange(3) * 2.1)
    return np.column_stack([np.cos(turns), np.sin(turns)]), rng.uniform(0.5, 2.0, k + 3)


def random_sum(seed, thinness=0.0):
    """Segments and polygons in random planes, thin by 10^−thinness in some directions.

    Returns the set, every sum of the parts' corners in scaled wrenches, and the generator.
    """
    rng = np.random.default_rng(seed)
    A, b, corners = [], [], []
    for _ in range(rng.integers(2, 6)):
        a, h = polygon(rng, 4) if rng.random() < 0.5 else (INTERVAL, rng.uniform(0.1, 1.0, 2))
        A.append(a)
        b.append(h * 10.0 ** rng.uniform(0.0, 2.0))
        if a.shape[1] == 1:
            corners.append(b[-1][:, None] * INTERVAL)
        else:
            cut = HalfspaceIntersection(np.column_stack([a, -b[-1]]), np.zeros(2))
            corners.append(cut.intersections)
    A, b = block_diag(*A), np.concatenate(b)
    thick = np.where(rng.permutation(6) < rng.integers(1, 4), 10.0**-thinness, 1.0)
    turn = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    V = turn @ (thick[:, None] * rng.normal(size=(6, A.shape[1])))
    sums = np.array([np.concatenate(y) for y in itertools.product(*corners)]) @ V.T
    return space(A, b, V), sums, rng


def highest(made, direction):
    slopes = made.generators.T @ direction
    return -linprog(-slopes, made.A, made.b, bounds=(None, None)).fun + direction @ made.origin


def test_a_box_in_six_dimensions():
    A = np.vstack([np.eye(6), -np.eye(6)])
    made = space(A, np.ones(12), np.diag([1.0, 2, 3, 4, 5, 6]), origin=[1, 1, 1, 0, 0, 0])
    corners = (
        np.array(list(itertools.product((-1.0, 1.0), repeat=6))) * [1, 2, 3, 4, 5, 6] / WRENCH_SCALE
    )
    got = made.vertices() - made.origin
    assert sorted(map(tuple, got.round(9))) == sorted(map(tuple, corners.round(9)))
    faces = made.half_spaces()
    assert faces.normals.shape == (12, 6)
    assert faces.equation_normals.shape == (0, 6)
    assert made.volume() == (pytest.approx(2.0**6 * 720.0), 6)


def test_orthogonal_blocks_have_the_product_of_their_areas():
    rng = np.random.default_rng(1)
    (A1, b1), (A2, b2) = polygon(rng, 5), polygon(rng, 3)
    made = space(block_diag(A1, A2, INTERVAL, INTERVAL), [*b1, *b2, 1.0, 2.0, 3.0, 4.0], np.eye(6))
    areas = [
        ConvexHull(HalfspaceIntersection(np.column_stack([A, -b]), np.zeros(2)).intersections)
        for A, b in ((A1, b1), (A2, b2))
    ]
    volume, r = made.volume()
    assert r == 6
    assert volume == pytest.approx(areas[0].volume * areas[1].volume * 3.0 * 7.0)
    assert len(made.vertices()) == math.prod(len(hull.vertices) for hull in areas) * 4


def test_a_hull_of_points_that_are_off_by_rounding_has_no_facets_of_its_own():
    """Of a cube of six dimensions with corners cut: Qhull gives up at one in two hundred."""
    for seed in (140, 208):
        rng = np.random.default_rng(seed)
        A = np.vstack([rng.normal(size=(6, 6)), np.eye(6), -np.eye(6)])
        b = rng.uniform(0.3, 2.0, len(A))
        V = np.linalg.qr(rng.normal(size=(6, 6)))[0]
        points = space(A, b, V).vertices() * WRENCH_SCALE
        norms = np.linalg.norm(A, axis=1)
        rows, sizes = A @ V.T / norms[:, None], b / norms
        for k in range(10):
            rng = np.random.default_rng(k)
            moved = points + rng.normal(size=points.shape) * 1e-15
            for normal, offset in zip(
                *hull_facets(moved[rng.permutation(len(moved))]), strict=True
            ):
                assert (np.abs(rows - normal).max(axis=1) + np.abs(sizes - offset)).min() < 1e-7


@given_some(4, 25, seeds, st.integers(3, 6))
@example(150, 6)
def test_one_block_of_many_columns_is_the_polytope_of_its_rows(seed, d):
    rng = np.random.default_rng(seed)
    A = np.vstack([rng.normal(size=(d, d)), np.eye(d), -np.eye(d)])
    b = rng.uniform(0.3, 2.0, len(A))
    V = np.linalg.qr(rng.normal(size=(6, 6)))[0][:, :d]
    made = space(A, b, V)
    expected = HalfspaceIntersection(np.column_stack([A, -b]), np.zeros(d)).intersections @ V.T
    got = made.vertices() * WRENCH_SCALE
    gaps = np.linalg.norm(got[:, None] - expected, axis=2)
    assert gaps.min(axis=1).max() < 1e-7
    assert gaps.min(axis=0).max() < 1e-7
    assert made.dimension == d
    norms = np.linalg.norm(A, axis=1)
    faces = made.half_spaces()
    for normal, offset in zip(faces.normals / WRENCH_SCALE, faces.offsets, strict=True):
        off = np.abs(A @ V.T / norms[:, None] - normal).max(axis=1) + np.abs(b / norms - offset)
        assert off.min() < 1e-7
    hull = ConvexHull(expected @ V, qhull_options="QJ")
    assert made.volume()[0] == pytest.approx(hull.volume, rel=2e-4)


@given(seeds, st.sampled_from([0.0, 2.0, 4.0, 5.5]))
@example(112974, 5.5)
def test_thin_sets_have_all_their_faces_and_vertices(seed, thinness):
    made, _, rng = random_sum(seed, thinness)
    vertices, faces = made.vertices() * WRENCH_SCALE, made.half_spaces()
    size = 1.0 + np.abs(vertices).max()
    slack = faces.offsets - vertices @ (faces.normals / WRENCH_SCALE).T
    assert slack.min() > -1e-7 * size
    for _ in range(4):
        direction = rng.normal(size=6)
        direction /= np.linalg.norm(direction)
        expected = highest(made, direction * WRENCH_SCALE)
        assert (vertices @ direction).max() == pytest.approx(expected, abs=1e-7 * size)
    # the faces alone bound it: from one vertex toward any other and on, they end it there
    start, others = vertices[0], vertices[1:]
    for other in others[rng.choice(len(others), min(len(others), 5), replace=False)]:
        way = 2.0 * (other - start)
        assert not made.contains((start + way) / WRENCH_SCALE, 1e-9 * size)
        assert made.contains(other / WRENCH_SCALE, 1e-7 * size)


@given_some(8, 40, seeds)
def test_faces_and_vertices_both_reach_as_far_as_all_sums_of_the_parts_corners(seed):
    made, sums, rng = random_sum(seed)
    faces, vertices = made.half_spaces(), made.vertices() * WRENCH_SCALE
    exact = 1e-8 * (1.0 + np.abs(sums).max())
    normals = faces.normals / WRENCH_SCALE
    np.testing.assert_allclose((sums @ normals.T).max(axis=0), faces.offsets, atol=exact)
    directions = rng.normal(size=(6, 300))
    reach = (sums @ directions).max(axis=0)
    np.testing.assert_allclose((vertices @ directions).max(axis=0), reach, atol=10.0 * exact)
    for direction, expected in zip(directions.T[:4], reach, strict=False):
        equations = (faces.equation_normals / WRENCH_SCALE, faces.equation_offsets)
        bounded_by_faces = linprog(
            -direction, normals, faces.offsets, *equations, bounds=(None, None)
        )
        assert -bounded_by_faces.fun == pytest.approx(expected, rel=1e-6)


def test_parallel_segments_add_up_to_one():
    V = np.outer([1.0, 2.0, 2.0, 0, 0, 0], [1.0, -2.0, 3.0])
    made = space(block_diag(*[INTERVAL] * 3), np.ones(6), V)
    assert made.dimension == 1
    np.testing.assert_allclose(sorted(made.vertices()[:, 0]), [-6.0, 6.0])
    assert made.volume() == (pytest.approx(12.0 * 3.0), 1)
    assert len(made.half_spaces().equation_normals) == 5


def test_a_polygon_in_space_is_flat():
    V = np.zeros((6, 2))
    V[0, 0], V[4, 1] = 1.0, 2.0
    made = space(BOX, [1.0, 1.0, 3.0, 3.0], V, origin=[0, 7, 0, 0, 0, 0])
    assert len(made.vertices()) == 4
    assert made.volume() == (pytest.approx(2.0 * 12.0), 2)
    faces = made.half_spaces()
    assert (len(faces.normals), len(faces.equation_normals)) == (4, 4)
    assert made.contains([0.5, 7, 0, 0, 0.5, 0])
    assert not made.contains([0.5, 7.001, 0, 0, 0.5, 0])
    assert not made.contains([1.001, 7, 0, 0, 0.5, 0])


@pytest.mark.parametrize(
    ("A", "b", "V", "shift"),
    [
        (np.zeros((0, 0)), [], np.zeros((6, 0)), [0, 0, 0]),
        (INTERVAL, [2.0, -2.0], np.eye(6)[:, :1], [2, 0, 0]),  # an interval of no length
        (INTERVAL, [1.0, 1.0], np.zeros((6, 1)), [0, 0, 0]),  # a generator that does nothing
        (BOX, [2.0, -2.0, 1.0, -1.0], np.eye(6)[:, :2], [2, 1, 0]),
    ],
)
def test_a_point(A, b, V, shift):
    made = space(A, b, V, origin=[1, 2, 3, 4, 5, 6])
    where = np.add([1.0, 2, 3, 4, 5, 6], [*shift, 0, 0, 0])
    np.testing.assert_allclose(made.vertices(), [where])
    assert (made.dimension, made.volume()) == (0, (0.0, 0))
    faces = made.half_spaces()
    assert (len(faces.normals), len(faces.equation_normals)) == (0, 6)
    assert made.contains(where)
    assert not made.contains(np.add(where, [0, 0, 1e-4, 0, 0, 0]))
    assert made.support([0, 0, 1, 0, 0, 0]) == pytest.approx(where[2])


def test_a_row_that_never_matters_does_not_loosen_the_others():
    """y ≤ 1 and y ≥ −1, and 1e-12 y ≤ 1, whose bound is a thousand thousand million away."""
    A = [[1.0], [-1.0], [1e-12], [-1e-13]]
    made = space(A, np.ones(4), np.eye(6)[:, :1])
    np.testing.assert_allclose(sorted(made.vertices()[:, 0]), [-1.0, 1.0])
    # and in a square of side 2 with one corner cut off
    cut = np.vstack([BOX, [[1.0, 1.0], [1e-12, 1e-13]]])
    made = space(cut, [1.0, 1.0, 1.0, 1.0, 1.5, 1.0], np.eye(6)[:, :2])
    assert len(made.vertices()) == 5
    assert made.volume() == (pytest.approx(4.0 - 0.125), 2)


@pytest.mark.parametrize(
    ("A", "b"),
    [
        (INTERVAL, [-1.0, -1.0]),
        (np.vstack([BOX, [[1.0, 1.0]]]), [1.0, 1.0, 1.0, 1.0, -2.1]),
        (np.vstack([np.eye(3), -np.eye(3), np.ones((1, 3))]), [1, 1, 1, 1, 1, 1, -3.1]),
        (np.vstack([INTERVAL, [[0.0]]]), [1.0, 1.0, -1.0]),  # a row of zeros: 0 ≤ −1
    ],
)
def test_contradictory_rows_leave_an_empty_set(A, b):
    made = space(A, b, np.eye(6)[:, : A.shape[1]])
    for view in (made.vertices, made.half_spaces, made.volume):
        with pytest.raises(EmptySetError):
            view()
    with pytest.raises(EmptySetError):
        made.support(np.ones(6))
    assert made.capability(np.eye(6)[0]) is None


@pytest.mark.parametrize(
    "A", [[[1.0]], [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], np.vstack([np.eye(3), -np.eye(3)[:2]])]
)
def test_an_unbounded_block_is_an_error_and_not_a_number(A):
    made = space(A, np.ones(len(A)), np.eye(6)[:, : np.shape(A)[1]])
    with pytest.raises(SolverError, match="no limit bounds"):
        made.vertices()


@pytest.mark.parametrize("count", [3, 40, 460])
def test_a_polygon_of_many_rows_has_the_corners_of_its_rows(count):
    rng = np.random.default_rng(count)
    turns = np.append(rng.uniform(0.0, math.tau, count), [0.0, 2.0, 4.0])
    A = np.column_stack([np.cos(turns), np.sin(turns)]) * rng.uniform(0.1, 10.0, (count + 3, 1))
    b = np.linalg.norm(A, axis=1) * rng.choice([1.0, 1.0, rng.uniform(1.0, 3.0)], count + 3)
    # the same again, and one through a corner, change nothing
    found = polytope(np.vstack([A, A]), np.tile(b, 2)).vertices
    expected = HalfspaceIntersection(np.column_stack([A, -b]), np.zeros(2)).intersections
    gaps = np.linalg.norm(found[:, None] - expected, axis=2)
    assert max(gaps.min(axis=0).max(), gaps.min(axis=1).max()) < 1e-7
    corner = found[0]
    tighter = np.vstack([A, corner])
    assert len(polytope(tighter, np.append(b, corner @ corner)).vertices) == len(found)


def test_sizes_told_beforehand_are_those_that_are_found():
    for seed in range(12):
        made, sums, _ = random_sum(seed)
        sizes = made.sizes()
        assert sizes.vertices == len(sums)
        assert len(made.vertices()) <= sizes.vertices
        found = len(made.half_spaces().offsets)
        assert 0.6 * found <= sizes.half_spaces <= 1.6 * found, (seed, sizes)


def test_sizes_of_one_block_are_exact_and_too_many_of_its_rows_are_refused_beforehand():
    rng = np.random.default_rng(3)
    A = np.vstack([np.eye(6), -np.eye(6), rng.normal(size=(6, 6))])
    made = space(A, np.ones(18), np.eye(6))
    assert made.sizes() == (len(made.vertices()), len(made.half_spaces().offsets))
    sphere = rng.normal(size=(300, 6))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    many = space(sphere, np.ones(300), np.eye(6))
    with pytest.raises(LimitError, match="300 coupled rows"):
        many.sizes()
    for direction in rng.normal(size=(4, 6)):
        assert many.support(direction) == pytest.approx(highest(many, direction))
    with pytest.raises(EmptySetError):
        space(np.vstack([sphere, -sphere]), np.tile(-np.ones(300), 2), np.eye(6)).support(sphere[0])


def test_half_spaces_of_a_sum_that_wrench_rows_cut_take_its_vertices_too():
    made = space(block_diag(BOX, BOX), np.ones(8), np.eye(6)[:, :4])
    assert made.sizes().half_spaces == 8
    cut = WrenchSpace(
        origin=made.origin,
        generators=made.generators,
        columns=made.columns,
        rows=(Row(None, None, "held", "limit", "held"), *made.rows),
        L=made.generators[:1],
        l0=np.zeros(1),
        s=np.array([0.5]),
        H=made.H,
        h=made.h,
        D=np.eye(6)[:1],
    )
    assert cut.sizes() == (16, 16)
    assert len(cut.vertices()) == 16


def test_too_many_candidates_are_refused_before_they_fill_the_memory():
    turns = np.arange(130) * math.tau / 130
    A = np.column_stack([np.cos(turns), np.sin(turns)])
    made = space(block_diag(A, A, A), np.ones(390), np.random.default_rng(0).normal(size=(6, 6)))
    with pytest.raises(LimitError, match="half_planes"):
        made.half_spaces()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("origin", np.zeros(5), "origin"),
        ("generators", np.zeros((6, 2)), "generators"),
        ("h", np.zeros(3), "H"),
        ("rows", (), "rows"),
    ],
)
def test_parts_that_do_not_fit_are_refused_by_name(name, value, message):
    made = space(INTERVAL, [1.0, 1.0], np.eye(6)[:, :1])
    parts = {field: getattr(made, field) for field in made.__dataclass_fields__}
    with pytest.raises(InvalidInputError) as caught:
        WrenchSpace(**{**parts, name: value})
    assert caught.value.field == message


@pytest.mark.parametrize("capacity", [0.0, -1.0, math.nan])
def test_a_limit_needs_a_capacity_above_zero(capacity):
    row = Row(None, None, "made", "limit", "made")
    with pytest.raises(InvalidInputError, match="above zero"):
        WrenchSpace(
            np.zeros(6), np.ones((6, 1)), ("y",), (row,), np.ones((1, 1)), np.zeros(1),
            np.array([capacity]), np.zeros((0, 1)), np.zeros(0),
        )  # fmt: skip


# Clipping ---------------------------------------------------------------------------------------


def cube(r):
    """Vertices and facets of [0, 1]^r."""
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=r)))
    return corners, Facets(np.vstack([np.eye(r), -np.eye(r)]), np.repeat([1.0, 0.0], r))


@pytest.mark.parametrize("r", [1, 2, 3, 4, 5, 6])
@pytest.mark.parametrize("part", [0.5, 1.0])
def test_the_corner_of_a_cube_is_a_simplex(r, part):
    """Of sides ``part`` of the cube's: r + 1 vertices and facets, but r of each on the line."""
    cut = Facets(np.full((1, r), r**-0.5), np.array([part * r**-0.5]))
    vertices, faces = clipped(*cube(r), cut, 1e-9)
    expected = part * np.vstack([np.zeros(r), np.eye(r)])
    gaps = np.abs(vertices[:, None] - expected).max(axis=2)
    assert len(vertices) == r + 1
    assert gaps.min(axis=0).max() < 1e-12
    assert len(faces.offsets) == r + 1


def test_a_cut_beyond_everything_leaves_nothing_and_one_that_misses_leaves_all():
    vertices, faces = cube(3)
    up = np.array([[0.0, 0.0, 1.0]])
    assert clipped(vertices, faces, Facets(up, np.array([-0.1])), 1e-9) is None
    kept, same = clipped(vertices, faces, Facets(up, np.array([1.1])), 1e-9)
    np.testing.assert_array_equal(kept, vertices)
    assert len(same.offsets) == 6


def test_a_cut_through_vertices_keeps_them_and_adds_none_beside_them():
    """A cube halved along the diagonals of two faces is a prism."""
    half = Facets(np.array([[1.0, 1.0, 0.0]]) / math.sqrt(2.0), np.array([1.0 / math.sqrt(2.0)]))
    vertices, faces = clipped(*cube(3), half, 1e-9)
    assert len(vertices) == 6
    assert set(map(tuple, vertices)) <= set(map(tuple, cube(3)[0]))
    assert len(faces.offsets) == 5


@given_some(8, 60, seeds, st.integers(2, 6))
def test_cuts_leave_what_qhull_says_of_all_half_spaces_together(seed, r):
    rng = np.random.default_rng(seed)
    vertices, faces = cube(r)
    normals = rng.normal(size=(rng.integers(1, 7), r))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    inside = rng.uniform(0.2, 0.8, r)
    cuts = Facets(normals, normals @ inside + rng.uniform(0.05, 0.4, len(normals)))
    found, left = clipped(vertices, faces, cuts, 1e-10)
    every = np.vstack([np.column_stack([n, -o]) for n, o in (faces, cuts)])
    corners = HalfspaceIntersection(every, inside).intersections
    gaps = np.abs(found[:, None] - corners).max(axis=2)
    assert gaps.min(axis=0).max() < 1e-6
    assert gaps.min(axis=1).max() < 1e-6
    try:
        hull, said = ConvexHull(found), ConvexHull(corners)
    except QhullError:  # faces too close to one plane for it to merge: it says nothing
        reject()
    assert hull.volume == pytest.approx(said.volume, rel=1e-9)
    assert (found @ left.normals.T <= left.offsets + 1e-8).all()
    bounding = {tuple(row) for row in np.round(said.equations, 6) + 0.0}
    ours = np.round(np.column_stack([left.normals, -left.offsets]), 6) + 0.0
    assert {tuple(row) for row in ours} == bounding


# Linear programs ----------------------------------------------------------------------------------


def test_a_linear_program_is_solved_or_empty_or_has_no_bound():
    cost, b = np.array([1.0, 2.0]), np.array([1.0, 1.0, 3.0, 0.5])
    np.testing.assert_allclose(linear_program(cost, BOX, b, "it"), [-1.0, -0.5])
    assert linear_program(cost, BOX, np.array([1.0, -2.0, 1.0, 1.0]), "it") is None
    with pytest.raises(UnsupportedError, match="it is unbounded"):
        linear_program(cost, BOX[:3], b[:3], "it", tolerance=1e-9)


def test_what_a_presolve_leaves_undecided_is_asked_again_without(monkeypatch):
    asked = []

    def undecided(*arguments, options, **more):
        asked.append(options["presolve"])
        found = linprog(*arguments, options=options, **more)
        if options["presolve"]:
            found.status, found.x = 4, None
        return found

    monkeypatch.setattr("scipy.optimize.linprog", undecided)
    np.testing.assert_allclose(linear_program(np.ones(2), BOX, np.ones(4), "it"), [-1.0, -1.0])
    assert asked == [True, False]
    never = SimpleNamespace(status=4, x=None, message="undecided")
    monkeypatch.setattr("scipy.optimize.linprog", lambda *_, **__: never)
    with pytest.raises(SolverError, match="it: "):
        linear_program(np.ones(2), BOX, np.ones(4), "it")
