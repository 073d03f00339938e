from .advising import advise as advise, plan as plan, with_advice as with_advice
from .changes import HAND_PATH as HAND_PATH, changed as changed, hand_path as hand_path
