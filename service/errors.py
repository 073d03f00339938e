"""Keep imports from the former place of `service.wire` working."""

from service.wire import NoServiceError, ServiceError, ServiceTimeout

__all__ = ["NoServiceError", "ServiceError", "ServiceTimeout"]
