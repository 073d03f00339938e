"""A stance as a scene: all its geometry, in the body's frame B, whatever the world's frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array, Pose
from hand_models.hand import SettledHand, SpinyHand
from hand_models.sections import Swept
from planner.question import HandOnHold, Stance

__all__ = ["SCENE_SETTINGS", "Scene", "palm_capsule", "scene_of", "smooth_depths"]


@dataclass(frozen=True, slots=True)
class SceneSettings:
    """Bounds of usual sizes in a scene, and the length to which rock is extended."""

    in_thousands: float = 1.0 / 300.0
    """Part of what is usual up to which a number is taken for one in thousands, such as kN or t."""
    in_thousandths: float = 100.0
    """Multiple of it from which on it is taken for one in thousandths, such as g or N·mm."""
    unit_factor: float = 0.01
    """How near, as a part, a number must be to one in a unit that a power of ten does not show."""
    about_weight: float = 1.5
    """Factor within which a force is about the robot's weight, so that it is likely to hold it."""
    off_up: float = math.radians(60.0)
    """Angle to up from which on a force about the weight is odd: pulls turn it less [rad]."""
    sharpest: float = 5.0
    """Acceleration of a body that would need such a force, from which on it is odd [m/s²]: where
    gravity is small, climbers have larger ones than it."""
    least_payload: float = 1e-4
    """Part of the robot's mass below which a payload changes nothing, so that it may be in t."""
    widest: float = 20.0
    """Largest width of a hold, or lever of a moment, in multiples of the limbs' reach."""
    rock_length: float = 4.0
    """Length of rock that is drawn out, or along faces of an edge, from its crest [m]."""
    rock_triangles: int = 400_000
    """Triangles of rock from which on it is coarser for distances: each takes 4 µs and 1 kB."""
    rock_cube: float = 0.008
    """Side of the cubes that then keep one vertex each; capsules are rougher, 20 mm [m]."""


SCENE_SETTINGS: Final = SceneSettings()


@dataclass(frozen=True, eq=False)
class Scene:
    """Geometry of a stance in the body's frame. Arrays have one row for each of the n hands.

    Attributes
    ----------
    stance : Stance
        The stance itself.
    hands : tuple of HandOnHold
        The hands of the stance.
    swept : tuple of Swept or None
        Smooth shape of each hand's hold; None for a hold that is not smooth.
    places : ndarray, shape (n, 3)
        Origins of the hand frames H, in B [m].
    axes : ndarray, shape (n, 3, 3)
        Axes of the hand frames H in B, as columns.
    shoulders : ndarray, shape (n, 3)
        Shoulders of the hands' limbs, in B [m].
    rocks : tuple of Pose
        Pose of B in each hold's frame.
    """

    stance: Stance
    hands: tuple[HandOnHold, ...]
    swept: tuple[Swept | None, ...]
    places: Array
    axes: Array
    shoulders: Array
    rocks: tuple[Pose, ...]

    def smooth_depths(self, hands: Sequence[int], points: Array) -> Array:
        """Return how deep points are in the smooth holds of some hands, shape (k, n) [m].

        Depths are negative outside the rock, and lower bounds for an ellipsoid.

        Parameters
        ----------
        hands : sequence of int, length k
            Indices of hands whose hold is smooth.
        points : ndarray, shape (n, 3)
            Points in B [m].
        """
        rocks = [self.rocks[i] for i in hands]
        turned = points @ np.array([rock.rotation.T for rock in rocks])
        seen = turned + np.array([rock.position for rock in rocks])[:, None]
        shapes = [self.swept[i] for i in hands]
        return smooth_depths([shape for shape in shapes if shape is not None], seen)

    @property
    def limbs(self) -> tuple[str, ...]:
        """Limb of each hand."""
        return tuple(hand.limb for hand in self.hands)

    @property
    def palms(self) -> tuple[Array, float]:
        """Capsule of each hand (`palm_capsule`): segments (n, 2, 3) in B, and radius [m]."""
        segment, radius = palm_capsule(self.stance.robot.hand)
        turned = np.einsum("nxy,ky->nkx", self.axes, segment)
        return self.places[:, None] + turned, radius


def palm_capsule(hand: SpinyHand) -> tuple[Array, float]:
    """Return the capsule that stands for a hand: its segment (2, 3) in H, and radius [m].

    The capsule lies behind the palm's face. It is as long as the palm and as wide as the bases of
    its outer fingers.
    """
    radius = min(abs(hand.outer_axis.item(1)), 0.5 * hand.palm_length)
    half = 0.5 * hand.palm_length - radius
    return np.array([[-half, 0.0, -radius], [half, 0.0, -radius]]), radius


def scene_of(stance: Stance, settled: Sequence[SettledHand]) -> Scene:
    """Return the scene of a stance whose hands are closed on their holds.

    Parameters
    ----------
    stance : Stance
        Poses of the body and of the hands on their holds.
    settled : sequence of SettledHand
        The stance's hands, closed on their holds.
    """
    turn, hands = stance.body.rotation, stance.hands
    positions = np.array([hand.pose.position for hand in hands])
    rotations = np.array([hand.pose.rotation for hand in hands])
    places = (positions - stance.body.position) @ turn
    axes = turn.T @ rotations
    chains = stance.robot.chains
    seats = [each.seating.pose for each in settled]
    seat_places = np.array([seat.position for seat in seats])
    rock_axes = axes @ np.array([seat.rotation for seat in seats])
    rock_places = places + np.einsum("nxy,ny->nx", axes, seat_places)
    origins = -np.einsum("nxy,nx->ny", rock_axes, rock_places)
    return Scene(
        stance=stance,
        hands=hands,
        swept=tuple([hand.hold.swept for hand in hands]),
        places=places,
        axes=axes,
        shoulders=np.array([chains[hand.limb].shoulder for hand in hands]),
        rocks=tuple(
            [Pose(origin, each.T) for origin, each in zip(origins, rock_axes, strict=True)]
        ),
    )


def smooth_depths(shapes: Sequence[Swept], points: Array) -> Array:
    """Return the depth of points in smooth holds, shape (k, n) [m]; negative outside.

    The depth is the distance from the surface; for an ellipsoid, a lower bound of that distance.

    Parameters
    ----------
    shapes : sequence of Swept, length k
        Shapes of the holds (`hand_models.sections.Swept`).
    points : ndarray, shape (k, n, 3)
        Points in each hold's frame [m].
    """
    numbers = np.array(shapes)
    scales, (middle, radius, sine, cosine) = numbers[:, None, :3], numbers[:, 3:7].T[:, :, None]
    scaled = points * scales
    scaled[:, :, 2] -= scales[:, :, 2] * middle
    away = np.sqrt(np.einsum("knx,knx->kn", scaled, scaled))
    if sine.any():
        x, z = np.abs(scaled[:, :, 0]), scaled[:, :, 2]
        beside = (sine > 0.0) & (sine * x + cosine * z >= 0.0)
        away = np.where(beside, cosine * x - sine * z, away)
    return np.asarray((radius - away) / scales.max(axis=2))
