"""Define ``crux check``: recompute what the certificate of a climb claims."""

from __future__ import annotations

from pathlib import Path

import click

import planner
from service import tables
from service.commands import options

__all__ = ["check_command"]


@click.command("check")
@click.argument("certificate", type=click.Path(path_type=Path))
@options.json_option
def check_command(certificate: Path, as_json: bool) -> int:
    """Recompute what the certificate of a climb claims, without the search.

    CERTIFICATE is the file that was written with the climb. The check recomputes the supports of
    all hands from their vertices, rules states out with the certificate's directions, and goes from
    the start over all states that are left. It solves a linear program for each state of the route.

    Exit status: 0 if the bound is proven and the route is right, 3 if not, 2 if the file cannot be
    read.
    """
    claimed = planner.ClimbCertificate.read(certificate)
    with tables.working(f"checking {certificate}"):
        bound, route = planner.check_bound(claimed), planner.check_route(claimed)
    if as_json:
        tables.say(tables.certificate_json(claimed, bound, route))
    else:
        tables.print_certificate(claimed, bound, route, tables.console())
    right = bound.proven and route.fault is None
    return tables.ExitStatus.DONE if right else tables.ExitStatus.OVERLOADED
