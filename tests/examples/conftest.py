"""The service that the examples ask."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.suite.helpers.served import Served, free_endpoint


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    server = Served(free_endpoint(), "--workers", "1")
    yield server.endpoint
    server.process.kill()
    server.process.communicate()
