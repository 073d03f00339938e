"""Body space of a stance: the body wrenches and body accelerations that are feasible.

A body wrench W is feasible if loads within the limits, at the utilisation cap u of the question,
balance it; for each hand h

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W,   L_h y_h + l0_h + K_h a ≤ u s_h,   H_h y_h ≤ h_h,

with loads y_h, wrench o_h + V_h y_h on the rock in H, limit rows L_h with capacities s_h, and hard
rows H_h. An acceleration a of the body adds its inertia's wrench to W, and torques K a to the
joints.

These W are a convex polytope in six dimensions. Its support function is one conic program for each
direction (`program.Reach`); `polygon` computes its sections and projections.

Sets of floating hands are linearised about the wrists' poses in the plan for the question's body
wrench: far from that wrench the result is approximate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, finite_vector
from hand_models.wrench_spaces import WRENCH_SCALE
from planner.capability.body_programs import BodyPrograms, End, size_of
from planner.capability.polygon import POLYGON_SETTINGS, Polygon, SupportPoint, enclose
from planner.programs import WRENCH_UNIT, Reached

__all__ = [
    "OTHER_COMPONENTS",
    "WRENCH_COMPONENTS",
    "BodySection",
    "BodySpace",
    "End",
    "Others",
    "checked_axes",
]

WRENCH_COMPONENTS: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""Names of the components of a body wrench."""

Others = Literal["needed", "zero", "free"]

OTHER_COMPONENTS: Final[dict[str, str]] = {
    "needed": "the others as asked for",
    "zero": "the others zero",
    "free": "whatever the others",
}
"""Values that the other components of a body wrench may have in a section, each with its label."""


class BodySection(NamedTuple):
    """Feasible body wrenches in the plane of two components.

    Attributes
    ----------
    axes : tuple of (str, str)
        Names of the two components, from `WRENCH_COMPONENTS`.
    others : {'needed', 'zero', 'free'}
        Values of the other four components: those of the question's body wrench, zero, or any.
    polygon : Polygon or None
        Corners [N, N·m]; the gap between inner and outer polygon in scaled wrenches [N] (moments
        over 0.1 m). None if the plane does not meet the body space.
    """

    axes: tuple[str, str]
    others: Others
    polygon: Polygon | None


