"""Orientations as a person gives them: a quaternion, roll, pitch and yaw, or two axes.

The module is loaded with the messages, so numerical libraries are imported when needed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from hand_models.base.errors import InvalidFieldError
from hand_models.base.tolerances import BASE_TOLERANCES

if TYPE_CHECKING:
    from hand_models.base.frames import Array, Pose

    Numbers = Sequence[float] | Array

__all__ = ["ORIENTATION_FIELDS", "check_orientation_form", "oriented_pose"]

ORIENTATION_FIELDS: Final = ("orientation", "rpy", "x_axis", "z_axis")
"""Fields that give an orientation: the first, the second, or the last two."""


def check_orientation_form(
    orientation: object = None, rpy: object = None, x_axis: object = None, z_axis: object = None
) -> None:
    """Check that an orientation is given in exactly one form; None is a field that is not given.

    Raises
    ------
    InvalidFieldError
        If no form, more than one, or only one of two axes is given.
    """
    forms = "orientation (a quaternion [x, y, z, w]), rpy, or x_axis with z_axis"
    values = (orientation, rpy, x_axis, z_axis)
    given = [name for name, v in zip(ORIENTATION_FIELDS, values, strict=True) if v is not None]
    if not given:
        raise InvalidFieldError(f"missing; give {forms}", field="orientation")
    if given[0] in ("x_axis", "z_axis"):
        for name, other in (("x_axis", "z_axis"), ("z_axis", "x_axis")):
            if name not in given:
                raise InvalidFieldError(f"missing; {other} requires {name}", field=name)
    elif len(given) > 1:
        raise InvalidFieldError(
            f"give exactly one of {forms}, got {' and '.join(given)}", field=given[1]
        )


def oriented_pose(
    position: Numbers,
    orientation: Numbers | None = None,
    rpy: Numbers | None = None,
    x_axis: Numbers | None = None,
    z_axis: Numbers | None = None,
) -> Pose:
    """Return the pose with a position, and an orientation that is given in one of three forms.

    Parameters
    ----------
    position : sequence of float, length 3
        Origin of the child in the parent [m].
    orientation : sequence of float, length 4, optional
        Quaternion ``[x, y, z, w]``.
    rpy : sequence of float, length 3, optional
        Roll, pitch and yaw about the fixed axes x, y and z of the parent, one after the other, as
        in ROS and URDF [rad]: R = R_z(yaw) R_y(pitch) R_x(roll).
    x_axis, z_axis : sequence of float, length 3, optional
        Directions of the child's axes x and z in the parent, of any length, at right angles within
        `BaseTolerances.right_angle`; z is kept, and x made perpendicular to it.

    Raises
    ------
    InvalidInputError
        If not exactly one form is given, a number is not finite, the quaternion's norm is not 1, an
        angle is beyond two turns, an axis is zero, or the axes are not at right angles.
    """
    import numpy as np

    from hand_models.base.frames import Pose, finite_vector

    check_orientation_form(orientation, rpy, x_axis, z_axis)
    if orientation is not None:
        return Pose.from_quaternion(position, orientation)
    if rpy is not None:
        return Pose.from_quaternion(position, _of_angles(finite_vector(rpy, 3, "rpy").tolist()))
    assert x_axis is not None
    assert z_axis is not None
    x, z = _unit(x_axis, "x_axis"), _unit(z_axis, "z_axis")
    off = math.asin(min(max(float(x @ z), -1.0), 1.0))
    if not abs(off) <= BASE_TOLERANCES.right_angle:
        raise InvalidFieldError(
            f"must be at right angles to x_axis within {BASE_TOLERANCES.right_angle:g} rad, got "
            f"{90.0 - math.degrees(off):.6g}° between x_axis {_listed(x_axis)} and z_axis "
            f"{_listed(z_axis)}: correct one of them",
            field="z_axis",
        )
    x = x - float(x @ z) * z
    x = x / float(np.linalg.norm(x))
    turned = Pose(np.zeros(3), np.column_stack([x, np.cross(z, x), z]))
    return Pose.from_quaternion(position, turned.quaternion())


def _of_angles(rpy: Sequence[float]) -> list[float]:
    """Return the unit quaternion [x, y, z, w] of roll, pitch and yaw [rad]."""
    # beyond two turns, an angle is likely to be in degrees
    largest = 4.0 * math.pi
    for name, angle in zip(("roll", "pitch", "yaw"), rpy, strict=True):
        if abs(angle) > largest:
            raise InvalidFieldError(
                f"{name} must be within ±{largest:.4g} rad (two turns), got {angle:g} rad: "
                f"in degrees? {angle:g}° are {math.radians(angle):.4g} rad",
                field="rpy",
            )
    sr, sp, sy = (math.sin(0.5 * angle) for angle in rpy)
    cr, cp, cy = (math.cos(0.5 * angle) for angle in rpy)
    return [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]


def _unit(value: Numbers, field: str) -> Array:
    from hand_models.base.frames import finite_vector

    axis = finite_vector(value, 3, field)
    length = math.hypot(*axis.tolist())
    if not length > BASE_TOLERANCES.length:
        raise InvalidFieldError(f"must be a direction, not zero, got {_listed(value)}", field=field)
    return axis / length


def _listed(value: Numbers) -> str:
    return f"[{', '.join(f'{number:g}' for number in value)}]"
