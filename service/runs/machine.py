"""What does a process of ours take of its machine? The cores that are its own, and a collector that seldom looks."""

import gc
import os

_NEW_OBJECTS = 50_000


def look_seldom() -> None:
    """Let Python look for garbage in circles at every 50,000 new objects, not at every 700.

    What we make is mostly kept, or gone by itself: to look through it costs a tenth of a second at each start, and half
    of the time of a question about 100,000 events.
    """
    gc.set_threshold(_NEW_OBJECTS)


def cores() -> int:
    """Count the processor's cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
