"""Robots: URDF parsing, kinematics, statics and inverse kinematics of the limbs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
