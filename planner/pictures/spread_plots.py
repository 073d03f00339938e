"""How sure a plan is, drawn: its load factor over draws of what is not known."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner.result import MANY, Spread

__all__ = ["draw_spread"]

BAND, BAR, NOMINAL, NEEDED = "0.88", "tab:blue", "black", "tab:red"
"""Colours: from 5 to 95 %, the draws, the plan's own load factor, and 1."""


def draw_spread(axes: Any, spread: Spread, nominal: float | None) -> None:
    """Draw a histogram of the load factors over draws.

    Parameters
    ----------
    axes : Axes
    spread : Spread
        With load factors.
    nominal : float or None
        The plan's own load factor.
    """
    factors = [factor for factor in spread.load_factors if factor is not None]
    if spread.load_factor is None:
        return
    low, high = spread.load_factor.low, spread.load_factor.high
    ends = np.array([*factors, 1.0, *([] if nominal is None else [nominal])])
    axes.axvspan(low, high, color=BAND, label="5 to 95 %" if len(factors) >= MANY else "all")
    axes.hist(factors, np.linspace(ends.min(), ends.max(), 15 + 1), color=BAR)
    axes.axvline(1.0, color=NEEDED, linestyle="--", label="needed")
    if nominal is not None:
        axes.axvline(nominal, color=NOMINAL, label="nominal")
    said = f"holds in {spread.holds} of {spread.draws} draws"
    if spread.cap < 1.0:
        said += f" within {spread.cap:g}"
    if spread.hangs_on:
        said += f"; hangs most on {spread.hangs_on[0].quantity}"
    axes.set_title(said, fontsize=9)
    axes.set(xlabel="load factor [1]", ylabel="draws")
    axes.margins(x=0.04)
    axes.set_ylim(top=1.6 * axes.get_ylim()[1])
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.tick_params(labelsize=8)
    axes.legend(fontsize=7, loc="upper center", ncols=3, facecolor="white", framealpha=0.9)
