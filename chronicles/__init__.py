"""Chronicles: which patterns of events, with time constraints between them, occur in a stream?

`load` reads chronicle texts, `Recogniser` finds their occurrences as events come, `recognise` in a stored list.
"""

from chronicles.chronicle_set import ChronicleSet, check_texts, load, load_texts
from chronicles.errors import ChronicleError
from chronicles.events import Event, ExpectedEvent, Occurrence, PartialInstance, TimedOut
from chronicles.execution.columns import EventColumns
from chronicles.recogniser import Recogniser
from chronicles.recognition import recognise

__all__ = [
    "ChronicleError",
    "ChronicleSet",
    "Event",
    "EventColumns",
    "ExpectedEvent",
    "Occurrence",
    "PartialInstance",
    "Recogniser",
    "TimedOut",
    "check_texts",
    "load",
    "load_texts",
    "recognise",
]
