from .hand_supports import HandParts as HandParts, WorldHands as WorldHands
from .learning import Learnt as Learnt, learn as learn
from .ranking import Screened as Screened, screen as screen
from .settings import (
    SCREENING_SETTINGS as SCREENING_SETTINGS,
    ScreeningSettings as ScreeningSettings,
)
from .stance_programs import SolvedStance as SolvedStance, solve_stance as solve_stance
from .table import ScreeningTable as ScreeningTable, StanceIndices as StanceIndices
