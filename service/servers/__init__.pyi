from .asking import HOW_TO_START as HOW_TO_START, Asker as Asker, Parts as Parts
from .kept_streams import KeptStreams as KeptStreams
from .live_servers import LiveServers as LiveServers
from .topology import rivals_in_words as rivals_in_words, token_ids as token_ids
