"""Load factor of a stance whose hands are not quite where they were put: quantiles over draws."""

from __future__ import annotations

from msgspec import Struct

__all__ = ["RobustLoadFactor", "RobustQuantiles"]


class RobustQuantiles(Struct, frozen=True):
    """Quantiles of the load factor over all draws, with their 95 % confidence intervals.

    Attributes
    ----------
    tenth : float
        10 % quantile: the load factor is larger in nine of ten draws.
    hundredth : float
        1 % quantile: the load factor is larger in 99 of a hundred draws.
    tenth_interval, hundredth_interval : list of float, length 2
        Lower and upper end of the confidence interval of the quantile.
    """

    tenth: float
    tenth_interval: list[float]
    hundredth: float
    hundredth_interval: list[float]


class RobustLoadFactor(Struct, frozen=True):
    """Load factor for hands placed inaccurately: statistics over random placements of the rock.

    Each hand is closed again at ``places`` poses near its given one, from a scrambled Sobol
    sequence seeded by the limb's name. Poses of all hands are combined at random; each combination
    is a draw. The hand frame H stays in the world frame W, with body and joints; the rock moves
    instead. Quantiles are over all draws. In a draw where a hand cannot be closed, or nothing can
    be held, the load factor is zero. A hand that was placed by contact is displaced along x and y
    and turned about z, comes to rest anew there, and then gets a small further displacement.

    Tensions, and where compliant wrists go, are planned anew for every draw: the load factor is
    that of a robot that knows where its hands are. With compliant wrists each draw has places of
    its own, and a deadline may leave fewer draws than places.

    Attributes
    ----------
    draws, without : int
        Number of draws, and of draws with a load factor of zero.
    refused : dict of str to int
        Number of draws in which a hand cannot be closed, by limb; limbs without such draws are left
        out.
    position, angle : float
        Half width of the scatter: along each axis of H [m], and about each axis [rad].
    seed : int
        Seed of the random combinations.
    worst : float
        Deprecated: the same as ``hundredth``. In old versions, the least load factor of the draws
        that have one, which depends on their number.
    tenth, tenth_interval, hundredth, hundredth_interval
        Deprecated: the same as in ``replanned``.
    places : int
        Number of poses of each hand.
    reasons : dict of str to str
        Why a hand cannot be closed at the first pose where it cannot, by limb.
    replanned : RobustQuantiles
        Quantiles of the load factor, with tensions planned anew for each draw.
    contact_position, contact_angle : float or None
        Half width of the further displacement of hands placed by contact: along z of H [m], and
        about x and y [rad], in place of ``position`` and ``angle``. None without such hands.
    """

    draws: int
    without: int
    refused: dict[str, int]
    position: float
    angle: float
    seed: int
    worst: float
    tenth: float
    tenth_interval: list[float]
    hundredth: float
    hundredth_interval: list[float]
    places: int
    replanned: RobustQuantiles
    reasons: dict[str, str] = {}
    contact_position: float | None = None
    contact_angle: float | None = None
