"""How do cars and places stand to each other, and when did that change? Qualitative relations as change events."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
