"""Print what the certificate of a climb claims, and what its check has found; the same as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner import BoundCheck, ClimbCertificate, RouteCheck
from service.tables.layout import counted, in_colour, in_order, print_rows, verbosity

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["certificate_json", "print_certificate"]


def print_certificate(
    claimed: ClimbCertificate, bound: BoundCheck, route: RouteCheck, out: Console
) -> None:
    """Print the claims of a certificate as a table: what they rest on, and whether they hold.

    With the verbosity -1, only the latter is printed, a line for each.

    Parameters
    ----------
    claimed : ClimbCertificate
    bound : BoundCheck
    route : RouteCheck
    out : Console
        Console to print on.
    """
    places, bodies, limbs = claimed.reached.shape
    begin, end = ("goal", "start") if claimed.backward else ("start", "goal")
    stated = ""
    if len(route.factors):
        states = counted(len(route.factors), "state")
        stated = f"{states}, least load factor {claimed.route_factors.min():.6g}"
    ways = len(claimed.directions) + len(claimed.own_directions)
    claim = f"no climb has a least load factor of {claimed.multiple:.6g} or more"
    if not claimed.multiple:
        claim = "there is no climb, whatever its load factor"
    if verbosity() < 0:
        out.print(f"{claim}: {'proven' if bound.proven else 'not proven'}", highlight=False)
        if len(route.factors):
            out.print(f"route of {stated}: {route.fault or 'as stated'}", highlight=False)
        return
    rows = [
        ("bound", claim),
        (
            "rests on",
            f"{counted(places, 'placement')}, {counted(bodies, 'body', 'bodies')}, "
            f"{counted(limbs, 'limb')}, {claimed.reached.sum():,} of {claimed.reached.size:,} "
            f"within reach, {counted(len(claimed.shifts), 'shift')} of the body; sets "
            "of the hands (fixed wrists), body wrenches and limbs' moments as in the file",
        ),
        (
            "recomputed",
            f"supports in {counted(ways, 'direction')}; {counted(bound.connected, 'state')} "
            f"connected with the {begin}, {bound.ruled_out:,} next to them ruled out",
        ),
        ("", in_colour("optimal", "proven") if bound.proven else in_colour("failed", "not proven")),
    ]
    if bound.open_end is not None:
        body, *members = bound.open_end.tolist()
        on = zip(claimed.limbs, members, strict=True)
        where = ", ".join(f"{limb} at placement {p}" for limb, p in on)
        position = ", ".join(f"{x:.2f}" for x in claimed.body_poses[body, :3])
        rows.append(("", f"the {end} is connected: body {body} at ({position}) m, {where}"))
    if len(route.factors):
        right = in_colour("optimal", "as stated") if route.fault is None else route.fault
        rows += [("route", stated), ("", right)]
        if bound.proven and route.least > 0.0:
            gap = claimed.multiple / route.least - 1.0
            rows.append(("gap", f"another climb's least load factor is at most {gap:.2%} larger"))
    print_rows(rows, in_order(["claim"], (), ["what the check found"]), out, heads=False)


def certificate_json(
    claimed: ClimbCertificate, bound: BoundCheck, route: RouteCheck
) -> dict[str, Any]:
    """Return what a check has found as JSON has it.

    Parameters
    ----------
    claimed : ClimbCertificate
    bound : BoundCheck
    route : RouteCheck
    """
    places, bodies, _ = claimed.reached.shape
    return {
        "v": 1,
        "digest": claimed.digest,
        "multiple": claimed.multiple,
        "placements": places,
        "bodies": bodies,
        "proven": bound.proven,
        "connected": bound.connected,
        "ruled_out": bound.ruled_out,
        "open_end": None
        if bound.open_end is None
        else {"body": int(bound.open_end[0]), "members": bound.open_end[1:].tolist()},
        "route": None
        if not len(route.factors)
        else {
            "states": len(route.factors),
            "least": route.least if route.fault is None else None,
            "fault": route.fault,
        },
    }
