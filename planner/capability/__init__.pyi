from .body_space import (
    COMPONENTS as COMPONENTS,
    BodySpace as BodySpace,
    End as End,
    Section as Section,
)
from .polygon import Polygon as Polygon
from .wrist_survey import Survey as Survey, survey as survey
