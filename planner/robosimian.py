"""RoboSimian: what the planner knows of the robot until joint angles come in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

import numpy as np

from hand_models.frames import Array, Pose
from hand_models.hand import SpinyHand, spiny_hand
from hand_models.parameters import ParameterTable

__all__ = ["Robot", "robosimian"]


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
        Centre of mass in B [m].
    shoulders : mapping of str to ndarray, shape (3,)
        By limb: where its first two joints meet, in B [m].
    reach : float
        Farthest that a limb's last link can be from its shoulder [m].
    hand_in_link : ndarray, shape (3,)
        Origin of H in the last link, axes parallel [m].
    hand : SpinyHand
        The hand on every limb.
    """

    name: str
    mass: float
    com: Array
    shoulders: Mapping[str, Array]
    reach: float
    hand_in_link: Array
    hand: SpinyHand

    @property
    def limbs(self) -> tuple[str, ...]:
        """Names of the limbs, in the order of the published model."""
        return tuple(self.shoulders)

    def stretch(self, limb: str, hand_in_body: Pose) -> float:
        """Return how much of a limb's reach a hand's pose asks for; above 1 is out of reach."""
        link = hand_in_body.position - hand_in_body.rotation @ self.hand_in_link
        return float(np.linalg.norm(link - self.shoulders[limb])) / self.reach


@lru_cache(maxsize=32)
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
    name = "robosimian.toml"
    text = resources.files("planner.parameters").joinpath(name).read_text(encoding="utf-8")
    table = ParameterTable.read(text, name)
    hand = spiny_hand(hand_numbers)
    limbs = tuple(table.sections["shoulders"])
    return Robot(
        name="robosimian",
        mass=table.scalar("robot", "mass") + len(limbs) * hand.mass,
        com=np.array(table.vector("robot", "com")),
        shoulders={limb: np.array(table.vector("shoulders", limb)) for limb in limbs},
        reach=table.scalar("limb", "reach"),
        hand_in_link=np.array(table.vector("mount", "hand_in_link7")),
        hand=hand,
    )
