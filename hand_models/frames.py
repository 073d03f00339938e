"""Poses and the transport of wrenches between frames.

Wrenches are ``[fx, fy, fz, mx, my, mz]``: force first, moment about the frame's origin, SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from hand_models.errors import InvalidInputError

__all__ = ["QUATERNION_NORM_TOLERANCE", "Array", "Indices", "Pose", "skew", "wrench_transport"]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

QUATERNION_NORM_TOLERANCE: Final = 1e-3
"""How far a quaternion's norm may be from one before it is refused (the contract's figure)."""


def finite_vector(value: ArrayLike, size: int, field: str) -> Array:
    """Return ``value`` as a float array of shape ``(size,)``.

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
        raise InvalidInputError(f"expected {size} numbers, got shape {vector.shape}", field=field)
    if not np.isfinite(vector).all():
        raise InvalidInputError(f"every number must be finite, got {vector.tolist()}", field=field)
    return vector


def skew(v: ArrayLike) -> Array:
    """Return the matrix ``[v]×`` of shape (3, 3), so that ``[v]× w`` is the cross product."""
    x, y, z = np.asarray(v, dtype=float)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a child frame is in its parent.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Origin of the child in the parent [m].
    rotation : ndarray, shape (3, 3)
        Columns are the child's axes in the parent.
    """

    position: Array
    rotation: Array

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose of a frame that coincides with its parent."""
        return cls(np.zeros(3), np.eye(3))

    @classmethod
    def from_quaternion(
        cls, position: Sequence[float] | Array, orientation: Sequence[float] | Array
    ) -> Pose:
        """Return the pose with a quaternion ``[x, y, z, w]``, normalised.

        Raises
        ------
        InvalidInputError
            If a number is not finite or the norm is off by more than
            `QUATERNION_NORM_TOLERANCE`.
        """
        q = finite_vector(orientation, 4, "orientation")
        norm = float(np.linalg.norm(q))
        if not abs(norm - 1.0) <= QUATERNION_NORM_TOLERANCE:
            raise InvalidInputError(
                f"a quaternion [x, y, z, w] of norm 1 ± {QUATERNION_NORM_TOLERANCE:g} is needed, "
                f"the norm is {norm:.6g}",
                field="orientation",
            )
        return cls(finite_vector(position, 3, "position"), Rotation.from_quat(q).as_matrix())

    def quaternion(self) -> Array:
        """Return the orientation as ``[x, y, z, w]``, shape (4,), with w ≥ 0."""
        return np.asarray(Rotation.from_matrix(self.rotation).as_quat(canonical=True))

    def inverse(self) -> Pose:
        """Return the pose of the parent in the child."""
        return Pose(-self.rotation.T @ self.position, self.rotation.T)

    def __matmul__(self, other: Pose) -> Pose:
        return Pose(self.position + self.rotation @ other.position, self.rotation @ other.rotation)

    def apply(self, point: ArrayLike) -> Array:
        """Return a point (or an array (n, 3) of points) of the child in the parent [m]."""
        return np.asarray(point, dtype=float) @ self.rotation.T + self.position


def wrench_transport(pose: Pose) -> Array:
    """Return the matrix that carries a wrench from the child frame to the parent.

    Parameters
    ----------
    pose : Pose
        The child in the parent.

    Returns
    -------
    ndarray, shape (6, 6)
        ``Ad`` with ``f' = R f`` and ``m' = R m + p × R f``.
    """
    transport = np.zeros((6, 6))
    transport[:3, :3] = transport[3:, 3:] = pose.rotation
    transport[3:, :3] = skew(pose.position) @ pose.rotation
    return transport
