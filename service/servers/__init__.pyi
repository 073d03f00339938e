from .absence import (
    HOW_TO_START as HOW_TO_START,
    silence_in_words as silence_in_words,
    why_absent as why_absent,
)
from .asking import Asker as Asker, Parts as Parts
from .kept_streams import KeptStreams as KeptStreams
from .live_servers import LiveServers as LiveServers
from .opening import first_line as first_line, open_session as open_session
from .topology import rivals_in_words as rivals_in_words, token_ids as token_ids
