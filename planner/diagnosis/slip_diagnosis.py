"""Find the tile that has probably slipped from motors' data, and the tiles that look alike.

Of each tile it is known what its motor would show (`slip_signatures`). With normal errors of the
data, Bayes' rule gives the probability of each tile if one has slipped. Before the data, a tile is
as likely as its part of the hazard, which grows with the share of its strength that is used.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, finite_vector
from hand_models.hand import FINGERS
from hand_models.parameters import bundled_table
from hand_models.tile import TileStrengths
from planner.diagnosis.signatures import slip_signatures
from planner.prepare import PreparedStance
from planner.question import LostTile
from planner.result import HandPlan

__all__ = ["SlipDiagnosis", "SlipFindings", "SuspectTile"]


class SuspectTile(NamedTuple):
    """A tile that may have slipped.

    Attributes
    ----------
    tile : LostTile
    probability : float
        That it is this tile, if one tile has slipped.
    expected : float
        Change of the tension that its slip makes [N], or turn of the winch [rad], of a tendon that
        slides.
    """

    tile: LostTile
    probability: float
    expected: float


class SlipFindings(NamedTuple):
    """Result of a diagnosis: the tiles that have probably slipped.

    Attributes
    ----------
    seen : bool
        True if a slip explains the data better than none, by three standard deviations.
    tiles : tuple of SuspectTile
        All tiles of the hands with data, the most probable first.
    suspects : tuple of LostTile
        The first of them, which have 95 % of the probability together.
    reason : str or None
        Why no slip is seen, or what the slip of one tile does not explain, one sentence; else None.
    """

    seen: bool
    tiles: tuple[SuspectTile, ...]
    suspects: tuple[LostTile, ...]
    reason: str | None = None


class _Shown(NamedTuple):
    """Data that motors show after each tile's slip, shape (2, T), and without one, shape (T,).

    ``meant``, ``rests``: values; ``errors``, ``rest_errors``: their standard deviations.
    """

    meant: Array
    errors: Array
    rests: Array
    rest_errors: Array


class SlipDiagnosis:
    """A plan of a prepared stance, for data of its motors after a slip.

    Parameters
    ----------
    prepared : PreparedStance
        All wrists are fixed.
    hands : sequence of HandPlan
        The stance's plan, to whose tensions the tendons have been tightened.

    Attributes
    ----------
    signatures : tuple of SlipSignature
        What each tile's slip would show.

    Raises
    ------
    UnsupportedError
        If a wrist is not fixed, or a grasp has fingernails.
    """

    def __init__(self, prepared: PreparedStance, hands: Sequence[HandPlan]) -> None:
        self._limbs = prepared.limbs
        self._tensions = np.array([hand.tensions for hand in hands])
        self._drives = [hand.hand.drive for hand in prepared.batch.hands]
        self.signatures = slip_signatures(prepared, hands)
        surfaces = [prepared.batch.hands[each.hand].surface for each in self.signatures]
        law = TileStrengths.of(surfaces, np.arange(len(surfaces)))
        uses = np.array([each.use for each in self.signatures])
        self._before = law.log_hazards(np.maximum(uses, _numbers()["least_use"]))

    def diagnose(
        self,
        *,
        tensions: Mapping[str, Array] | None = None,
        currents: Mapping[str, Array] | None = None,
        turns: Mapping[str, Array] | None = None,
    ) -> SlipFindings:
        """Return which tile has probably slipped; give one kind of data.

        Parameters
        ----------
        tensions : mapping of str to ndarray, shape (4,), optional
            Tensions after the slip, with winches that stood still, by limb [N]. Hands that are
            left out are not suspected.
        currents : mapping of str to ndarray, shape (4,), optional
            In their place, currents of motors that tighten the tendons to these tensions [A].
        turns : mapping of str to ndarray, shape (4,), optional
            Turns of the winches since, with motors that kept their tension, positive as they wind
            up tendon [rad].

        Raises
        ------
        InvalidInputError
            If not one kind of data is given, a limb is not known, or data are not four numbers.
        """
        kinds = {"tensions": tensions, "currents": currents, "turns": turns}
        given = {name: data for name, data in kinds.items() if data}
        if len(given) != 1:
            raise InvalidInputError(
                f"one of {', '.join(kinds)} is needed, got {' and '.join(given) or 'none'}",
                field="tensions",
            )
        ((kind, data),) = given.items()
        found = self._by_hand(data, kind)
        if kind == "currents":
            for h, drive in enumerate(self._drives):
                found[h] = (found[h] - drive.no_load_current) / drive.current_per_newton
        own = np.array([found[each.hand, each.finger] for each in self.signatures])
        shown, numbers = self._shown(held=kind != "turns"), _numbers()
        # logarithms of the densities of a slip over those of none, of tendons that slide and stick
        gain = np.log(shown.rest_errors / shown.errors) + 0.5 * (
            ((own - shown.rests) / shown.rest_errors) ** 2
            - ((own - shown.meant) / shown.errors) ** 2
        )
        known = np.flatnonzero(np.isfinite(own))
        if not len(known):
            return SlipFindings(False, (), (), "no tile of the hands with data is on the rock")
        sticks = np.log([[1.0 - numbers["sticks"]], [numbers["sticks"]]])
        logs = np.logaddexp(*(gain[:, known] + sticks)) + self._before[known]
        shares = np.exp(logs - logs.max())
        shares /= shares.sum()
        order = np.argsort(-shares, kind="stable")
        count = int(np.searchsorted(np.cumsum(shares[order]), numbers["credible"])) + 1
        changes = shown.meant[0] - shown.rests
        tiles = tuple(
            SuspectTile(self.signatures[k].tile, float(shares[i]), float(changes[k]))
            for i, k in zip(order, known[order], strict=True)
        )
        seen = bool(gain[:, known].max() > 0.5 * numbers["seen"] ** 2)
        suspects = tuple(each.tile for each in tiles[:count])
        explain = self._left if seen else self._unseen
        reason = explain(own, shown, known[order], kind)
        return SlipFindings(seen, tiles, suspects, reason)

    def _unseen(self, own: Array, shown: _Shown, known: Indices, kind: str) -> str:
        """Say why no slip is seen: what is off most, and how many slips would not show."""
        least = _numbers()["seen"]
        off = (own - shown.rests) / shown.rest_errors
        k = int(known[np.abs(off[known]).argmax()])
        tile, unit = self.signatures[k].tile, "rad" if kind == "turns" else "N"
        what = "turn of the winch" if kind == "turns" else "tension"
        by = own[k] - shown.rests[k]
        said = (
            f"the {what} of {tile.limb} {tile.finger} is off most, by {by:+.2g} {unit}, "
            f"{abs(off[k]):.2g} of its standard deviation"
        )
        if abs(off[k]) > least:
            return f"{said}, which the slip of no tile explains; check data and set-points"
        changes = np.abs(shown.meant[0] - shown.rests) / shown.errors[0]
        hidden = int((changes[known] < least).sum())
        return (
            f"{said}, and a slip is seen from {least:g} of them; those of {hidden} of {len(known)} "
            "tiles would show less"
        )

    def _left(self, own: Array, shown: _Shown, known: Indices, kind: str) -> str | None:
        """Say which data the first of the ``known`` tiles leaves unexplained; None if none."""
        first = self.signatures[known[0]]
        here = [(e.hand, e.finger) == (first.hand, first.finger) for e in self.signatures]
        of_first = np.abs((own - shown.meant[:, known[:1]]) / shown.errors[:, known[:1]]).min(
            axis=0
        )
        off = np.where(here, of_first, np.abs((own - shown.rests) / shown.rest_errors))
        k = int(known[off[known].argmax()])
        if off[k] <= _numbers()["unexplained"]:
            return None
        tile, what = self.signatures[k].tile, "turn" if kind == "turns" else "tension"
        return (
            f"the {what} of {tile.limb} {tile.finger} is {off[k]:.2g} of its standard deviation "
            "from what the slip of one tile explains: several may have slipped; check data, their "
            "units and set-points, too"
        )

    def ambiguous(self, *, held: bool) -> tuple[tuple[LostTile, LostTile], ...]:
        """Return pairs of tiles of a finger whose slips look alike: within twice the data's error.

        Of a tendon that slides.

        Parameters
        ----------
        held : bool
            Whether the winches stand still, or the motors keep their tensions.
        """
        shown = self._shown(held=held)
        meant, errors = shown.meant[0], shown.errors[0]
        return tuple(
            (one.tile, two.tile)
            for (i, one), (j, two) in combinations(enumerate(self.signatures), 2)
            if (one.hand, one.finger) == (two.hand, two.finger)
            and abs(meant[i] - meant[j]) < errors[i] + errors[j]
        )

    def _shown(self, *, held: bool) -> _Shown:
        """Return what motors show that stand still, or keep their tensions."""
        numbers, each = _numbers(), self.signatures
        rests = np.array([self._tensions[one.hand, one.finger] for one in each])
        tensions = np.array([one.tensions for one in each]).T
        turns = np.array([one.turns for one in each]).T

        def errors(f: Array) -> Array:
            return np.hypot(numbers["tension"] * f, numbers["least_tension"])

        if held:
            return _Shown(tensions, errors(tensions), rests, errors(rests))
        give = np.array([one.turn_per_newton for one in each])
        error = np.hypot(give * errors(rests), numbers["winch_angle"])
        return _Shown(turns, np.broadcast_to(error, turns.shape), np.zeros(len(each)), error)

    def _by_hand(self, data: Mapping[str, Array], field: str) -> Array:
        """Return data by limb as an array over all hands, shape (hands, 4), NaN where missing."""
        found = np.full((len(self._limbs), len(FINGERS)), np.nan)
        for limb, own in data.items():
            if limb not in self._limbs:
                raise InvalidInputError(
                    f"no hand of the stance; it has {', '.join(self._limbs)}",
                    field=f"{field}.{limb}",
                )
            found[self._limbs.index(limb)] = finite_vector(own, len(FINGERS), f"{field}.{limb}")
        return found


def _numbers() -> dict[str, float]:
    """Return the numbers of ``diagnosis.toml`` by name."""
    table = bundled_table("diagnosis.toml", "planner.parameters")
    sections = (
        ("noise", ("tension", "least_tension", "winch_angle")),
        ("suspects", ("credible", "least_use", "seen", "sticks", "unexplained")),
    )
    return {name: table.positive(section, name) for section, names in sections for name in names}
