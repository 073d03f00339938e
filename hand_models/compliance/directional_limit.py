"""Largest wrench of a compliant grasp in a direction, by successive linear programs.

The limiting wrench in a direction d (Section 5.5.2) is a maximum of d · w(ξ) over the poses ξ of
the wrist within every limit. A trust region method finds it: about a pose everything is linearised,
a linear program over a small box gives the next pose, and the box grows or shrinks with how well
the program predicted the result. Near the maximum, most often a corner of as many limits as the
pose has components, convergence is quadratic. The set is not convex: the maximum is a local one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, EmptySetError
from hand_models.compliance.grasp import CompliantGrasp, Evaluation
from hand_models.wrench_spaces import Row, WrenchSpace, linear_program

__all__ = ["Farthest", "farthest", "linear_extreme", "pose_units"]


@dataclass(frozen=True, eq=False)
class Farthest:
    """Limiting pose and wrench of a grasp in a direction.

    Attributes
    ----------
    twist : ndarray, shape (d,)
        Pose of the wrist [m, rad].
    wrench : ndarray, shape (6,)
        Wrench on the rock at that pose [N, N·m].
    reach : float
        Product of the direction and the wrench.
    limiting : Row or None
        The limit that is reached; None if only hard rows bound the search.
    """

    twist: Array
    wrench: Array
    reach: float
    limiting: Row | None


def pose_units(columns: tuple[str, ...]) -> Array:
    """Return the unit (scale) of each component of a pose: 1e-3 m, 1e-2 rad or 100 N.

    Parameters
    ----------
    columns : tuple of str, length d
        Names of the components: displacements ``wrist/v…``, rotations ``wrist/w…``, tensions
        ``…/tension``.

    Returns
    -------
    ndarray, shape (d,)
    """
    units = {"v": 1e-3, "w": 1e-2, "t": 100.0}  # of displacements and turns of a wrist
    return np.array([units[name.split("/")[1][0]] for name in columns])


def farthest(
    grasp: CompliantGrasp, direction: ArrayLike, start: ArrayLike | None = None
) -> Farthest:
    """Return the wrench farthest in a direction that is within every limit (a local maximum).

    Parameters
    ----------
    grasp : CompliantGrasp
    direction : array_like, shape (6,)
        Direction d of the wrench.
    start : array_like, shape (d,), optional
        Pose of the wrist at which the search begins; zeros by default.

    Raises
    ------
    EmptySetError
        If no pose within the limits is found on the way.
    SolverError
        If a linear program fails.
    """
    d = np.asarray(direction, dtype=float)
    at = np.zeros(len(grasp.columns)) if start is None else np.asarray(start, dtype=float)
    found, excess = grasp.evaluate(at[None]), np.inf
    kept = 1e-5  # share of its capacity by which a limit may be exceeded at the pose found
    # penalties of a limit exceeded by the whole of its capacity, in units of d · w: the next if the
    # last left one exceeded; at last the nearest that holds
    for goal, weight in ((d, 1e3), (d, 1e4), (d, 1e5), (0.0 * d, 1e5)):
        at, found = _climb(grasp, goal, at, weight)
        excess = _excess(found)
        if excess <= kept:
            break
    else:
        worst = grasp.limits[int(found.limiting[0])].label
        raise EmptySetError(
            f"found no wrist pose that keeps every limit toward the wrench {d.tolist()} in H; the "
            f"best exceeds one by {100.0 * excess:.2g} % (limit of the largest load: {worst}): "
            "start at another pose of the wrist, or change the closing tension of the grasp"
        )
    binding = float(found.utilisation[0]) >= 1.0 - kept
    return Farthest(
        twist=at,
        wrench=found.wrenches[0],
        reach=float(d @ found.wrenches[0]),
        limiting=grasp.limits[int(found.limiting[0])] if binding else None,
    )


def linear_extreme(space: WrenchSpace, direction: Array) -> tuple[Array | None, float]:
    """Return the wrist pose whose wrench is farthest in a direction, in a linearised set (an LP).

    Parameters
    ----------
    space : WrenchSpace
        Set linearised about a pose (`CompliantGrasp.linearised`); its d columns are the components
        of the wrist's pose.
    direction : ndarray, shape (6,)
        Direction of the wrench on the rock.

    Returns
    -------
    pose : ndarray, shape (d,), or None
        Pose of the wrist [m, rad, or N for tensions]; None if the set is empty.
    reach : float
        Product of the direction and the wrench at that pose; −∞ if the set is empty.

    Raises
    ------
    SolverError
        If the linear program fails.
    """
    units = pose_units(space.columns)
    cost = -(direction @ space.generators) * units
    found = linear_program(cost, space.A * units, space.b, "extreme of a linearised set")
    if found is None:
        return None, -np.inf
    pose = found * units
    return pose, float(direction @ space.wrench(pose))


def _climb(grasp: CompliantGrasp, d: Array, at: Array, weight: float) -> tuple[Array, Evaluation]:
    """Follow linear programs from a pose until they predict no further gain."""
    units = pose_units(grasp.columns)
    space = grasp.linearised(at)
    found = grasp.evaluate(at[None])
    merit = _merit(found, d, weight)
    box, rounds = 1.0, 0  # half width of the box about a pose, in `pose_units`
    while rounds < 50 and box > 1e-9:
        rounds += 1
        step, foretold = _step(space, d, at, box, weight)
        promised = foretold - merit
        # poses have converged that promise no more, relative to the objective
        if promised <= 1e-6 * max(1.0, abs(merit)):
            break
        there = grasp.evaluate((at + step)[None])
        gained = _merit(there, d, weight) - merit
        size = float(np.abs(step / units).max())
        if gained <= 0.0:
            box = 0.25 * min(box, size)
            continue
        if gained > 0.75 * promised:
            box = min(2.0 * max(box, size), 4.0)
        at, found, merit = at + step, there, merit + gained
        space = grasp.linearised(at)
    return at, found


def _excess(found: Evaluation) -> float:
    """Return by what share a limit is exceeded, or a hard row in newtons; the most of all."""
    return max(float(found.utilisation[0]) - 1.0, float(found.violation[0]), 0.0)


def _merit(found: Evaluation, d: Array, weight: float) -> float:
    """Return d · w less what is exceeded."""
    excess = _excess(found)
    return float(d @ found.wrenches[0]) - weight * excess if np.isfinite(excess) else -np.inf


def _step(
    space: WrenchSpace, d: Array, at: Array, box: float, weight: float
) -> tuple[Array, float]:
    """Return the best step within a box by the linear model, and the merit that it predicts."""
    units = pose_units(space.columns)
    # limits in shares of their capacities, hard rows in newtons; one slack exceeds them all
    A: Array = np.vstack([space.L / space.s[:, None], space.H])
    b: Array = np.concatenate([1.0 - space.l0 / space.s, space.h]) - A @ at
    cost = np.append(-(d @ space.generators) * units, weight)
    found = linear_program(
        cost,
        np.column_stack([A * units, -np.ones(len(b))]),
        b,
        "farthest",
        bounds=[*[(-box, box)] * len(units), (0.0, None)],
    )
    assert found is not None  # the slack exceeds whatever is exceeded
    return found[:-1] * units, float(d @ space.wrench(at)) - float(cost @ found)
