from .many import Answered as Answered, Planners as Planners, plan_many as plan_many, worth as worth
