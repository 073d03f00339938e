"""Where `service.wire` was before: an import of old keeps working."""

from service.wire import NoServiceError, ServiceError, ServiceTimeout

__all__ = ["NoServiceError", "ServiceError", "ServiceTimeout"]
