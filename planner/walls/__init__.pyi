from .assembly import assemble_wall as assemble_wall
from .bodies import BodyPoses as BodyPoses, body_poses as body_poses
from .files import (
    read_wall as read_wall,
    robot_digest as robot_digest,
    wall_digest as wall_digest,
    write_wall as write_wall,
)
from .grids import BodyGrid as BodyGrid, PlaceGrid as PlaceGrid
from .making import (
    Ask as Ask,
    MadeWall as MadeWall,
    WallProgress as WallProgress,
    WallSource as WallSource,
    wall_of as wall_of,
)
from .places import (
    HandPlace as HandPlace,
    best_places as best_places,
    hand_at as hand_at,
    palms_apart as palms_apart,
    place_trials as place_trials,
)
from .refining import finer_about as finer_about
