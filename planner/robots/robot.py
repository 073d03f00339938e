"""Robots: RoboSimian, which is bundled, and those that a file describes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from importlib import resources
from pathlib import Path

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose
from hand_models.hand import SpinyHand, spiny_hand
from hand_models.parameters import ParameterTable
from planner.robots.kinematics import RobotModel
from planner.robots.robot_file import RobotDescription, RobotFile

__all__ = ["Robot", "RobotFile", "load_robot", "robosimian", "robot_of"]


@dataclass(frozen=True, eq=False)
class Robot:
    """A climbing robot.

    Attributes
    ----------
    name : str
        As in the service's keys.
    mass : float
        With its hands [kg].
    com : ndarray, shape (3,)
        Centre of mass in B while no joint angles are given [m].
    shoulders : mapping of str to ndarray, shape (3,)
        By limb: where it begins, which none of its joints moves, in B [m].
    reaches : mapping of str to float
        By limb: farthest that the link with the hand can be from the shoulder [m].
    hand_in_link : mapping of str to Pose
        By limb: H in the link that carries it.
    hand : SpinyHand
        The hand on every limb.
    model : RobotModel
        Kinematics and statics by joint angles.
    torque_limits : mapping of str to ndarray, shape (n,)
        By limb: what its joints bear, from the body outward [N·m].
    """

    name: str
    mass: float
    com: Array
    shoulders: Mapping[str, Array]
    reaches: Mapping[str, float]
    hand_in_link: Mapping[str, Pose]
    hand: SpinyHand
    model: RobotModel
    torque_limits: Mapping[str, Array]

    @property
    def limbs(self) -> tuple[str, ...]:
        """Names of the limbs, in the order of the robot's file."""
        return tuple(self.shoulders)

    @property
    def reach(self) -> float:
        """The longest limb's reach [m]."""
        return max(self.reaches.values())

    def beyond(self, limb: str, hand_in_body: Pose) -> float:
        """Return how far a hand's pose puts its link from the shoulder [m], less the limb's reach.

        Above zero the pose is out of reach, and this is the distance that is missing.
        """
        return (self.stretch(limb, hand_in_body) - 1.0) * self.reaches[limb]

    def stretch(self, limb: str, hand_in_body: Pose) -> float:
        """Return how much of a limb's reach a hand's pose asks for; above 1 is out of reach."""
        return self.stretches(Pose.identity(), (limb,), (hand_in_body,))[0]

    def stretches(self, body: Pose, limbs: Sequence[str], hands: Sequence[Pose]) -> list[float]:
        """Return how much of their limbs' reaches hands ask for, with their poses and B's in W."""
        ends = np.array([self._ends[limb] for limb in limbs])
        links = np.einsum("nxy,ny->nx", np.array([hand.rotation for hand in hands]), ends[:, :3])
        links += np.array([hand.position for hand in hands]) - body.position
        away = links @ body.rotation - ends[:, 3:6]
        return (np.sqrt(np.einsum("nx,nx->n", away, away)) / ends[:, 6]).tolist()  # type: ignore[no-any-return]

    @cached_property
    def _ends(self) -> dict[str, tuple[float, ...]]:
        """By limb: its link's origin in H, its shoulder in B, its reach [m]."""
        return {
            limb: (
                *self.hand_in_link[limb].inverse().position.tolist(),
                *shoulder.tolist(),
                self.reaches[limb],
            )
            for limb, shoulder in self.shoulders.items()
        }


def robosimian(hand_numbers: ParameterTable | None = None) -> Robot:
    """Return RoboSimian with four SpinyHands, from ``parameters/robosimian.toml``, built once.

    Parameters
    ----------
    hand_numbers : ParameterTable, optional
        All numbers of its hands; the bundled ones by default.

    Raises
    ------
    InvalidInputError
        If a number of the hand is missing or impossible.
    """
    return robot_of(_bundled(), hand_numbers)


def load_robot(path: Path, hand_numbers: ParameterTable | None = None) -> Robot:
    """Return the robot that a file describes; raises what `RobotFile.load` and `robot_of` raise."""
    return robot_of(RobotFile.load(path), hand_numbers)


@lru_cache(maxsize=32)
def robot_of(file: RobotFile, hand_numbers: ParameterTable | None = None) -> Robot:
    """Return the robot of a file's content, built once.

    Parameters
    ----------
    file : RobotFile
    hand_numbers : ParameterTable, optional
        All numbers of its hands; the bundled ones by default.

    Raises
    ------
    InvalidInputError
        In one line that names the file and the entry, if one is unknown, missing or impossible, or
        does not fit the URDF; or names a number of the hand.
    """
    hand = spiny_hand(hand_numbers)
    try:
        described = RobotDescription.read(file.toml)
        model = RobotModel(file.urdf, described.body, described.mounts, hand.mass)
        torque_limits = {
            limb: _per_joint(described.torque_limits[limb], model, limb) for limb in model.limbs
        }
    except InvalidInputError as error:
        raise InvalidInputError(str(error), field=file.origin) from None
    return Robot(
        name=described.name,
        mass=model.mass,
        com=model.com({}) if described.com is None else np.array(described.com),
        shoulders=model.shoulders,
        reaches=model.reach,
        hand_in_link={limb: mount.pose for limb, mount in described.mounts.items()},
        hand=hand,
        model=model,
        torque_limits=torque_limits,
    )


def _per_joint(limits: tuple[float, ...], model: RobotModel, limb: str) -> Array:
    """Return torque limits, one a joint; refuse a list of another length."""
    joints = len(model.joint_names[limb])
    if len(limits) not in (1, joints):
        raise InvalidInputError(
            f"one number is needed, or {joints}, one for each joint from the body outward, "
            f"got {len(limits)}",
            field=f"limbs.{limb}.torque_limit",
        )
    return np.broadcast_to(np.array(limits), joints).copy()


@cache
def _bundled() -> RobotFile:
    folder = resources.files("planner.parameters")
    toml, urdf = (
        folder.joinpath(f"robosimian.{kind}").read_text(encoding="utf-8")
        for kind in ("toml", "urdf")
    )
    return RobotFile("robosimian", toml, urdf, "robosimian.toml")
