"""Result of a plan that is executed as it is while its hands are displaced."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from msgspec import Struct

__all__ = ["OpenLoop", "OpenLoopSample"]


class OpenLoopSample(Struct, frozen=True):
    """Outcome of one sample of displaced hands; without an equilibrium, numbers are None.

    Attributes
    ----------
    found : bool
        Whether all hands can be closed, and a stable equilibrium of wrists and body was found.
    holds : bool
        Whether the equilibrium keeps all limits: the utilisation is within the cap, no tile is
        dragged backwards, and no other hard row of a finger is violated.
    utilisation : float or None
        Largest load over capacity of all limits, as of a plan.
    limb : str or None
        Limb of the hand with the largest utilisation.
    dragged : float or None
        Largest force by which a tile is dragged backwards [N]; 0 if no tile is.
    body_twist : list of float, length 6, or None
        Twist of the body frame B from its given pose, in B [m, rad].
    """

    found: bool
    holds: bool = False
    utilisation: float | None = None
    limb: str | None = None
    dragged: float | None = None
    body_twist: list[float] | None = None


class OpenLoop(Struct, frozen=True):
    """Utilisation over displaced hands if a plan's tensions and pose targets stay as planned.

    In each sample every hand is displaced on its rock, on its own, and closes there. Its pose in
    the body frame B stays: the rock moves instead. Tensions go to the planned ones, and each limb
    pulls its wrist toward the planned pose target with the stance's limb stiffness. Body and wrists
    settle where they balance the body wrench. Each equilibrium is verified, except its stability;
    one that fails the check counts as none. Quantiles and shares are statistics of the samples.

    Attributes
    ----------
    samples : list of OpenLoopSample
        Outcome of each sample.
    seed : int
        Seed of the displacements.
    position, height : float
        Largest displacement along x and y of the hand frame H, and along z, either way [m].
    tilt, yaw : float
        Largest rotation about x and y of H, and about z, either way [rad].
    tenth, median, ninetieth : float or None
        10, 50 and 90 % quantile of the utilisation, which is infinite in a sample without an
        equilibrium; None for an infinite quantile.
    holds : float
        Share of the samples whose equilibrium keeps all limits.
    dragged, without : int
        Number of samples in which a tile is dragged backwards, and of samples without a stable
        equilibrium.
    worst_limb : str or None
        Limb of the hand that has the largest utilisation in most samples; None without any.
    refused : dict of str to int
        Number of samples in which a hand cannot be closed, by limb; limbs without such samples are
        left out.
    reasons : dict of str to str
        Why a hand cannot be closed at the first displacement where it cannot, by limb.
    """

    samples: list[OpenLoopSample]
    seed: int
    position: float
    height: float
    tilt: float
    yaw: float
    tenth: float | None
    median: float | None
    ninetieth: float | None
    holds: float
    dragged: int
    without: int
    worst_limb: str | None
    refused: dict[str, int] = {}
    reasons: dict[str, str] = {}

    @classmethod
    def of(
        cls,
        samples: Sequence[OpenLoopSample],
        seed: int,
        ranges: tuple[float, float, float, float],
        refused: Mapping[str, int],
        reasons: Mapping[str, str],
    ) -> OpenLoop:
        """Compute the statistics over the outcomes of all samples.

        Parameters
        ----------
        samples : sequence of OpenLoopSample
            Outcome of each sample.
        seed : int
            Seed of the displacements.
        ranges : tuple of float
            Position, height [m], tilt and yaw [rad].
        refused, reasons : mapping
            Hands that cannot be closed: in how many samples, and why.
        """
        import numpy as np

        used = [math.inf if s.utilisation is None else s.utilisation for s in samples]
        with np.errstate(invalid="ignore"):  # between infinite ones
            tenth, median, ninetieth = (
                value if math.isfinite(value) else None
                for value in np.percentile(used, [10.0, 50.0, 90.0]).tolist()
            )
        worst = Counter(sample.limb for sample in samples if sample.limb is not None)
        return cls(
            list(samples),
            seed,
            *ranges,
            tenth=tenth,
            median=median,
            ninetieth=ninetieth,
            holds=sum(sample.holds for sample in samples) / len(samples),
            dragged=sum(bool(sample.dragged) for sample in samples),
            without=sum(not sample.found for sample in samples),
            worst_limb=max(worst, key=worst.__getitem__) if worst else None,
            refused=dict(refused),
            reasons=dict(reasons),
        )
