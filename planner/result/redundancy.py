"""Plans of a stance without each of its tiles, fingers and hands, in short."""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from planner.result.plain_parts import Status

__all__ = ["Loss", "LossKind", "Redundancy"]

LossKind = Literal["tile", "finger", "hand"]


class Loss(Struct, frozen=True):
    """The best plan of a stance without one tile, one finger or one hand, without moving.

    Attributes
    ----------
    kind : {'tile', 'finger', 'hand'}
        A tile that slips drags on with friction while it is pressed. A finger that is lost is off
        the rock, and so are all fingers and the palm of a hand that is lost.
    limb : str
    finger : str or None
        None if the whole hand is lost.
    phalanx : str or None
        None if the whole finger or hand is lost.
    status : {'optimal', 'overloaded', 'infeasible', 'failed'}
    utilisation : float or None
        Least utilisation without the part; None without a plan.
    verified : bool
        True if the plan, or the proof that there is none, passed the independent check.
    """

    kind: LossKind
    limb: str
    finger: str | None
    phalanx: str | None
    status: Status
    utilisation: float | None
    verified: bool

    @property
    def holds(self) -> bool:
        """True if there is a plan within the cap on the utilisation."""
        return self.status == "optimal"

    @property
    def words(self) -> str:
        """The lost part, for a sentence."""
        names = {
            "tile": f"{self.finger} {self.phalanx}",
            "finger": f"{self.finger}",
            "hand": "the hand",
        }
        return f"{self.limb}: {names[self.kind]}"


class Redundancy(Struct, frozen=True):
    """Plans of a stance without each of its tiles, fingers and hands, one at a time.

    Attributes
    ----------
    utilisation : float or None
        Least utilisation of the whole stance; None without a plan.
    losses : list of Loss
        Each tile on the rock, then each finger and each hand that has one.
    held : dict of str to list of int
        By kind of loss, how many of them have a plan, and how many there are.
    worst : dict of str to Loss
        By kind of loss, the one with the largest utilisation; one without a plan is worse.
    """

    utilisation: float | None
    losses: list[Loss]
    held: dict[LossKind, list[int]]
    worst: dict[LossKind, Loss]

    @property
    def sentences(self) -> list[str]:
        """Sentences that say how many losses of each kind have a plan, and which is worst."""
        found = []
        for kind, (held, count) in self.held.items():
            worst = self.worst[kind]
            used = "no plan" if worst.utilisation is None else f"{worst.utilisation:.3f}"
            found.append(f"holds without {held} of {count} {kind}s; worst {worst.words}, {used}")
        return found
