"""Where `service.processes` was before: an import of old keeps working."""

from service.processes import Planners, plan_many

__all__ = ["Planners", "plan_many"]
