from .replies import SetPointsRequest as SetPointsRequest
from .replies import StreamRequest as StreamRequest
from .requests import BodySpaceRequest as BodySpaceRequest
from .requests import PlanRequest as PlanRequest
from .requests import WrenchSpaceRequest as WrenchSpaceRequest
from .serving import CruxClient as CruxClient
