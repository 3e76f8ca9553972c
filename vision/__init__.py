"""Which objects are in this frame, and which is which in the next? From timed video frames to tracked objects."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
