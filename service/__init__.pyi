# What `from service import ...` offers: `__init__.py` reads the names and their modules from here.
from .errors import ServiceError as ServiceError
from .questions.events.queries import (
    EventFilter as EventFilter,
    decode_event as decode_event,
    iterate_events as iterate_events,
)
from .store.log import open_log as open_log
