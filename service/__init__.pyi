from .replies import SetPointsRequest as SetPointsRequest, StreamRequest as StreamRequest
from .requests import (
    BodySpaceRequest as BodySpaceRequest,
    PlanRequest as PlanRequest,
    WrenchSpaceRequest as WrenchSpaceRequest,
)
from .serving import CruxClient as CruxClient
