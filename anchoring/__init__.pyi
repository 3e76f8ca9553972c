# What `from anchoring import ...` offers: `__init__.py` reads the names and their modules from here.
from .anchorer import Anchorer as Anchorer
from .errors import AnchoringError as AnchoringError
from .observations import (
    Cars as Cars,
    Level as Level,
    LinkChange as LinkChange,
    Observations as Observations,
)
from .settings import AnchoringSettings as AnchoringSettings
