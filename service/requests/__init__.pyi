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
from .questions import (
    Axis as Axis,
    BodySpaceRequest as BodySpaceRequest,
    PlanRequest as PlanRequest,
    RouteRequest as RouteRequest,
    SetPointsRequest as SetPointsRequest,
    SpaceWant as SpaceWant,
    StreamRequest as StreamRequest,
    Want as Want,
    WrenchSpaceRequest as WrenchSpaceRequest,
    about_the_same as about_the_same,
)
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
from .stance import Grasp as Grasp, Hand as Hand, Place as Place, Stance as Stance
