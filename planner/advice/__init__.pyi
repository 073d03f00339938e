from .advising import advise as advise, plan as plan, with_advice as with_advice
from .changes import changed as changed
