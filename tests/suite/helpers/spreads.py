"""Draws of parameters and questions whose plans have a spread over them."""

from __future__ import annotations

from dataclasses import replace

from hand_models.parameters import ParameterSample, own_draw
from planner.question import Question
from service.answering.questions import question
from service.commands.stances import read_request

__all__ = ["FEW", "STRENGTHS", "asked_of", "drawn", "entry", "radii", "seat"]


def entry(value, unit: str) -> dict[str, object]:
    return {"value": value, "unit": unit, "source": "assumed"}


def drawn(rock: float | None = None, **hand) -> ParameterSample:
    """A draw with another strength of rock, and entries of the hand by section."""
    surfaces = {} if rock is None else {"rock": {"shear_limit": entry(rock, "N")}}
    return own_draw({"hand": hand, "surfaces": surfaces})


def radii(middle: float, distal: float) -> dict[str, object]:
    return {"pulley_radii": entry([0.0055, middle, distal], "m")}


def seat(contact: float) -> dict[str, object]:
    return {"seated_contact": entry(contact, "m")}


FEW = (
    drawn(50.0, finger=radii(0.0031, 0.0025)),
    drawn(70.0, finger=radii(0.0028, 0.0022), tile={"contact_stiffness": entry(5e3, "N/m")}),
    drawn(90.0, finger=seat(0.0239)),
    drawn(110.0, tile={"engagement": entry([0.14, 0.18, 0.2], "1")}),
)

STRENGTHS = tuple(drawn(strength) for strength in (40.0, 65.0, 80.0, 55.0))


def asked_of(name: str, **kwargs) -> Question:
    """A bundled stance, and its load factor's spread."""
    return replace(
        question(read_request(name)), want=frozenset(["spread", "load_factor"]), **kwargs
    )
