from .hold_trials import RockTrials as RockTrials, try_everywhere as try_everywhere
from .many import Answered as Answered, Planners as Planners, plan_many as plan_many, worth as worth
