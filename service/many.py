"""Keep imports from the former place of `service.processes` working."""

from service.processes import Planners, plan_many

__all__ = ["Planners", "plan_many"]
