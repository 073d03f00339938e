from .body_space import (
    COMPONENTS as COMPONENTS,
    OTHERS as OTHERS,
    BodySection as BodySection,
    BodySpace as BodySpace,
    End as End,
)
from .measurements import (
    MeasurementStudy as MeasurementStudy,
    measured as measured,
    widths as widths,
)
from .polygon import Polygon as Polygon, SupportPoint as SupportPoint, enclose as enclose
from .wrist_survey import Survey as Survey, survey as survey
