# What `from dyknow import ...` offers: `__init__.py` reads the names and their modules from here.
from .errors import (
    DyKnowError as DyKnowError,
    FormulaError as FormulaError,
    KplError as KplError,
    PolicyError as PolicyError,
)
from .streams.graph import to_dot as to_dot, to_mermaid as to_mermaid
from .kpl.checks import check_kpl as check_kpl
from .kpl.loader import load_kpl as load_kpl
from .kpl.policies import parse_policy as parse_policy
from .kpl.printer import print_kpl as print_kpl
from .mtl.monitors import Monitors as Monitors
from .mtl.kinds import Kind as Kind, Signature as Signature
from .mtl.parser import parse_formula as parse_formula, parse_monitors as parse_monitors
from .mtl.progression.progressor import Progressor as Progressor
from .mtl.progression.shared_work import SharedWork as SharedWork
from .mtl.progression.states import DictState as DictState, Verdict as Verdict
from .node import Node as Node
from .policies.policy import (
    AnyChange as AnyChange,
    AnyUpdate as AnyUpdate,
    Approximation as Approximation,
    Order as Order,
    Policy as Policy,
    SampleEvery as SampleEvery,
)
from .policies.policy_pipeline import PolicyPipeline as PolicyPipeline
from .policies.synchroniser import Synchroniser as Synchroniser
from .registry import Registry as Registry
from .sample import NO_VALUE as NO_VALUE, NOT_YET as NOT_YET, Sample as Sample
from .streams.stream import StreamGenerator as StreamGenerator
from .streams.testing import samples_of as samples_of, under as under
