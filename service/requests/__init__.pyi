from .climb import (
    CancelRequest as CancelRequest,
    ClimbEnd as ClimbEnd,
    ClimbRequest as ClimbRequest,
    EndHand as EndHand,
)
from .holds import (
    CylinderMessage as CylinderMessage,
    EdgeMessage as EdgeMessage,
    EllipsoidMessage as EllipsoidMessage,
    Hold as Hold,
    MeshMessage as MeshMessage,
    PlaneMessage as PlaneMessage,
    ProfileMessage as ProfileMessage,
    Rock as Rock,
    RockReference as RockReference,
    SphereMessage as SphereMessage,
    SurfaceMessage as SurfaceMessage,
)
from .questions import (
    Axis as Axis,
    BodySpaceRequest as BodySpaceRequest,
    DiagnosisRequest as DiagnosisRequest,
    Draw as Draw,
    MoveMessage as MoveMessage,
    PlanRequest as PlanRequest,
    PlanWant as PlanWant,
    RouteRequest as RouteRequest,
    SpaceWant as SpaceWant,
    WrenchSpaceRequest as WrenchSpaceRequest,
)
from .request import (
    DEFAULT_DEADLINE as DEFAULT_DEADLINE,
    LEAST_REPLY_BYTES as LEAST_REPLY_BYTES,
    LONGEST_DEADLINE as LONGEST_DEADLINE,
    Detail as Detail,
    Identifier as Identifier,
    InParts as InParts,
    Later as Later,
    PoseMessage as PoseMessage,
    Query as Query,
    ReplyBytes as ReplyBytes,
    Request as Request,
    Wrench as Wrench,
)
from .stance import Hand as Hand, Place as Place, StanceMessage as StanceMessage
from .streams import (
    LostTiles as LostTiles,
    SetPointsRequest as SetPointsRequest,
    StreamRequest as StreamRequest,
    WrenchRequest as WrenchRequest,
)
