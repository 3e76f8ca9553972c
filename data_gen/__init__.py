"""What would a road look like, and what really happened on it? Simulated traffic, drawn as video, with exact truth."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
