from .followed_streams import FollowedStreams as FollowedStreams
from .live_plan import LivePlan as LivePlan
from .live_server import LiveServer as LiveServer
from .moved_stance import MovableStance as MovableStance, StanceMoves as StanceMoves
