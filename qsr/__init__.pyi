# What `from qsr import ...` offers: `__init__.py` reads the names and their modules from here.
from .changes.crossings import RelationChange as RelationChange
from .changes.line_up import Seen as Seen
from .errors import QsrError as QsrError
from .measuring.footprints import Footprints as Footprints
from .observer import RelationObserver as RelationObserver
from .settings import RelationSettings as RelationSettings
