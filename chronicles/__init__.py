"""Chronicles: which patterns of events, with time constraints between them, occur in a stream?

`load` reads chronicle texts, `Recogniser` finds their occurrences as events come, `recognise` in a stored list.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
