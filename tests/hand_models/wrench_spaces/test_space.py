"""Views of many random hands' wrench spaces against HiGHS on the same o, V, A, b."""

import functools
import itertools
import math

import numpy as np
import pytest
from scipy.optimize import linprog

from hand_models import Cylinder, EmptySetError, Grasp, Plane
from hand_models.fixed_wrist import wrench_space
from hand_models.wrench_spaces import WRENCH_SCALE
from tests.suite.helpers.hands import HAND, ROCK, pinch, settled_at, without_hand_load

EXACT = {"primal_feasibility_tolerance": 1e-9, "dual_feasibility_tolerance": 1e-9}
SEEDS = (*range(115), 337, *range(116, 240), 406, 504, 529, 706)
"""Without a hand whose set has more vertices than are looked for, and five more on joint stops.

Joint stops are seldom: fingers meet a small ball with a side before their first joint is all bent.
"""

SELDOM = (28, 34, 42, 131, 127, 159)
"""Hands with flat sets that wrench rows cut, and one with a set of three dimensions."""

SLOW = {170}
"""Of twice as many vertices as any other of these."""

SOME = sorted({*SEEDS[::10], *SELDOM} - SLOW)


@functools.cache
def space_of(seed):
    settled = settled_at(seed)
    return None if settled is None else wrench_space(settled)


def feasible(space):
    result = linprog(
        np.zeros(len(space.columns)), space.A, space.b, bounds=(None, None), options=EXACT
    )
    return result.status == 0


@pytest.fixture(params=[SOME, pytest.param(SEEDS, marks=pytest.mark.slow)], ids=["some", "all"])
def seeds(request):
    """Random hands: a few, and where there is time for it all."""
    return request.param


@functools.cache
def is_empty(seed):
    return space_of(seed) is None or not feasible(space_of(seed))


def each_set(seeds=SEEDS):
    """Every random hand's set with something in it, its size in scaled wrenches [N], and an rng."""
    for seed in seeds:
        if is_empty(seed):
            continue
        space = space_of(seed)
        size = 1.0 + float(np.abs(space.vertices() * WRENCH_SCALE).max())
        yield space, size, np.random.default_rng(seed)


def largest(space, direction):
    """Of direction · w over the set, by HiGHS."""
    slopes = space.generators.T @ direction
    result = linprog(-slopes, space.A, space.b, bounds=(None, None), options=EXACT)
    assert result.status == 0
    return float(direction @ space.origin - result.fun)


def reach(space, start, direction):
    """Largest t with start + t direction in the set, by HiGHS."""
    m = len(space.columns)
    result = linprog(
        np.append(np.zeros(m), -1.0),
        np.hstack([space.A, np.zeros((len(space.b), 1))]),
        space.b,
        np.hstack([space.generators, -direction[:, None]]) * WRENCH_SCALE[:, None],
        (start - space.origin) * WRENCH_SCALE,
        bounds=(None, None),
        options=EXACT,
    )
    return float(result.x[-1]) if result.status == 0 else None


def mixture(rng, points):
    """A random point of the hull, and not near any one vertex."""
    some = points[rng.choice(len(points), min(len(points), 12), replace=False)]
    return rng.dirichlet(np.ones(len(some))) @ some


@functools.cache
def is_cut(seed):
    """Whether the set without its wrench rows reaches beyond one of them."""
    space = space_of(seed)
    whole = without_hand_load(space)
    held = space.s[len(space.s) - len(space.D) :]
    return any(largest(whole, d) > s for d, s in zip(space.D, held, strict=True))


