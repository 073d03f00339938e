"""Read the rock of a climb as a request has it: a mesh in W, or the name of a generated wall."""

from __future__ import annotations

import math
from pathlib import Path

from hand_models.base import InvalidInputError
from service import requests

__all__ = ["rock_message"]


def rock_message(rock: Path, lean: float) -> requests.MeshMessage | str:
    """Return the rock of a request.

    Parameters
    ----------
    rock : Path
        A mesh file in metres, its frame with x up the rock and z into it; or, where there is no
        such file, the name of a generated wall.
    lean : float
        Angle of a mesh's x from the vertical, away from the climber [rad].

    Raises
    ------
    InvalidInputError
        If the file cannot be read, there is neither a file nor a wall of this name, or a lean is
        given of a wall.
    """
    # completion of a command line does without numbers
    from hand_models.scans import named_wall, read_rock

    if named_wall(rock) is not None:
        if lean:
            raise InvalidInputError(
                f"is for a mesh file; {rock} has a lean of its own: leave it out, got {lean:g}",
                field="--lean",
            )
        return str(rock)
    vertices, faces, _ = read_rock(rock)
    sine, cosine = math.sin(lean), math.cos(lean)
    pose = requests.PoseMessage(
        position=(0.0, 0.0, 0.0), x_axis=(sine, 0.0, cosine), z_axis=(cosine, 0.0, -sine)
    )
    return requests.MeshMessage(vertices=vertices.tolist(), faces=faces.tolist(), pose=pose)
