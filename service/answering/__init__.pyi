from .advice_requests import advised as advised, rewritten as rewritten
from .answers import Planned as Planned
from .body_space import explore as explore
from .climbs import (
    SoughtClimb as SoughtClimb,
    answer_climb as answer_climb,
    climb_reply as climb_reply,
    seek_climb as seek_climb,
)
from .dispatch import (
    ADVICE_TIME as ADVICE_TIME,
    SERVICES_BY_NAME as SERVICES_BY_NAME,
    answer_plan as answer_plan,
    answer_with_advice as answer_with_advice,
    handle as handle,
    planned as planned,
)
from .hand_spaces import answer_wrench_space as answer_wrench_space
from .mesh_files import MeshFiles as MeshFiles
from .own_models import (
    Robots as Robots,
    builder_of as builder_of,
    read_draws as read_draws,
    read_hand as read_hand,
    read_robot as read_robot,
    robots_of as robots_of,
    with_hand as with_hand,
    with_robot as with_robot,
)
from .questions import (
    pose_of_request as pose_of_request,
    question as question,
    route_of as route_of,
    route_request as route_request,
    stage_request as stage_request,
)
from .slips import answer_diagnosis as answer_diagnosis
from .stances import stance as stance
from .streams import Streams as Streams, opened as opened, set_points_reply as set_points_reply