def test_there_are_hands_of_every_sort_among_them(seeds):
    own = [seed for seed in seeds if not is_empty(seed)]
    spaces, count = [space_of(seed) for seed in own], len(seeds)
    assert len(spaces) >= 0.65 * count
    assert count - len(spaces) >= 0.05 * count
    assert {space.dimension for space in spaces} >= {4, 5, 6}
    assert sum(any("lateral" in c for c in space.columns) for space in spaces) >= 0.22 * count
    assert sum(any("palm" in c for c in space.columns) for space in spaces) >= 0.22 * count
    stops = sum(any(r.limit == "joint_stop" for r in space.rows) for space in spaces)
    assert stops >= max(2, count // 60)
    # wrench rows cut many, flat ones too, and leave as many as they are
    cut = [space_of(seed) for seed in own if is_cut(seed)]
    assert 0.13 * count <= len(cut) <= len(spaces) - 0.13 * count
    assert {space.dimension for space in cut} >= {4, 5, 6}


def test_a_set_is_empty_exactly_where_its_linear_program_is_infeasible(seeds):
    for seed in seeds:
        space = space_of(seed)
        if space is None:
            continue
        if feasible(space):
            assert len(space.vertices()) >= 1
        else:
            for view in (space.vertices, space.half_spaces, space.volume):
                with pytest.raises(EmptySetError):
                    view()


def test_support_is_that_of_the_linear_program_and_of_the_vertices(seeds):
    for space, size, rng in each_set(seeds):
        vertices = space.vertices()
        for _ in range(3):
            direction = rng.normal(size=6) * WRENCH_SCALE
            direction /= np.linalg.norm(direction / WRENCH_SCALE)
            expected = largest(space, direction)
            assert space.support(direction) == pytest.approx(expected, abs=1e-7 * size)
            assert (vertices @ direction).max() == pytest.approx(expected, abs=1e-7 * size)


def test_every_vertex_satisfies_every_face_and_every_face_is_met_by_its_share_of_vertices(seeds):
    for space, size, _ in each_set(seeds):
        vertices, faces, r = space.vertices(), space.half_spaces(), space.dimension
        assert faces.normals.shape[1] == faces.equation_normals.shape[1] == 6
        assert len(faces.equation_normals) == 6 - r
        off = vertices @ faces.equation_normals.T - faces.equation_offsets
        np.testing.assert_allclose(off, 0.0, atol=1e-7 * size)
        np.testing.assert_allclose(np.linalg.norm(faces.normals / WRENCH_SCALE, axis=1), 1.0)
        if len(vertices) > 4000:
            continue
        slack = faces.offsets - vertices @ faces.normals.T
        assert slack.min(initial=0.0) > -1e-7 * size
        assert ((slack < 1e-6 * size).sum(axis=0) >= r).all()


def test_no_vertex_is_a_mixture_of_others(seeds):
    for space, size, rng in each_set(seeds):
        vertices = space.vertices() * WRENCH_SCALE
        if not 2 <= len(vertices) <= 400:
            continue
        for i in rng.choice(len(vertices), min(len(vertices), 3), replace=False):
            others = np.delete(vertices, i, axis=0)
            result = linprog(
                np.zeros(len(others)),
                A_eq=np.vstack([others.T, np.ones(len(others))]),
                b_eq=np.append(vertices[i], 1.0),
                # the simplex method may give up on a vertex that stands out by little
                method="highs-ipm",
                options=EXACT,
            )
            nearest = np.linalg.norm(others - vertices[i], axis=1).min()
            assert result.status == 2 or nearest < 1e-4 * size


def test_containment_changes_where_the_linear_program_says_the_set_ends(seeds):
    for space, size, rng in each_set(seeds):
        vertices = space.vertices()
        centre = mixture(rng, vertices)
        assert space.contains(centre)
        for _ in range(2):
            direction = mixture(rng, vertices) - centre
            length = np.linalg.norm(direction * WRENCH_SCALE)
            if length < 1e-3 * size:
                continue
            end = reach(space, centre, direction)
            if end is None:
                continue  # a flat set, by rounding
            margin = 1e-5 * size / length
            assert space.contains(centre + (end - margin) * direction)
            # beyond the end by a margin the nearest face may be closer, but not within rounding
            assert not space.contains(centre + (end + 1.0) * direction, tolerance=1e-7)
            faces = space.half_spaces()
            slope, room = faces.normals @ direction, faces.offsets - faces.normals @ centre
            ahead = slope > 1e-12 * size
            assert (room[ahead] / slope[ahead]).min() == pytest.approx(end, abs=2.0 * margin)


@pytest.mark.slow
def test_off_a_flat_set_nothing_is_contained():
    flat = 0
    for space, size, rng in each_set():
        faces = space.half_spaces()
        inside = mixture(rng, space.vertices())
        for normal in faces.equation_normals / WRENCH_SCALE:
            flat += 1
            assert space.contains(inside)
            assert not space.contains(inside + 1e-4 * size * normal / WRENCH_SCALE)
    assert flat >= 50


def test_capability_ends_where_the_set_does(seeds):
    for space, size, rng in itertools.islice(each_set(seeds[::2]), 60):
        direction = mixture(rng, space.vertices())
        ends = space.capability(direction)
        if ends is None:
            # only by rounding can a flat set miss one of its own points
            assert space.dimension < 6
            continue
        low, high = ends
        margin = 1e-4 * size / np.linalg.norm(direction * WRENCH_SCALE)
        assert low - 1e-6 <= 1.0 <= high + 1e-6
        for t, past in ((low, -margin), (high, margin)):
            assert space.contains(t * direction, tolerance=1e-5 * size)
            assert reach(space, direction, np.sign(past) * direction) == pytest.approx(
                abs(t - 1.0), abs=2.0 * margin
            )


def test_a_pinch_without_lateral_can_do_nothing_sideways():
    """All its finger planes are parallel; with the palm pressing it may exert nothing at all."""
    space = wrench_space(pinch(lateral=False))
    sideways = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    assert space.support(sideways) == pytest.approx(0.0, abs=1e-9)
    assert space.support(-sideways) == pytest.approx(0.0, abs=1e-9)
    assert space.capability(sideways) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert wrench_space(pinch()).capability(sideways)[1] > 10.0


def test_a_hand_flat_on_a_wall_always_drags_it_down():
    """With all fingers forward no wrench along z alone, nor none at all, is within its reach."""
    space = wrench_space(HAND.settle(Plane(), ROCK, Grasp(palm=False)))
    assert space.support([1, 0, 0, 0, 0, 0]) < -10.0
    assert space.capability([0, 0, 1, 0, 0, 0]) is None
    assert not space.contains(np.zeros(6))
    low, high = space.capability(space.vertices().mean(axis=0))
    assert 0.0 < low <= 1.0 + 1e-9
    assert high >= 1.0 - 1e-9


def segments_volume(space):
    """Of a sum of segments, in scaled wrenches: Σ over r of them of √det(GᵀG)."""
    ends = np.array(
        [
            [largest_column(space, k, sign) for sign in (-1.0, 1.0)]
            for k in range(len(space.columns))
        ]
    )
    edges = space.generators.T * WRENCH_SCALE * (ends[:, 1] - ends[:, 0])[:, None]
    r = np.linalg.matrix_rank(edges, tol=1e-7 * np.abs(edges).max())
    total = 0.0
    for chosen in itertools.combinations(edges, r):
        gram = np.array(chosen) @ np.array(chosen).T
        total += math.sqrt(max(np.linalg.det(gram), 0.0))
    return total, r


def largest_column(space, k, sign):
    cost = np.zeros(len(space.columns))
    cost[k] = -sign
    return float(linprog(cost, space.A, space.b, bounds=(None, None)).x[k])


def test_volume_without_lateral_is_that_of_a_zonotope(seeds):
    checked, wanted = 0, min(50, len(seeds) // 3)
    for held, _, _ in each_set(seeds):
        space = without_hand_load(held)
        if not any("lateral" in c for c in space.columns) and space.dimension:
            expected, r = segments_volume(space)
            volume, dimension = space.volume()
            assert dimension == r
            assert volume == pytest.approx(expected, rel=1e-4)
            checked += 1
        if checked == wanted:
            break
    assert checked == wanted


def test_what_wrench_rows_cut_off_is_the_share_of_random_points_beyond_them(seeds):
    checked = 0
    for seed in seeds:
        if is_empty(seed) or not 2 <= space_of(seed).dimension <= 4 or not is_cut(seed):
            continue
        space, rng = space_of(seed), np.random.default_rng(seed)
        whole = without_hand_load(space)
        faces = whole.half_spaces()
        # points of the whole set, from a box about it in its own flat
        corners = whole.vertices() * WRENCH_SCALE
        base = corners.mean(axis=0)
        _, _, axes = np.linalg.svd(corners - base, full_matrices=False)
        axes = axes[: space.dimension]
        inside = (corners - base) @ axes.T
        points = rng.uniform(inside.min(axis=0), inside.max(axis=0), (40_000, space.dimension))
        points = (base + points @ axes) / WRENCH_SCALE
        points = points[(points @ faces.normals.T <= faces.offsets).all(axis=1)]
        held = space.s[len(space.s) - len(space.D) :]
        share = (points @ space.D.T <= held).all(axis=1).mean()
        ratio = space.volume()[0] / whole.volume()[0]
        spread = math.sqrt(max(share * (1.0 - share), 1e-3) / len(points))
        assert abs(ratio - share) < 5.0 * spread
        checked += 1
    assert checked >= 4


def test_half_planes_only_ever_add_to_the_set():
    for palm in (False, True):
        grasp = Grasp(outer_rotation=math.pi, palm=palm, lateral=False)
        sets = []
        for k in (1, 2, 4):
            surface = ROCK.from_values({"shear_limit": 63.0, "half_planes": k})
            sets.append(wrench_space(HAND.settle(Cylinder(0.3), surface, grasp)))
        for coarse, fine in itertools.pairwise(sets):
            assert all(fine.contains(vertex, 1e-6) for vertex in coarse.vertices())
            assert fine.volume()[0] > coarse.volume()[0]
