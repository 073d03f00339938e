"""The palm experiments of Section 4.2: springs for contacts, the softest with a hard stop.

The stop's travel is not printed. All loads are proportional to the travel, so they are given per
metre of it; a gain by friction does not depend on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hand_models.parameters import ParameterTable, experiment_table
from hand_models.tendon import share_load

__all__ = ["PalmExperiment"]


@dataclass(frozen=True)
class PalmExperiment:
    """Parameters of the palm experiment that all configurations of its springs share.

    Attributes
    ----------
    springs : tuple of float
        Contact stiffness of springs 1, 2, 3 [N/m].
    preload_stiffness : float
        Stiffness k_p of each tile's preload spring [N/m].
    friction : float
        Coefficient μ of pulleys that are fixed rods.
    """

    springs: tuple[float, ...]
    preload_stiffness: float
    friction: float

    @classmethod
    def from_tables(cls, hand: ParameterTable) -> PalmExperiment:
        """Read the experiment's parameters from tables.

        Parameters
        ----------
        hand : ParameterTable
            Parameters of the hand, for the palm; the springs are those of ``experiments.toml``.
        """
        return cls(
            springs=experiment_table().vector("load_sharing", "contact_springs"),
            preload_stiffness=hand.scalar("palm", "spring_stiffness"),
            friction=hand.scalar("palm", "pulley_friction"),
        )

    def load(self, sequence: Sequence[int], friction: float, own_friction: float = 0.0) -> float:
        """Return the palm's load when the first of its softest contacts reaches its stop.

        Parameters
        ----------
        sequence : sequence of int
            Numbers of the springs, 1 to 3, from the left.
        friction : float
            Friction coefficient of the tiles' pulleys.
        own_friction : float
            Friction coefficient of the palm's pulleys between the tiles.

        Returns
        -------
        float
            Load per metre of the stop's travel [N/m].
        """
        stiffness = [self.springs[number - 1] for number in sequence]
        sharing = share_load(stiffness, self.preload_stiffness, friction, own_friction)
        softest = np.array(stiffness) == min(stiffness)
        return float(sharing.tile_stiffness.sum() / sharing.tile_travel[softest].max())

    def gain(self, sequence: Sequence[int]) -> float:
        """Return by what share friction raises the palm's load: rods in place of bearings.

        Parameters
        ----------
        sequence : sequence of int
            Numbers of the springs, 1 to 3, from the left.

        Returns
        -------
        float
            Relative gain: 0.1 if the load is 10 % larger with fixed rods as the tiles' pulleys.
        """
        return self.load(sequence, self.friction) / self.load(sequence, 0.0) - 1.0
