from .recovery import Recovered as Recovered, Recovery as Recovery
from .redundancy import find_redundancy as find_redundancy
