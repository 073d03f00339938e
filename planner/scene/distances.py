"""Least distances between the parts of a scene, and collisions of links."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from planner.result import Clearance, Distance, Finding
from planner.robots import Robot
from planner.scene.scene import Scene
from planner.scene.solids import Solid, capsule_solids, distance_between, hand_solids, rock_solids

__all__ = ["body_clearance", "clearance", "link_findings", "unjoined_pairs"]


class _Pairs(NamedTuple):
    """Solids that are measured from each other.

    Attributes
    ----------
    first, second : sequence of Solid
    which : ndarray of int, shape (n, 2)
        One of the first and one of the second.
    least : ndarray, shape (n,)
        Lower bounds of their distances [m].
    """

    first: Sequence[Solid]
    second: Sequence[Solid]
    which: Indices
    least: Array


class _Near(NamedTuple):
    first: Solid
    second: Solid
    distance: float
    points: Sequence[Array]


def clearance(scene: Scene, angles: Mapping[str, Array] | None) -> Clearance:
    """Return the least distances between hands, body, rock and, with joint angles, links.

    Parameters
    ----------
    scene : Scene
        Geometry of the stance in the body frame B.
    angles : mapping of str to ndarray, shape (n,), or None
        Joint angles of every limb [rad, or m]; None if unknown: links are not measured then.
    """
    hands, rocks, body = hand_solids(scene), rock_solids(scene), _body(scene)
    unchecked = [] if body else ["body: the robot's file has no capsules of it"]
    of_links: dict[str, Distance | None] = {}
    if angles is None:
        unchecked.append("links: the joints are not known; give stance.joints, or 'solve'")
    else:
        links = _links(scene, angles)
        of_links["link_rock"] = _least(scene, _with_rock(scene, links[len(body) :], rocks))
        of_links["link_link"] = _least(scene, _among_links(scene, links, hands))
    return Clearance(
        **of_links,
        hand_hand=_least(scene, _pairs(hands, hands, np.argwhere(np.tri(len(hands), k=-1)))),
        hand_body=_least(scene, _pairs(hands, body, _every(hands, body))),
        body_rock=_least(scene, _with_rock(scene, body, rocks)),
        unchecked=unchecked,
    )


def body_clearance(scene: Scene) -> Distance | None:
    """Return the body's least distance from rock; None if the body has no capsules."""
    return _least(scene, _with_rock(scene, _body(scene), rock_solids(scene)))


def link_findings(scene: Scene, angles: Mapping[str, Array]) -> tuple[Finding, ...]:
    """Return a finding for links that are more than 0.02 m deep in rock or in each other.

    For given joint angles: the deepest collision of each limb, and of each pair of limbs. For
    solved joints: only the deepest of all.

    Parameters
    ----------
    scene : Scene
        Geometry of the stance in the body frame B.
    angles : mapping of str to ndarray, shape (n,)
        Joint angles of every limb [rad, or m].
    """
    robot, links = scene.stance.robot, _links(scene, angles)
    owners = dict(zip(robot.capsules.names, robot.capsules.limbs, strict=True))
    hands = hand_solids(scene)
    owners |= dict(zip((hand.name for hand in hands), scene.limbs, strict=True))
    moving = links[len(robot.body_capsules[0]) :]
    asked = {
        "link_in_rock": _with_rock(scene, moving, rock_solids(scene)),
        "links_collide": _among_links(scene, links, hands),
    }
    stance = scene.stance
    one_by_one = () if isinstance(stance.joints, str) else {*robot.limbs} - stance.solved_limbs
    found: dict[tuple[str, ...], _Near] = {}
    for kind, pairs in asked.items():
        for near in _inside(pairs):
            limbs = [owners.get(solid.name) for solid in (near.first, near.second)]
            given = [limb for limb in limbs if limb is not None and limb in one_by_one]
            key = (kind, *sorted(given))
            if key not in found or near.distance < found[key].distance:
                found[key] = near
    return tuple(
        _link_finding(*key[:2], near=near, holding=scene.limbs) for key, near in found.items()
    )


def _link_finding(
    kind: str, limb: str | None = None, *, near: _Near, holding: Sequence[str]
) -> Finding:
    """Return what is said of a link.

    Parameters
    ----------
    kind : str
    limb : str, optional
        Whose it is, where its joints were given.
    near : _Near
    holding : sequence of str
        Limbs with a hand, which their angles put where it holds.
    """
    field = "stance.joints"
    slip = (
        "'solve' looks at the hands alone; give angles that keep clear, of a route in "
        "moves[].joints, too"
    )
    if limb is not None:
        field, slip = f"stance.joints.{limb}", "are its angles in rad, from the body outward?"
        if limb in holding:
            slip = "its angles put the hand where it holds, others may keep the links clear, too"
    deep, assumed = -near.distance, near.first.assumed + near.second.assumed
    if deep <= assumed:
        # thinner links would be clear of each other
        thick = max(near.first.assumed, near.second.assumed)
        slip = (
            f"links are taken to have a radius of {1e3 * thick:g} mm, as the robot's file says "
            "nothing of it; give their capsules there, or the limb's radius"
        )
    message = f"{near.first.name} is {deep:.2g} m in {near.second.name}: {slip}"
    return Finding(kind, field, message, deep, "m")


# Solids -------------------------------------------------------------------------------------------


def _body(scene: Scene) -> tuple[Solid, ...]:
    ends, radii = scene.stance.robot.body_capsules
    return capsule_solids(["body"] * len(ends), ends, radii)


