"""Make a request for a climb of what is given as text: ends, grids, and how good it has to be."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec

from hand_models.base import InvalidInputError, errors_under
from hand_models.hand import WristTravel
from planner import BodyGrid, PlaceGrid
from service import requests, wire
from service.climbs.rocks import rock_message

__all__ = ["Sought", "climb_end", "demo_request", "part_of_whole"]


class Sought(NamedTuple):
    """Options of a climb that is searched for: its ends, the grids, and how good it has to be."""

    start: str
    goal: str
    radius: float | None
    best_within: str
    at_least: float | None
    time: float | None
    refine: int
    surface: str
    spacing: float | None
    body_spacing: float | None
    stand_off: tuple[float, ...]
    lean: float
    wrist: Literal["fixed", "compliant"] | None
    wrist_travel: tuple[float, float, float] | None

    def asking(
        self, read: Callable[[str], requests.PlanRequest]
    ) -> Callable[[Path], requests.ClimbRequest]:
        """Return the function that returns the request for a climb on a rock.

        Parameters
        ----------
        read : callable
            Reads a stance of a name.

        Raises
        ------
        InvalidInputError
            If an option is impossible, whatever the rock; of a grid, with its field.
        """
        if self.radius is not None and not any("," in end for end in (self.start, self.goal)):
            raise InvalidInputError(
                "is about a point x,y,z: give --from or --to as one, or leave it out",
                field="--radius",
            )
        places: dict[str, Any] = {} if self.spacing is None else {"spacing": self.spacing}
        bodies: dict[str, Any] = {}
        if self.body_spacing is not None:
            bodies["spacing"] = self.body_spacing
        if self.stand_off:
            bodies["stand_offs"] = self.stand_off
        with errors_under("places"):
            place_grid = PlaceGrid(**places)
        with errors_under("bodies"):
            body_grid = BodyGrid(**bodies)
        travel = None
        if self.wrist_travel is not None:
            with errors_under("wrist_travel"):
                travel = WristTravel(*self.wrist_travel)
        request = partial(
            requests.ClimbRequest,
            v=1,
            surface=self.surface,
            places=place_grid,
            bodies=body_grid,
            best_within=part_of_whole(self.best_within, "--best-within"),
            at_least=self.at_least,
            time=self.time,
            refine=self.refine,
            start=climb_end(self.start, "--from", self.radius, read),
            goal=climb_end(self.goal, "--to", self.radius, read),
            wrist=self.wrist or "fixed",
            wrist_travel=travel,
        )
        return lambda rock: request(name=rock.stem, rock=rock_message(rock, self.lean))


def demo_request() -> requests.ClimbRequest:
    """Return the request for a climb on the bundled wall of large knobs."""
    file = resources.files("service") / "examples" / "climbs" / "knob-wall.json"
    return wire.decode_request(file.read_bytes(), requests.ClimbRequest)


def climb_end(
    text: str,
    field: str,
    radius: float | None,
    read: Callable[[str], requests.PlanRequest],
) -> requests.ClimbEnd:
    """Return an end of a climb from ``x,y,z``, ``height:Z``, or a stance.

    Parameters
    ----------
    text : str
    field : str
        Option that has the text.
    radius : float or None
        Distance of the body from a point; 0.3 by default [m].
    read : callable
        Reads a stance of which the text is the name.

    Raises
    ------
    InvalidInputError
        If the text is none of the three.
    """
    head, colon, rest = text.partition(":")
    try:
        if head == "height" and colon:
            return requests.ClimbEnd(height=_number(rest))
        if "," in text:
            numbers = [_number(each) for each in text.split(",")]
            if len(numbers) != 3:
                raise InvalidInputError(f"must be three numbers x,y,z, got {text!r}", field=field)
            x, y, z = numbers
            end = requests.ClimbEnd(near=(x, y, z))
            return end if radius is None else msgspec.structs.replace(end, radius=radius)
    except (ValueError, msgspec.ValidationError):
        raise InvalidInputError(
            f"must be x,y,z or height:Z in finite metres, or a stance, got {text!r}", field=field
        ) from None
    try:
        stance = read(text).stance
    except InvalidInputError as error:
        # the reader names the argument of other commands
        error.field = field if error.field == "STANCE" else f"{field}: {error.field}"
        raise
    hands = []
    for i, hand in enumerate(stance.hands):
        if hand.pose is None:
            raise InvalidInputError(
                f"{text}: a stance of a climb needs the pose of each hand",
                field=f"{field}: hands[{i}].pose",
            )
        hands.append(requests.EndHand(limb=hand.limb, pose=hand.pose, grasp=hand.grasp))
    return requests.ClimbEnd(body=stance.body, hands=hands)


def part_of_whole(text: str, field: str) -> float:
    """Return a part of a whole from ``5%`` or ``0.05``.

    Parameters
    ----------
    text : str
    field : str
        Option that has the text.

    Raises
    ------
    InvalidInputError
        If the text is no such part, from 0 to 10.
    """
    try:
        found = _number(text.removesuffix("%")) * (0.01 if text.endswith("%") else 1.0)
    except ValueError:
        found = -1.0
    if not 0.0 <= found <= 10.0:
        raise InvalidInputError(f"must be a part such as 5% or 0.05, got {text!r}", field=field)
    return found


def _number(text: str) -> float:
    found = float(text)
    if not abs(found) <= 1e6:
        raise ValueError(text)
    return found
