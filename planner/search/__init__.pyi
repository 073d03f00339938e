from .certify import climb_certificate as climb_certificate
from .found import Found as Found, Proof as Proof
from .lifts import Ground as Ground, Lifts as Lifts
from .programs import Programs as Programs, SolvedStates as SolvedStates
from .searching import (
    SearchMemory as SearchMemory,
    SearchProgress as SearchProgress,
    search as search,
)
from .settings import SEARCH_SETTINGS as SEARCH_SETTINGS, SearchSettings as SearchSettings
from .wall import Ends as Ends, State as State, Wall as Wall
from .ways import Arc as Arc
