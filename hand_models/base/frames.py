"""Poses, and the transport of wrenches between frames.

Wrenches are ``[fx, fy, fz, mx, my, mz]``: force first, moment about the frame's origin, SI units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hand_models.base.errors import InvalidInputError
from hand_models.base.tolerances import BASE_TOLERANCES

__all__ = [
    "Array",
    "Indices",
    "Pose",
    "finite_vector",
    "skew",
    "turns_about",
    "wrench_transport",
    "wrench_transports",
]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def finite_vector(value: ArrayLike, size: int, field: str) -> Array:
    """Return ``value`` as a float array of shape ``(size,)``, checked to be finite.

    Parameters
    ----------
    value : array_like
    size : int
        Required length.
    field : str
        Field path for the error message.

    Raises
    ------
    InvalidInputError
        If the shape differs or an entry is not finite.
    """
    try:
        vector = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(f"expected {size} numbers, got {value!r}", field=field) from None
    if vector.shape != (size,):
        got = len(vector) if vector.ndim == 1 else f"an array of shape {vector.shape}"
        raise InvalidInputError(f"expected {size} numbers, got {got}", field=field)
    numbers = vector.tolist()
    if not all(map(math.isfinite, numbers)):
        raise InvalidInputError(f"every number must be finite, got {numbers}", field=field)
    return vector


def skew(v: ArrayLike) -> Array:
    """Return the cross product matrix ``[v]×``, shape (3, 3), of a vector v: ``[v]× w = v × w``."""
    x, y, z = np.asarray(v, dtype=float)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turns_about(vectors: ArrayLike) -> Array:
    """Return rotation matrices (..., 3, 3) of rotation vectors (..., 3): axis times angle [rad]."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(np.asarray(vectors, dtype=float)).as_matrix())


