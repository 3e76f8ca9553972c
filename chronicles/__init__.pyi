# What `from chronicles import ...` offers: `__init__.py` reads the names and their modules from here.
from . import library as library
from .chronicle_set import (
    ChronicleSet as ChronicleSet,
    check_texts as check_texts,
    load as load,
    load_texts as load_texts,
)
from .errors import ChronicleError as ChronicleError
from .events import (
    Event as Event,
    ExpectedEvent as ExpectedEvent,
    Occurrence as Occurrence,
    PartialInstance as PartialInstance,
)
from .execution.stored.columns import EventColumns as EventColumns
from .execution.unfit_events import (
    UnfitCounter as UnfitCounter,
    UnfitEvents as UnfitEvents,
    unfit_events as unfit_events,
)
from .explanation.json_form import to_json as to_json
from .explanation.rendering import render as render
from .explanation.why import why as why
from .explanation.why_not import why_not as why_not
from .recogniser import Recogniser as Recogniser, recognise as recognise
