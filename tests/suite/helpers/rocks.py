"""Rock from the outside: how far points are from a hold, without the code's sections.

Distances are signed, negative inside the rock, and exact for every hold here, so that a point is on
the rock exactly where its distance is zero. Of a profile with strips it is the distance from the
outline of the point's own strip; a mesh has to be closed.
"""

from __future__ import annotations

import math

import numpy as np
import trimesh
from matplotlib.path import Path
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.rock import Cylinder, Edge, Ellipsoid, Hold, Mesh, Plane, Profile, Sphere


def distance(hold: Hold, points: np.ndarray) -> np.ndarray:
    """Of points (..., 3) in the hold's frame [m]."""
    x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
    if isinstance(hold, Plane):
        return -z
    if isinstance(hold, Sphere):
        radius = hold.diameter / 2.0
        return np.sqrt(x**2 + y**2 + (z - radius) ** 2) - radius
    if isinstance(hold, Cylinder):
        return np.hypot(x, z - hold.diameter / 2.0) - hold.diameter / 2.0
    if isinstance(hold, Ellipsoid):
        return _from_ellipsoid(hold, np.stack([x, y, z], axis=-1))
    if isinstance(hold, Profile):
        return _from_profile(hold, x, y, z)
    if isinstance(hold, Mesh):
        return _from_mesh(hold, np.stack([x, y, z], axis=-1))
    assert isinstance(hold, Edge)
    # in polar coordinates about the fillet's centre, the angle taken from the edge's bisector
    radius = hold.fillet_radius
    length, beside = np.hypot(x, z - radius), np.arctan2(np.abs(x), z - radius) - hold.angle / 2.0
    to_face = length * np.sin(np.minimum(beside, math.pi / 2.0))
    return np.where(beside >= math.pi / 2.0, length, to_face) - radius


def _from_ellipsoid(hold: Ellipsoid, points: np.ndarray) -> np.ndarray:
    """The nearest point is a² q / (a² + t), with the multiplier t that puts it on the surface."""
    axes = np.asarray(hold.semi_axes)
    q = np.abs(points - [0.0, 0.0, axes[2]])
    low = np.full(q.shape[:-1], -(axes.min() ** 2) * (1.0 - 1e-13))
    high = np.linalg.norm(q * axes, axis=-1) + 1e-12
    for _ in range(100):
        t = 0.5 * (low + high)
        beyond = ((axes * q / (axes**2 + t[..., None])) ** 2).sum(axis=-1) > 1.0
        low, high = np.where(beyond, t, low), np.where(beyond, high, t)
    nearest = axes**2 * q / (axes**2 + (0.5 * (low + high))[..., None])
    return np.sign(((q / axes) ** 2).sum(axis=-1) - 1.0) * np.linalg.norm(q - nearest, axis=-1)


