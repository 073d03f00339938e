"""Settings of all tests, and what tests of different packages need."""

import json
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


@pytest.fixture
def stance_file(tmp_path: Path):
    """Writes a request to a file, and returns its path."""

    def write(request: object, name: str = "stance.json") -> str:
        path = tmp_path / name
        path.write_text(request if isinstance(request, str) else json.dumps(request))
        return str(path)

    return write
