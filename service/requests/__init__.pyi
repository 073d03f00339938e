from .climb import (
    CancelRequest as CancelRequest,
    ClimbEnd as ClimbEnd,
    ClimbRequest as ClimbRequest,
    EndHand as EndHand,
)
from .holds import (
    Cylinder as Cylinder,
    Edge as Edge,
    Ellipsoid as Ellipsoid,
    Hold as Hold,
    Mesh as Mesh,
    Plane as Plane,
    Profile as Profile,
    Rock as Rock,
    RockReference as RockReference,
    Sphere as Sphere,
    Surface as Surface,
)
from .questions import (
    Axis as Axis,
    BodySpaceRequest as BodySpaceRequest,
    DiagnosisRequest as DiagnosisRequest,
    Draw as Draw,
    Move as Move,
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
    Pose as Pose,
    Query as Query,
    ReplyBytes as ReplyBytes,
    Request as Request,
    Wrench as Wrench,
)
from .stance import Hand as Hand, Place as Place, Stance as Stance
from .streams import (
    LostTiles as LostTiles,
    SetPointsRequest as SetPointsRequest,
    StreamRequest as StreamRequest,
    WrenchRequest as WrenchRequest,
)
