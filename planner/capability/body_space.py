"""Body wrenches that a stance can hold, and the accelerations: how far, and in which shape.

A body wrench W is held if loads within the limits, at the utilisation asked for, balance it:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W,   L_h y_h + l0_h + K_h a ≤ u s_h,   H_h y_h ≤ h_h.

These W are a convex polytope in six dimensions. It is known by its support function, one conic
program a direction (`program.Reach`), and its sections and projections by `polygon`. An
acceleration a of the body adds its inertia's wrench to W, and torques K a to the joints.

Floating hands count with their sets linearised where a plan for the body wrench asked for puts the
wrists: what is far from there is approximate.
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
"""Values that the other components of a body wrench may have, each with its label."""


class BodySection(NamedTuple):
    """A plane of the body wrenches that are held.

    Attributes
    ----------
    axes : tuple of (str, str)
        Of `WRENCH_COMPONENTS`.
    others : {'needed', 'zero', 'free'}
    polygon : Polygon or None
        [N, N·m]; its gap in scaled wrenches [N]. None where the plane misses the set.
    """

    axes: tuple[str, str]
    others: Others
    polygon: Polygon | None


class BodySpace(BodyPrograms):
    """Body space of a stance: its largest wrench in a direction, and its sections.

    Parameters
    ----------
    question : Question
        Its limits, joints, caps and given hand wrenches count as in a plan; its objective and its
        deadline do not.

    Raises
    ------
    InvalidInputError
        If the question cannot be understood; its ``field`` is relative to the question.
    """

    @property
    def needed(self) -> Array:
        """The body wrench asked for, in B, shape (6,) [N, N·m]."""
        return self.plan.body_wrench

    # Wrenches -----------------------------------------------------------------------------------

    def support(self, direction: ArrayLike) -> End | None:
        """Return the wrench that is held and farthest in a direction; None if there is none.

        Parameters
        ----------
        direction : array_like, shape (6,)
            d; the reach is the largest d · W.
        """
        d = finite_vector(direction, 6, "direction")
        found = self.reached(d * WRENCH_UNIT, np.eye(6), np.zeros(6))
        return None if found is None else self._end(found, float(d @ self.wrench(found)))

    def pure(self, direction: ArrayLike) -> End | None:
        """Return how far t d is held, from zero along a direction d, shape (6,); None if never."""
        return self._along(np.zeros(6), direction)

    def more(self, direction: ArrayLike) -> End | None:
        """Return how far W + t d is held from the wrench W asked for; None if W is not held."""
        cap = self.cap_at_needed
        return None if cap is None else self._along(self.needed, direction, cap)

    def section(self, axes: Sequence[str], others: Others = "needed") -> BodySection:
        """Return the wrenches that are held in the plane of two components.

        Parameters
        ----------
        axes : sequence of str, length 2
            Two of `WRENCH_COMPONENTS`.
        others : {'needed', 'zero', 'free'}
            The other components: those of the wrench asked for, zero, or whatever they may be,
            which makes it a projection.

        Raises
        ------
        InvalidInputError
            If axes are unknown, alike, or not two; or ``others`` is unknown.
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
        """The body wrench that holds the body at rest, shape (6,); None without a load."""
        motion = self.motion
        return None if motion is None else np.asarray(motion.rest.wrench[:6] * WRENCH_UNIT)

    # Accelerations ------------------------------------------------------------------------------

    @property
    def accelerates(self) -> bool:
        """True where accelerations are known: a load is given, not a body wrench."""
        return self.motion is not None

    @property
    def turns(self) -> bool:
        """True where angular accelerations are known, too: with joints, and no com of a load."""
        return self.motion is not None and self.motion.wrench.shape[1] == 6

    def acceleration(self, direction: ArrayLike) -> End | None:
        """Return the largest acceleration of the body, from rest, that is held along a direction.

        Parameters
        ----------
        direction : array_like, shape (3,) or (6,)
            In W; of length 6 with an angular part, about B's origin. The reach is the largest t
            for which the acceleration t d is held, the others being zero.

        Returns
        -------
        End or None
            None where the body cannot even be held at rest.

        Raises
        ------
        InvalidInputError
            If the direction is none, or accelerations are not known.
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
        """Return the accelerations that are held in the plane of two unit vectors of W [m/s²].

        Found from so many directions at most. None where the body cannot be held at rest; raises
        what `acceleration` raises.
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
                "does not determine the mass, which accelerations require; give load instead",
                field="body_wrench",
            )
        k = motion.wrench.shape[1]
        if len(direction) not in (3, k):
            raise InvalidInputError(
                f"{' or '.join(str(n) for n in sorted({3, k}))} components are needed, got "
                f"{len(direction)}; angular ones require joints, and a load without com",
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
    """Return two different components of a body wrench.

    Raises
    ------
    InvalidInputError
        If they are not that.
    """
    if len(axes) != 2:
        raise InvalidInputError(f"two axes are needed, got {len(axes)}", field="axes")
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
