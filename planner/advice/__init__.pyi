from .advising import add_advice as add_advice, advise as advise
from .changes import HAND_PATH as HAND_PATH, changed as changed, hand_path as hand_path
from .trials import Attempt as Attempt, StanceTrial as StanceTrial
