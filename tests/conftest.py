"""Puts this folder on the path, for the helpers that the tests and benchmarks share."""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")
