from .client import CruxClient as CruxClient
from .config import (
    SESSION_MODES as SESSION_MODES,
    closed as closed,
    ended_in_time as ended_in_time,
    exposed as exposed,
    listening as listening,
    open_session as open_session,
    start_zenoh_log as start_zenoh_log,
    zenoh_config as zenoh_config,
)
from .monitor import JsonLines as JsonLines, LogThread as LogThread
from .player import climb_set_points as climb_set_points, play as play
from .server import PlanService as PlanService, service_keys as service_keys
from .settings import SERVING_SETTINGS as SERVING_SETTINGS
