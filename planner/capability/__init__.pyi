from .body_space import COMPONENTS as COMPONENTS
from .body_space import BodySpace as BodySpace
from .body_space import End as End
from .body_space import Section as Section
from .polygon import Polygon as Polygon
from .wrist_survey import Survey as Survey
from .wrist_survey import survey as survey