def _links(scene: Scene, angles: Mapping[str, Array]) -> tuple[Solid, ...]:
    """Return capsules of the body and all links, in the order of the robot's."""
    robot = scene.stance.robot
    named = zip(robot.capsules.names, robot.capsules.limbs, strict=True)
    names = ["body" if limb is None else name for name, limb in named]
    radii = robot.capsules.radii
    solids = capsule_solids(names, robot.placed_capsules(angles), radii)
    assumed = (radii * robot.capsules.assumed).tolist()
    return tuple([each._replace(assumed=by) for each, by in zip(solids, assumed, strict=True)])


# Pairs of them ------------------------------------------------------------------------------------


def _every(first: Sequence[Solid], second: Sequence[Solid]) -> Indices:
    return np.argwhere(np.ones((len(first), len(second))))


def _pairs(first: Sequence[Solid], second: Sequence[Solid], which: Indices) -> _Pairs:
    """Return pairs, which are at least as far from each other as the balls about them."""
    if not len(which):
        return _Pairs(first, second, which, np.zeros(0))
    middles = [np.array([solid.middle for solid in some]) for some in (first, second)]
    bounds = [np.array([solid.bound for solid in some]) for some in (first, second)]
    i, j = which.T
    apart = middles[0][i] - middles[1][j]
    least = np.sqrt(np.einsum("nx,nx->n", apart, apart)) - bounds[0][i] - bounds[1][j]
    return _Pairs(first, second, which, least)


def _with_rock(scene: Scene, solids: Sequence[Solid], rocks: Sequence[Solid]) -> _Pairs:
    """Return everything with all rock; of rock that is not smooth no bound is known."""
    least = np.full((len(solids), len(rocks)), -np.inf)
    smooth = [i for i, swept in enumerate(scene.swept) if swept is not None]
    if smooth and solids:
        middles = np.array([solid.middle for solid in solids])
        bounds = np.array([solid.bound for solid in solids])
        least[:, smooth] = -scene.smooth_depths(smooth, middles).T - bounds[:, None]
    return _Pairs(solids, rocks, _every(solids, rocks), least.ravel())


def _among_links(scene: Scene, links: Sequence[Solid], hands: Sequence[Solid]) -> _Pairs:
    """Return links with links, the body and hands, but for those that are joined.

    Hands are measured from each other and from the body without joints.
    """
    solids = (*links, *hands)
    radii = np.array([solid.shape.radius for solid in solids])
    which = unjoined_pairs(scene.stance.robot, scene.limbs, radii)
    body = len(scene.stance.robot.body_capsules[1])
    i, j = which.T
    of_hands = (j >= len(links)) & ((i >= len(links)) | (i < body))
    return _pairs(solids, solids, which[~of_hands])


def unjoined_pairs(robot: Robot, limbs: Sequence[str], radii: Array) -> Indices:
    """Return pairs of a robot's capsules, and of some limbs' hands, that may meet, shape (k, 2).

    Those that are joined are left out: parts of one link, of neighbouring links, and of links
    joined by joints that are nearer than both are thick.

    Parameters
    ----------
    robot : Robot
    limbs : sequence of str, length h
        Limbs with a hand.
    radii : ndarray, shape (n + h,)
        Radii of the robot's n capsules, and then of the hands [m].

    Returns
    -------
    ndarray of int, shape (k, 2)
        Indices from 0 to n + h − 1, the lower first.
    """
    order = [None, *robot.limbs]
    limb = np.array([order.index(each) for each in (*robot.capsules.limbs, *limbs)])
    ends = [len(robot.chains[each].moving) for each in limbs]
    step = np.append(robot.capsules.steps, ends)
    i, j = np.triu_indices(len(radii), 1)
    near, far = np.minimum(step[i], step[j]), np.maximum(step[i], step[j])
    along, whose = _along(robot), np.maximum(limb[i], limb[j])
    between = along[whose, far] - along[whose, near + 1]
    alike = (limb[i] == limb[j]) | (limb[i] == 0) | (limb[j] == 0)
    joined = alike & ((far - near <= 1) | (between < radii[i] + radii[j]))
    return np.asarray(np.column_stack([i, j])[~joined])


def _along(robot: Robot) -> Array:
    """Return how far along its limb each joint is [m]: rows by limb, the body's first; by step."""
    most = max(len(chain.moving) for chain in robot.chains.values())
    table = np.zeros((1 + len(robot.chains), most + 2))
    for row, chain in zip(table[1:], robot.chains.values(), strict=True):
        row[1:] = chain.spacing.sum()
        row[1 : len(chain.spacing) + 1] = chain.spacing.cumsum()
    return table


# Their distances ----------------------------------------------------------------------------------


def _inside(pairs: _Pairs) -> Iterator[_Near]:
    """Yield pairs that are in each other."""
    rough = 0.02  # depth that is not odd, as capsules are rough [m]
    for i, j in pairs.which[pairs.least < -rough].tolist():
        near = _measured(pairs, i, j)
        if near.distance < -rough:
            yield near


def _least(scene: Scene, pairs: _Pairs) -> Distance | None:
    """Return the least distance of pairs; None where there are none."""
    best: _Near | None = None
    for k in np.argsort(pairs.least, kind="stable").tolist():
        if best is not None and pairs.least[k] >= best.distance:
            break
        near = _measured(pairs, *pairs.which[k].tolist())
        best = near if best is None or near.distance < best.distance else best
    if best is None:
        return None
    points = [scene.stance.body.apply(point).tolist() for point in best.points]
    return Distance([best.first.name, best.second.name], best.distance, points)


def _measured(pairs: _Pairs, i: int, j: int) -> _Near:
    first, second = pairs.first[i], pairs.second[j]
    return _Near(first, second, *distance_between(first, second))
