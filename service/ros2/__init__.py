"""Services and topics of ROS 2 over zenoh, by rmw_zenoh's convention and without ROS."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
