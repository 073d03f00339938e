"""Force limits of a gripper: the largest shear, pull-off and moment of its wrench hull.

Signs are the paper's. A limit is a linear program over the points that make the hull; its
multipliers (shadow prices) give the direction in which a farther point would raise the limit, and a
point is sought there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import scipy

from hand_models.base import Array, EmptySetError, Indices, SolverError
from hand_models.compliance import (
    PLANAR_COMPONENTS,
    Farthest,
    Gripper,
    boundary,
    farthest,
    search_box,
)
from hand_models.experiments.wrench_hull import (
    clipped_vertices,
    distance_along,
    in_paper_signs,
    volume,
    with_mirrored,
)
from hand_models.parameters import experiment_table
from hand_models.wrench_spaces import Row

__all__ = [
    "MEASURE_UNITS",
    "HullPoints",
    "Limit",
    "Measure",
    "State",
    "closing_limit",
    "gripper_limits",
    "limit",
    "rest_state",
    "sharpened",
    "unloaded_pose",
]

Measure = Literal["shear", "normal", "moment", "volume"]
State = Literal["holds", "contact fails", "ejects"]

MEASURE_UNITS: Final[dict[Measure, str]] = {
    "shear": "N",
    "normal": "N",
    "moment": "N·m",
    "volume": "N³·m",
}
"""Units of the measures of the part of a hull with F_z ≤ 0.

