"""How do samples get from one engine to the next? By labelled streams, policies and processes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
