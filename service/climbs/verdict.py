"""Say to a person what came of the search for a climb."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from planner import FoundClimb, Spread
from service.tables import counted, spread_sentences

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["print_verdict", "spread_of", "verdict_sentences"]


def print_verdict(
    found: FoundClimb, at_least: float | None, files: Mapping[str, Path], out: Console
) -> None:
    """Print the verdict of a search, and the names of its files.

    Parameters
    ----------
    found : FoundClimb
    at_least : float or None
        Load factor that was asked for.
    files : mapping of str to Path
    out : Console
    """
    for sentence in verdict_sentences(found, at_least):
        out.print(sentence, markup=False, highlight=False)
    if (spread := spread_of(found)) is not None:
        for sentence in spread_sentences(spread):
            out.print(f"deciding stage: {sentence}", markup=False, highlight=False)
    for name, path in files.items():
        out.print(f"{name}: {path}", markup=False, highlight=False, soft_wrap=True)


def spread_of(found: FoundClimb) -> Spread | None:
    """Return the spread of the stage that decides, if it was planned over samples."""
    if found.result is None or found.deciding is None:
        return None
    return found.result.plans[found.deciding.stage].spread


def verdict_sentences(
    found: FoundClimb, at_least: float | None, *, raises: bool = True
) -> Iterator[str]:
    """Yield the sentences of a verdict.

    Parameters
    ----------
    found : FoundClimb
    at_least : float or None
        Load factor that was asked for.
    raises : bool, optional
        Whether to say what raises the load factor of the stage that decides.
    """
    asked = f" with a load factor of {max(at_least or 1.0, 1.0):g} or more"
    yield {
        "found": "FOUND     a climb, planned from end to end",
        "not_proven": "FOUND     a climb, planned from end to end; another may be better",
        "none": f"NONE      it is proven that no climb{asked} exists",
        "blocked": f"BLOCKED   hands could hold a climb{asked}, but no moves of one have a plan",
        "unknown": f"UNKNOWN   no climb{asked} was found in time; there may be one",
    }[found.status]
    if found.least is not None and found.climb is not None and found.gap is not None:
        yield (
            f"least load factor {found.least:.3f}, of any other climb at most {found.bound:.3f} "
            f"(gap {100.0 * found.gap:.1f} %); {found.found.least:.3f} by statics alone"
        )
        knots = found.climb.knots
        moves = counted(len(found.climb.route.moves), "move of a limb", "moves of limbs")
        yield f"{moves}, {counted(len(knots), 'knot')}, {knots[-1].time:.0f} s long"
    elif abs(found.bound) < float("inf"):
        yield f"no climb has a least load factor above {found.bound:.3f}"
    deciding = found.deciding
    if deciding is not None:
        what = " ".join(filter(None, (deciding.phase, deciding.limb)))
        where = ", ".join(f"{limb} at {place}" for limb, place in deciding.placements.items())
        reason = found.result.plans[deciding.stage].reason if found.result else ""
        limit = f"; {reason}" if reason else ""
        move = f"move {deciding.move}, " if deciding.move else ""
        yield f"stage {deciding.stage} decides ({move}{what}; {where}){limit}"
    if found.compliant is not None:
        plans, least = found.compliant.plans, found.compliant.load_factor
        held = sum(plan.status == "optimal" for plan in plans)
        said = "some have no load factor" if least is None else f"least load factor {least:.3f}"
        yield f"with compliant wrists {held} of {counted(len(plans), 'stage')} hold; {said}"
    for each in found.raises[: 3 * raises]:
        yield f"  {each.load_factor:.3f} in that stage with {each.change}"
    for kind in found.refused[:3]:
        which = kind.phase if kind.limb is None else f"{kind.phase} of {kind.limb}"
        yield f"{counted(kind.count, 'move')} had no plan ({which}): {kind.reason}"
    if abs(found.bound) < float("inf"):
        yield found.about