@dataclass(frozen=True, eq=False)
class Pose:
    """Pose of a child frame in its parent frame.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Origin of the child in the parent [m].
    rotation : ndarray, shape (3, 3)
        Columns are the child's axes in the parent.
    proper : bool
        Whether the pose was checked: finite, axes orthonormal and right-handed, arrays read-only.
    """

    position: Array
    rotation: Array
    proper: bool = field(default=False, init=False)

    def __reduce__(self) -> tuple[Any, ...]:
        # a copy's arrays can be written, so nothing is known of it
        return Pose, (self.position, self.rotation)

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose of a frame that coincides with its parent."""
        return cls(np.zeros(3), np.eye(3))

    @classmethod
    def from_quaternion(
        cls, position: Sequence[float] | Array, orientation: Sequence[float] | Array
    ) -> Pose:
        """Return the pose with a position and the orientation of a quaternion, which is normalised.

        Parameters
        ----------
        position : sequence of float, length 3
            Origin of the child in the parent [m].
        orientation : sequence of float, length 4
            Quaternion ``[x, y, z, w]``.

        Raises
        ------
        InvalidInputError
            If a number is not finite or the quaternion's norm differs from 1 by more than
            `BaseTolerances.unit_norm`.
        """
        q = finite_vector(orientation, 4, "orientation").tolist()
        norm = math.hypot(*q)
        tolerance = BASE_TOLERANCES.unit_norm
        if not abs(norm - 1.0) <= tolerance:
            remedy = "divide all four numbers by it" if norm else "no rotation is [0, 0, 0, 1]"
            raise InvalidInputError(
                f"a quaternion [x, y, z, w] of norm 1 ± {tolerance:g} is needed, "
                f"the norm is {norm:.6g}: {remedy}",
                field="orientation",
            )
        x, y, z, w = [component / norm for component in q]
        rotation = np.array(
            [
                [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
                [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
                [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
            ]
        )
        place = finite_vector(position, 3, "position").copy()
        place.setflags(write=False)
        rotation.setflags(write=False)
        pose = cls(place, rotation)
        object.__setattr__(pose, "proper", True)
        return pose

    @classmethod
    def from_quaternions(
        cls, given: Iterable[tuple[str, Sequence[float] | Array, Sequence[float] | Array]]
    ) -> list[Pose]:
        """Return the poses of several fields of a message.

        Parameters
        ----------
        given : iterable of (str, sequence of float, sequence of float)
            Path of the field, position [m] and quaternion ``[x, y, z, w]`` of each pose.

        Raises
        ------
        InvalidInputError
            If a number is not finite or a quaternion's norm is not 1; the error's field begins with
            the path.
        """
        found = []
        for path, position, orientation in given:
            try:
                found.append(cls.from_quaternion(position, orientation))
            except InvalidInputError as error:
                raise error.within(path) from None
        return found

    def quaternion(self) -> Array:
        """Return the orientation as a unit quaternion ``[x, y, z, w]``, shape (4,), with w ≥ 0."""
        rows = self.rotation.tolist()
        trace = rows[0][0] + rows[1][1] + rows[2][2]
        # from the largest of its components, which is never small
        i = max(range(3), key=lambda axis: rows[axis][axis])
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [0.0] * 4
        if trace > rows[i][i]:
            q[3], (i, j, k) = 1.0 + trace, (0, 1, 2)
            q[i], q[j] = rows[k][j] - rows[j][k], rows[i][k] - rows[k][i]
            q[k] = rows[j][i] - rows[i][j]
        else:
            q[i], q[3] = 1.0 - trace + 2.0 * rows[i][i], rows[k][j] - rows[j][k]
            q[j], q[k] = rows[j][i] + rows[i][j], rows[k][i] + rows[i][k]
        return np.array(q) * (math.copysign(1.0, q[3]) / math.hypot(*q))

    def inverse(self) -> Pose:
        """Return the pose of the parent frame in the child frame."""
        return Pose(-self.rotation.T @ self.position, self.rotation.T)

    def __matmul__(self, other: Pose) -> Pose:
        return Pose(self.position + self.rotation @ other.position, self.rotation @ other.rotation)

    def apply(self, point: ArrayLike) -> Array:
        """Transform a point (3,) or points (n, 3) from the child frame to the parent frame [m]."""
        return np.asarray(point, dtype=float) @ self.rotation.T + self.position


def wrench_transport(pose: Pose) -> Array:
    """Return the matrix that transforms a wrench from the child frame to the parent frame.

    Parameters
    ----------
    pose : Pose
        The child in the parent: position p, rotation R.

    Returns
    -------
    ndarray, shape (6, 6)
        ``Ad``, with ``f' = R f`` and ``m' = R m + p × R f`` for the force f and the moment m.
    """
    transport = np.zeros((6, 6))
    transport[:3, :3] = transport[3:, 3:] = pose.rotation
    transport[3:, :3] = skew(pose.position) @ pose.rotation
    return transport


SKEW_MATRICES: Final = np.stack([skew(axis) for axis in np.eye(3)])
"""``SKEW_MATRICES[i]`` is `skew` of the unit vector along axis i."""


def wrench_transports(body: Pose, poses: Sequence[Pose]) -> Array:
    """Return the matrices that transform wrenches from n frames to a body's frame.

    Parameters
    ----------
    body : Pose
        The body in the world.
    poses : sequence of Pose, length n
        The frames in the world.

    Returns
    -------
    ndarray, shape (n, 6, 6)
        The matrix of each frame, as of `wrench_transport`.
    """
    inverse = body.rotation.T
    rotations = inverse @ np.concatenate([pose.rotation for pose in poses]).reshape(-1, 3, 3)
    places = np.concatenate([pose.position for pose in poses]).reshape(-1, 3)
    places = (places - body.position) @ body.rotation
    transports = np.zeros((len(poses), 6, 6))
    transports[:, :3, :3] = transports[:, 3:, 3:] = rotations
    crosses = (places @ SKEW_MATRICES.reshape(3, 9)).reshape(-1, 3, 3)
    np.matmul(crosses, rotations, out=transports[:, 3:, :3])
    return transports
