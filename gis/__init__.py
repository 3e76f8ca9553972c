"""Where is it on the ground, on which road, and how far along? Roads and cameras."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