class BodySpace(BodyPrograms):
    """Body space of a stance: feasible body wrenches and accelerations, by directions and sections.

    Parameters
    ----------
    question : Question
        Limits, joints, force caps and prescribed hand wrenches count as in a plan. Objective and
        deadline do not.

    Raises
    ------
    InvalidInputError
        If the question is invalid; ``field`` is relative to the question.
    """

    @property
    def needed(self) -> Array:
        """Body wrench of the question, in body frame B, shape (6,) [N, N·m]."""
        return self.plan.body_wrench

    # Wrenches -----------------------------------------------------------------------------------

    def support(self, direction: ArrayLike) -> End | None:
        """Return the feasible body wrench w that maximises d · w: the support function.

        Parameters
        ----------
        direction : array_like, shape (6,)
            d, in body frame B; not zero.

        Returns
        -------
        End or None
            ``reach`` is d · w. None if no body wrench is feasible.

        Raises
        ------
        InvalidInputError
            If the direction is zero.
        SolverError
            If the program is not solved.
        """
        d = finite_vector(direction, 6, "direction")
        found = self.reached(d * WRENCH_UNIT, np.eye(6), np.zeros(6))
        return None if found is None else self._end(found, float(d @ self.wrench(found)))

    def pure(self, direction: ArrayLike) -> End | None:
        """Return the largest t for which the body wrench t d is feasible.

        Parameters
        ----------
        direction : array_like, shape (6,)
            d, in body frame B [N, N·m]; not zero.

        Returns
        -------
        End or None
            ``reach`` is t. None if no multiple of d is feasible.

        Raises
        ------
        InvalidInputError
            If the direction is zero.
        SolverError
            If the program is not solved.
        """
        return self._along(np.zeros(6), direction)

    def more(self, direction: ArrayLike) -> End | None:
        """Return the largest t for which w + t d is feasible, w being the question's body wrench.

        Parameters
        ----------
        direction : array_like, shape (6,)
            d, in body frame B [N, N·m]; not zero.

        Returns
        -------
        End or None
            ``reach`` is t. None if w is not feasible.

        Raises
        ------
        InvalidInputError
            If the direction is zero.
        SolverError
            If the program is not solved.
        """
        cap = self.cap_at_needed
        return None if cap is None else self._along(self.needed, direction, cap)

    def section(self, axes: Sequence[str], others: Others = "needed") -> BodySection:
        """Return the feasible body wrenches in the plane of two components, as a polygon.

        Parameters
        ----------
        axes : sequence of str, length 2
            Two of `WRENCH_COMPONENTS`.
        others : {'needed', 'zero', 'free'}
            Values of the other components: those of the question's body wrench, zero, or any. The
            last gives a projection of the body space, the others a section.

        Returns
        -------
        BodySection
            The plane, and the polygon of feasible body wrenches in it.

        Raises
        ------
        InvalidInputError
            If axes are unknown, equal, or not two; or ``others`` is unknown.
        SolverError
            If a program is not solved.
        """
        one, two = checked_axes(axes)
        if others not in OTHER_COMPONENTS:
            raise InvalidInputError(
                f"unknown {others!r}; known are {', '.join(OTHER_COMPONENTS)}", field="others"
            )
        plane = [WRENCH_COMPONENTS.index(one), WRENCH_COMPONENTS.index(two)]
        start = self.needed if others == "needed" else np.zeros(6)
        at = np.where(np.isin(np.arange(6), plane), 0.0, start)
        columns = np.eye(6) if others == "free" else np.eye(6)[:, plane]
        units = (WRENCH_SCALE * WRENCH_UNIT)[plane]
        cap = self.cap_at_needed if others == "needed" else None

        def touching(normal: Array) -> SupportPoint | None:
            goal = columns[plane].T @ (normal * units)
            found = self.reached(goal, columns, at, cap)
            if found is None:
                return None
            point = (WRENCH_SCALE * self.wrench(found))[plane]
            return SupportPoint(normal, point, self.limiting(found.outcome))

        polygon = enclose(touching)
        scaled = None if polygon is None else polygon.scaled(1.0 / WRENCH_SCALE[plane])
        return BodySection((one, two), others, scaled)

    @property
    def weight(self) -> Array | None:
        """Body wrench that balances the load at rest, in B, shape (6,) [N, N·m].

        None if the question gives a body wrench instead of a load.
        """
        motion = self.motion
        return None if motion is None else np.asarray(motion.rest.wrench[:6] * WRENCH_UNIT)

    # Accelerations ------------------------------------------------------------------------------

    @property
    def accelerates(self) -> bool:
        """True if accelerations can be computed: the question gives a load, not a body wrench."""
        return self.motion is not None

    @property
    def turns(self) -> bool:
        """True if angular accelerations can be computed, too.

        They require known joints, and a load without a centre of mass.
        """
        return self.motion is not None and self.motion.wrench.shape[1] == 6

    def acceleration(self, direction: ArrayLike) -> End | None:
        """Return the largest feasible acceleration of the body, from rest, along a direction.

        Parameters
        ----------
        direction : array_like, shape (3,) or (6,)
            Linear and, with length 6, angular part in world frame W, about the origin of body frame
            B. With length 3, the angular acceleration is zero.

        Returns
        -------
        End or None
            ``reach`` is the largest t for which t times the direction is feasible. None if the body
            is not feasible at rest.

        Raises
        ------
        InvalidInputError
            If the direction is zero or of a wrong length, or accelerations cannot be computed.
        SolverError
            If a program is not solved.
        """
        way = self._ways(finite_vector(direction, len(np.atleast_1d(direction)), "direction"))
        if self.at_rest is None:
            return None
        found = self.accelerated(np.ones(1), way)
        return None if found is None else self._end(found, float(found.t[0]))

    def acceleration_section(
        self, one: ArrayLike, two: ArrayLike, most: int = POLYGON_SETTINGS.most_directions
    ) -> Polygon | None:
        """Return the feasible linear accelerations of the body, from rest, in a plane.

        Parameters
        ----------
        one, two : array_like, shape (3,)
            Unit vectors in world frame W that span the plane.
        most : int, optional
            Largest number of directions that are solved for.

        Returns
        -------
        Polygon or None
            Coordinates along ``one`` and ``two`` [m/s²]. None if the body is not feasible at rest.

        Raises
        ------
        InvalidInputError
            If a direction is zero, or accelerations cannot be computed.
        SolverError
            If a program is not solved.
        """
        ways = [self._ways(finite_vector(way, 3, "direction")) for way in (one, two)]
        if self.at_rest is None:
            return None
        plane = np.hstack(ways)

        def touching(normal: Array) -> SupportPoint | None:
            found = self.accelerated(normal, plane)
            if found is None:
                return None
            return SupportPoint(normal, found.t, self.limiting(found.outcome))

        return enclose(touching, most)

    def _ways(self, direction: Array) -> Array:
        """Return a direction as a column of the motion's components, shape (k, 1)."""
        motion = self.motion
        if motion is None:
            raise InvalidInputError(
                "gives no mass, and accelerations require one; give load instead of body_wrench",
                field="body_wrench",
            )
        k = motion.wrench.shape[1]
        if len(direction) not in (3, k):
            needs = "; angular components require stance.joints, and a load without load.com"
            angular = needs if k == 3 else ""
            raise InvalidInputError(
                f"{' or '.join(str(n) for n in sorted({3, k}))} components are needed, got "
                f"{len(direction)}{angular}",
                field="direction",
            )
        size_of(direction)
        return np.pad(direction, (0, k - len(direction)))[:, None]

    # Programs -----------------------------------------------------------------------------------

    def _along(self, start: Array, direction: ArrayLike, cap: float | None = None) -> End | None:
        d = finite_vector(direction, 6, "direction")
        found = self.reached(np.ones(1), (d / WRENCH_UNIT)[:, None], start, cap)
        return None if found is None else self._end(found, float(found.t[0]))

    def _end(self, found: Reached, reach: float) -> End:
        outcome = found.outcome
        return End(reach, self.wrench(found), self.limiting(outcome), outcome.loads)


def checked_axes(axes: Sequence[str]) -> tuple[str, str]:
    """Return two different component names of a body wrench, checked.

    Parameters
    ----------
    axes : sequence of str
        Names to check; valid are two of `WRENCH_COMPONENTS`.

    Raises
    ------
    InvalidInputError
        If a name is unknown, both are equal, or there are not two.
    """
    if len(axes) != 2:
        raise InvalidInputError(
            f"two axes are needed, got {len(axes)}; known are {', '.join(WRENCH_COMPONENTS)}",
            field="axes",
        )
    for i, axis in enumerate(axes):
        if axis not in WRENCH_COMPONENTS:
            raise InvalidInputError(
                f"unknown axis {axis!r}; known are {', '.join(WRENCH_COMPONENTS)}",
                field=f"axes[{i}]",
            )
    if axes[0] == axes[1]:
        raise InvalidInputError(
            f"{axes[0]} is given twice; two different axes are needed", field="axes"
        )
    return axes[0], axes[1]
