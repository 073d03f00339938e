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
from .limits import (
    AxisForce as AxisForce,
    ForceCap as ForceCap,
    Limits as Limits,
    Load as Load,
)
from .plan import PlanRequest as PlanRequest, Want as Want
from .request import (
    DEFAULT_DEADLINE as DEFAULT_DEADLINE,
    LONGEST_DEADLINE as LONGEST_DEADLINE,
    Detail as Detail,
    Identifier as Identifier,
    Name as Name,
    Pose as Pose,
    Query as Query,
    Request as Request,
    Wrench as Wrench,
)
from .route import RouteRequest as RouteRequest
from .spaces import (
    Axis as Axis,
    BodySpaceRequest as BodySpaceRequest,
    SpaceWant as SpaceWant,
    WrenchSpaceRequest as WrenchSpaceRequest,
)
from .stance import Grasp as Grasp, Hand as Hand, Place as Place, Stance as Stance
from .stream import SetPointsRequest as SetPointsRequest, StreamRequest as StreamRequest
