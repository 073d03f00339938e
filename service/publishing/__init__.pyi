from .published_stream import PublishedStream as PublishedStream
from .published_wrenches import (
    PublishedWrench as PublishedWrench,
    PublishedWrenches as PublishedWrenches,
)
