"""A study's claims as a table for a person."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from hand_models.studies import Claim, StudyResult
from service.tables import table_of

__all__ = ["print_study"]


def print_study(result: StudyResult, files: Sequence[Path], out: Console) -> None:
    """Print what was claimed, what came out, and where the files are."""
    out.print(f"{result.name}: {result.title}", style="bold", markup=False)
    table = table_of("")
    for name in ("claim", "claimed", "got"):
        table.add_column(name, overflow="fold")
    for claim in result.claims:
        cells = (escape(claim.claim), _cell(claim.claimed), _cell(claim.got))
        table.add_row(_verdict(claim), *cells, style=None if claim.holds else "bold")
    out.print(table)
    held = sum(claim.holds for claim in result.claims)
    out.print(f"{held} of {len(result.claims)} claims hold", markup=False)
    if any(claim.role == "calibration" for claim in result.claims):
        out.print("fitted: a parameter was calibrated to the claim", markup=False)
    for what in result.data.get("not_tested", ()):
        out.print(f"not tested: {what}", markup=False)
    for path in files:
        out.print(str(path), markup=False, soft_wrap=True)


def _verdict(claim: Claim) -> str:
    if not claim.holds:
        return "missed"
    return "fitted" if claim.role == "calibration" else "holds"


def _cell(value: str | float) -> str:
    return escape(value) if isinstance(value, str) else f"{value:.4g}"
