from .differences import Difference as Difference
from .reading import Recorded as Recorded, Recording as Recording
from .recorder import Exchange as Exchange, Recorder as Recorder, RosSample as RosSample
from .replaying import Moved as Moved, Replay as Replay
