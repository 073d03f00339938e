"""Where `service.serving` was before: an import of old keeps working."""

from service.serving import zenoh_config

__all__ = ["zenoh_config"]
