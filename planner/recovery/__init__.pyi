from .recovery import Recovered as Recovered, Recovery as Recovery
