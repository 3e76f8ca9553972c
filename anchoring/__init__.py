"""Which car is which? From vision objects, which come and go, to car symbols, which stay."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
