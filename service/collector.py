"""How often does Python look for garbage in circles? Seldom: what we make is mostly kept, or gone by itself.

By default it looks at every 700 new objects: a tenth of a second of each start goes into that, and half of the time of
a question about 100,000 events.
"""

import gc

_NEW_OBJECTS = 50_000


def look_seldom() -> None:
    """Let the collector of this process look at every 50,000 new objects."""
    gc.set_threshold(_NEW_OBJECTS)