``shear`` is the largest F_x in the loading plane, the printed ratio of F_x to M_y; ``normal`` the
largest −F_z, which in a skew symmetric hull has no F_x and no M_y; ``moment`` the largest M_y;
``volume`` the volume.
"""


@dataclass(frozen=True, eq=False)
class HullPoints:
    """Wrenches at poses of the wrist at which every tile holds, with their mirror images.

    Attributes
    ----------
    wrenches : ndarray, shape (n, 3)
        F_x, F_z, M_y in the paper's signs [N, N, N·m].
    poses : ndarray, shape (n, 3)
        Pose of the wrist of each wrench, (x, z, ω_y) [m, m, rad].
    phalanges : tuple of (str or None), length n
        Phalanx whose contact fails first at the pose; None where a tile is about to be dragged
        backwards.
    """

    wrenches: Array
    poses: Array
    phalanges: tuple[str | None, ...]

    @classmethod
    def explored(cls, grasp: Gripper, rays: int) -> HullPoints:
        """Find wrenches along rays from the middle of the poses at which every tile holds.

        Parameters
        ----------
        grasp : Gripper
        rays : int
            Number of rays in the space of poses.

        Raises
        ------
        EmptySetError
            If tiles hold at no pose near rest.
        """
        found = boundary(grasp, search_box(grasp), rays)
        points = cls(np.zeros((0, 3)), np.zeros((0, 3)), ())
        return points.joined(in_paper_signs(found.wrenches), found.poses, found.limiting)

    def joined(self, wrenches: Array, poses: Array, limiting: Sequence[Row | None]) -> HullPoints:
        """Return these points with further points and their mirror images added.

        Parameters
        ----------
        wrenches, poses : ndarray, shape (k, 3)
            Further wrenches and their poses, in the components and units of the attributes.
        limiting : sequence of (Row or None), length k
            Row of the limit that is reached first at each pose.
        """
        phalanges = tuple(None if row is None else row.phalanx for row in limiting)
        return HullPoints(
            np.vstack([self.wrenches, with_mirrored(wrenches)]),
            # a pose is mirrored as a wrench is: (−x, z, −ω_y)
            np.vstack([self.poses, with_mirrored(poses)]),
            self.phalanges + phalanges + phalanges,
        )

    def failing(self, found: Limit) -> list[str]:
        """Return whose contacts fail at the corners between which a limit lies."""
        return sorted({self.phalanges[i] or "dragged backwards" for i in found.corners})

    def pressed_share(self, grasp: Gripper, found: Limit) -> float:
        """Return which part of F_x at a limit the normal forces of the contacts make up."""
        right, left = grasp.finger_loads(self.poses[found.corners])
        along = [(-side.normals * side.directions[..., 1]).sum(axis=1) for side in (right, left)]
        return float(found.weights @ (along[0] - along[1])) / found.value if found.value else 0.0


@dataclass(frozen=True, eq=False)
class Limit:
    """The wrench of a hull at which a measure is largest.

    Attributes
    ----------
    value : float
        Largest value of the measure, in its unit (`MEASURE_UNITS`).
    direction : ndarray, shape (3,)
        Direction in (F_x, F_z, M_y): a wrench that is farther along it than every point of the hull
        would raise the limit.
    corners : ndarray of int, shape (k,)
        Indices of the points between which the wrench lies.
    weights : ndarray, shape (k,)
        Weights of these points in the wrench; their sum is 1.
    """

    value: float
    direction: Array
    corners: Indices
    weights: Array


def limit(points: Array, measure: Measure) -> Limit:
    """Return the largest shear, pull-off or moment of a hull of wrenches (a linear program).

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches (F_x, F_z, M_y) in the paper's signs [N, N, N·m].
    measure : {'shear', 'normal', 'moment'}
        Largest F_x in the loading plane, −F_z, or M_y; of wrenches with F_z ≤ 0 (`MEASURE_UNITS`).

    Raises
    ------
    EmptySetError
        If the part of the hull that is measured is empty.
    SolverError
        If the linear program fails.
    """
    # the direction in which the hull's farthest wrench is the measure
    goal = np.array(
        {"shear": (1.0, 0.0, 0.0), "normal": (0.0, -1.0, 0.0), "moment": (0.0, 0.0, 1.0)}[measure]
    )
    ratio = experiment_table().scalar("parameter_studies", "force_to_moment")
    planes = np.array([[1.0, 0.0, -ratio]] if measure == "shear" else np.zeros((0, 3)))
    result = scipy.optimize.linprog(
        -points @ goal,
        A_eq=np.vstack([planes @ points.T, np.ones(len(points))]),
        b_eq=np.append(np.zeros(len(planes)), 1.0),
        A_ub=points[None, :, 1],
        b_ub=[0.0],
        method="highs",
    )
    if result.status == 2:
        also = f" and F_x = {ratio:g} M_y" if measure == "shear" else ""
        raise EmptySetError(
            f"{measure} cannot be measured: no wrench of the hull has F_z ≤ 0{also}: "
            "measure another, or give another hull"
        )
    if result.status != 0 or result.x is None or result.fun is None:
        raise SolverError(
            f"no largest {measure} of {len(points)} wrenches found (HiGHS said {result.message})"
        )
    corners = np.flatnonzero(result.x > 0.0)
    return Limit(
        value=-float(result.fun),
        direction=goal
        + result.eqlin.marginals[:-1] @ planes
        + result.ineqlin.marginals[0] * np.array([0.0, 1.0, 0.0]),
        corners=corners,
        weights=result.x[corners],
    )


def sharpened(
    grasp: Gripper, points: HullPoints, measure: Measure, cuts: int, starts: int
) -> tuple[HullPoints, Limit]:
    """Raise a force limit by adding points to the hull, found by local search.

    The search begins at the point farthest in the direction that raises the limit.

    Parameters
    ----------
    grasp : Gripper
    points : HullPoints
        Points of the hull to begin with, from `HullPoints.explored`.
    measure : {'shear', 'normal', 'moment'}
        Force limit to raise, as in `limit`.
    cuts : int
        Largest number of points to add.
    starts : int
        Largest number of starts of each search: where the first start raises nothing, the search
        starts again at the farthest points at which other phalanges fail.

    Returns
    -------
    tuple of (HullPoints, Limit)
        All points, and the limit over them.

    Raises
    ------
    EmptySetError
        If the part of the hull that is measured is empty.
    """
    found = limit(points.wrenches, measure)
    for _ in range(cuts):
        farther = _farther(grasp, points, found, starts)
        if farther is None:
            break
        points = points.joined(
            in_paper_signs(farther.wrench[None]), farther.twist[None], (farther.limiting,)
        )
        found = limit(points.wrenches, measure)
    return points, found


def _farther(grasp: Gripper, points: HullPoints, found: Limit, starts: int) -> Farthest | None:
    """Return a wrench that raises a limit by more than it is worth, if one is found."""
    reached = points.wrenches @ found.direction
    direction = np.zeros(6)
    # to the contract's signs, whose M_y is minus the paper's
    direction[list(PLANAR_COMPONENTS)] = found.direction * (1.0, 1.0, -1.0)
    first: dict[str | None, int] = {}
    for i in np.argsort(-reached, kind="stable"):
        first.setdefault(points.phalanges[i], int(i))
    for start in list(first.values())[:starts]:
        try:
            end = farthest(grasp, direction, points.poses[start])
        except EmptySetError:
            continue
        # a gain of less than 0.1 % of the limit is not worth another search
        if end.reach - reached.max() > 1e-3 * abs(found.value):
            return end
    return None


def gripper_limits(grasp: Gripper, rays: int, cuts: int, starts: int) -> dict[str, Any]:
    """Return the state of a gripper, its shear and normal limits, and what is behind them.

    Parameters
    ----------
    grasp : Gripper
    rays, cuts, starts : int
        Effort of the search: parameters of `HullPoints.explored` and `sharpened`.

    Returns
    -------
    dict
        ``state`` (`rest_state`), and if any pose holds: ``shear``, ``normal`` and ``volume``
        (`MEASURE_UNITS`), ``pure_shear``, the largest F_x of wrenches F_x = ratio · M_y with
        F_z = 0, and of the limits ``pressed_share``, ``shear_phalanges`` and ``normal_phalanges``.
    """
    state = rest_state(grasp)
    try:
        points = HullPoints.explored(grasp, rays)
        points, _ = sharpened(grasp, points, "shear", cuts, starts)
        points, normal = sharpened(grasp, points, "normal", cuts, starts)
        # the points added for one limit may raise the other
        shear = limit(points.wrenches, "shear")
    except EmptySetError:
        return {"state": state}
    ratio = experiment_table().scalar("parameter_studies", "force_to_moment")
    return {
        "state": state,
        "shear": shear.value,
        "pure_shear": distance_along(points.wrenches, np.array([[1.0, 0.0, 1.0 / ratio]]))[0],
        "normal": normal.value,
        "volume": volume(clipped_vertices(points.wrenches)),
        "pressed_share": points.pressed_share(grasp, shear),
        "shear_phalanges": points.failing(shear),
        "normal_phalanges": points.failing(normal),
    }


def rest_state(grasp: Gripper) -> State:
    """Return the state of a closed gripper without external load.

    Parameters
    ----------
    grasp : Gripper

    Returns
    -------
    {'holds', 'contact fails', 'ejects'}
        ``ejects``: the fingers push the wrist off the rock, and `unloaded_pose` finds no pose with
        every tile holding. ``contact fails``: they do not, but a tile exceeds its limit or is
        dragged backwards, with the wrist as placed (Section 5.5.1) or where it would rest unloaded.
        ``holds``: neither.
    """
    at_rest = grasp.evaluate(np.zeros((1, 3)))
    held, pushed = bool(at_rest.holds[0]), float(at_rest.wrenches[0, 2]) > 0.0
    pose = unloaded_pose(grasp)
    rests = pose is not None and bool(grasp.evaluate(pose[None]).holds[0])
    if pushed and not rests:
        return "ejects"
    return "holds" if held and rests else "contact fails"


def unloaded_pose(grasp: Gripper) -> Array | None:
    """Return the wrist pose nearest to rest along z at which a gripper exerts no wrench.

    By symmetry F_x and M_y are zero along z; the pose is where F_z is zero as well.

    Returns
    -------
    ndarray, shape (3,), or None
        Pose (0, z, 0) [m, m, rad]; None if F_z does not vanish within ``base_shift`` of rest
        (section ``parameter_studies`` of the experiment table), or only where a phalanx has lost
        the rock. The gripper moves along z against its F_z at rest.
    """
    far = experiment_table().scalar("parameter_studies", "base_shift")

    def push(z: float) -> float:
        return float(grasp.evaluate(np.array([[0.0, z, 0.0]])).wrenches[0, 2])

    # 101 poses bracket the first change of sign
    way = -np.sign(push(0.0)) * np.linspace(0.0, far, 101)
    pushes = grasp.evaluate(np.column_stack([0.0 * way, way, 0.0 * way])).wrenches[:, 2]
    crossed = np.flatnonzero(pushes[:-1] * pushes[1:] <= 0.0)
    lost = np.flatnonzero(~np.isfinite(pushes))
    if not len(crossed) or (len(lost) and lost[0] <= crossed[0]):
        return None
    root = scipy.optimize.brentq(push, way[crossed[0]], way[crossed[0] + 1])
    return np.array([0.0, float(root), 0.0])


def closing_limit(gripper: Callable[[float], Gripper], tried: Array) -> float | None:
    """Return the tension from which on closing alone overloads a tile, if it is among those tried.

    Parameters
    ----------
    gripper : callable
        Returns the gripper at a tension [N].
    tried : ndarray, shape (n,)
        Ascending tensions; a tile that is overloaded from the least of them on counts as that [N].
    """

    def excess(tension: float) -> float:
        verdict = gripper(tension).evaluate(np.zeros((1, 3)))
        return max(float(verdict.utilisation[0]) - 1.0, float(verdict.violation[0]))

    over = [excess(float(tension)) > 0.0 for tension in tried]
    if over[0] or not any(over):
        return float(tried[0]) if over[0] else None
    first = over.index(True)
    return float(scipy.optimize.bisect(excess, tried[first - 1], tried[first], xtol=0.1))  # [N]
