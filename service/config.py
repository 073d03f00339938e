"""Keep imports from the former place of `service.serving` working."""

from service.serving import zenoh_config

__all__ = ["zenoh_config"]