def _from_profile(hold: Profile, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    found = np.zeros(x.shape)
    strips = (-0.0335, 0.0, 0.0335) if len(hold.outlines) > 1 else ()
    for i, outline in enumerate(hold.outlines):
        bounds = (-math.inf, *strips, math.inf)
        mine = (-y >= bounds[i]) & (-y < bounds[i + 1])
        points = np.stack([x[mine], z[mine]], axis=-1)
        start, step = outline[:-1], np.diff(outline, axis=0)
        away = points[:, None] - start
        part = np.clip((away * step).sum(axis=-1) / (step**2).sum(axis=-1), 0.0, 1.0)
        far = np.linalg.norm(away - part[..., None] * step, axis=-1).min(axis=1)
        below = [(outline[-1, 0], 1e3), (outline[0, 0], 1e3)]
        inside = Path(np.vstack([outline, below])).contains_points(points)
        found[mine] = np.where(inside, -far, far)
    return found


def _from_mesh(hold: Mesh, points: np.ndarray) -> np.ndarray:
    """Distance from the nearest triangle; inside where the solid angles of all add up to 4π."""
    corners = hold.triangles.vertices[hold.triangles.faces]
    flat = points.reshape(-1, 3)
    found = np.concatenate(
        [from_triangles(corners, part) for part in np.array_split(flat, len(flat) // 100 + 1)]
    )
    return found.reshape(points.shape[:-1])


def from_triangles(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance of points from triangles (n, 3, 3) [m]; negative where solid angles add to 4π."""
    a, b, c = corners.transpose(1, 0, 2)
    away = np.full((len(points), len(corners)), math.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        v, w = q - p, points[:, None] - p
        part = np.clip((w * v).sum(axis=-1) / (v**2).sum(axis=-1), 0.0, 1.0)
        away = np.minimum(away, ((w - part[..., None] * v) ** 2).sum(axis=-1))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    above = np.ones(away.shape, dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        above &= (np.cross(normal, q - p) * (points[:, None] - p)).sum(axis=-1) >= 0.0
    height = ((points[:, None] - a) * normal).sum(axis=-1)
    away = np.where(above, height**2, away)
    u, v, w = (p - points[:, None] for p in (a, b, c))
    lu, lv, lw = (np.linalg.norm(p, axis=-1) for p in (u, v, w))
    over = (u * np.cross(v, w)).sum(axis=-1)
    under = lu * lv * lw + (u * v).sum(-1) * lw + (v * w).sum(-1) * lu + (w * u).sum(-1) * lv
    angle = np.arctan2(over, under).sum(axis=1)
    return np.where(angle > math.pi, -1.0, 1.0) * np.sqrt(away.min(axis=1))


def in_hand(hold: Hold, pose: Pose, points: np.ndarray) -> np.ndarray:
    """Distances of points in H of a hold placed at ``pose`` in H [m]."""
    return distance(hold, pose.inverse().apply(points))


def random_round(rng: np.random.Generator) -> Hold:
    """A cylinder or a ball."""
    diameter = 10.0 ** rng.uniform(-1.0, 0.5)
    return Cylinder(diameter) if rng.random() < 0.5 else Sphere(diameter)


def random_hold(rng: np.random.Generator) -> Hold:
    if rng.random() < 0.6:
        return random_round(rng)
    return Plane() if rng.random() < 0.3 else Edge(rng.uniform(0.01, 0.3), rng.uniform(0.3, 3.0))


def random_ellipsoid(rng: np.random.Generator) -> Ellipsoid:
    return Ellipsoid(tuple(10.0 ** rng.uniform(-1.2, 0.3, 3)))


def random_profile(rng: np.random.Generator) -> Profile:
    """A rough ridge, or a different one under each finger; its highest point at the origin."""
    return Profile(
        _random_outline(rng)
        if rng.random() < 0.6
        else {
            name: _random_outline(rng)
            for name in ("outer_left", "inner_left", "inner_right", "outer_right")
        }
    )


def _random_outline(rng: np.random.Generator) -> np.ndarray:
    count = int(rng.integers(5, 200))
    x = np.sort(rng.uniform(-0.3, 0.3, count))
    z = rng.uniform(0.0, 5.0) * x**2 + rng.uniform(0.0, 0.5) * np.abs(x)
    for size in (0.05, 0.01, 0.002):
        z += rng.uniform(0.0, 0.2 * size) * np.sin(x / size + rng.uniform(0.0, math.tau))
    z += rng.uniform(0.0, 3e-4) * rng.normal(size=count)
    return np.column_stack([x - x[z.argmin()], z - z.min()])


def random_mesh(rng: np.random.Generator) -> Mesh:
    """A boulder with bumps, of a few hundred triangles; its highest point at the origin."""
    ball = trimesh.creation.icosphere(subdivisions=int(rng.choice([1, 2, 3], p=[0.4, 0.5, 0.1])))
    directions = np.asarray(ball.vertices)
    radius = np.ones(len(directions))
    for _ in range(4):
        radius += rng.uniform(0.0, 0.06) * np.sin(
            directions @ rng.normal(size=3) * rng.uniform(1.0, 5.0) + rng.uniform(0.0, math.tau)
        )
    size = 10.0 ** rng.uniform(-1.1, 0.0) * rng.uniform(0.6, 1.4, 3)
    points = radius[:, None] * directions * size
    return Mesh(points - points[points[:, 2].argmin()], ball.faces)


def cylinder_mesh(
    diameter: float, around: int = 256, length: float = 0.6
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, on the cylinder, and faces of an open tube of strips along y."""
    turn = np.linspace(0.0, math.tau, around, endpoint=False)
    radius = diameter / 2.0
    ring = np.column_stack([radius * np.sin(turn), 0.0 * turn, radius - radius * np.cos(turn)])
    half = np.array([0.0, length / 2.0, 0.0])
    i = np.arange(around)
    j = (i + 1) % around
    faces = np.vstack(
        [np.column_stack([i, i + around, j]), np.column_stack([j, i + around, j + around])]
    )
    return np.vstack([ring - half, ring + half]), faces


def random_axes(rng: np.random.Generator, tilt: float = 0.5) -> np.ndarray:
    """Axes whose z is within ``tilt`` of the parent's and whose x points anywhere [rad]."""
    across = rng.normal(size=2)
    lean = Rotation.from_rotvec([*(across / np.hypot(*across) * rng.uniform(0.0, tilt)), 0.0])
    turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-math.pi, math.pi)])
    return (lean * turn).as_matrix()


def height_map(heights: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a grid of depths z over x and y, about the origin, seen from −z [m]."""
    rows, columns = heights.shape
    x, y = (spacing * (np.arange(n) - (n - 1) / 2.0) for n in (rows, columns))
    i = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[1:, :-1], i[:-1, 1:], i[1:, 1:]))
    faces = np.vstack([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    xy = np.meshgrid(x, y, indexing="ij")
    return np.column_stack([*(v.ravel() for v in xy), heights.ravel()]), faces


def rough_wall(seed: int = 0, count: int = 90, spacing: float = 0.02) -> tuple[list, list]:
    """Vertices and faces of a wall, open, as a request has them; its frame begins on it."""
    depths = np.random.default_rng(seed).uniform(0.0, 2e-3, (count, count))
    vertices, faces = height_map(depths, spacing)
    return vertices.tolist(), faces.tolist()


def fractal_wall(
    seed: int, *, size: float = 0.7, count: int = 141, height: float = 0.006, hurst: float = 0.8
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a square wall of rough rock, by its spectrum.

    ``size``: of its side [m]; ``count``: vertices along it; ``height``: its root mean square [m];
    ``hurst``: the exponent by which steps grow with their length. Its middle is the origin.
    """
    rng = np.random.default_rng(seed)
    waves = np.hypot(*np.meshgrid(np.fft.fftfreq(count), np.fft.fftfreq(count)))
    waves[0, 0] = 1.0
    z = np.fft.ifft2(np.fft.fft2(rng.normal(size=(count, count))) * waves ** -(1.0 + hurst)).real
    z *= height / z.std()
    vertices, faces = height_map(z, size / (count - 1))
    return vertices - vertices[(count * count) // 2], faces
