# What `from data_gen import ...` offers: `__init__.py` reads the names and their modules from here.
from .errors import DataGenError as DataGenError
from .scenario import Scenario as Scenario
from .scenarios.catalogue import scenario_named as scenario_named
from .outputs.scene import generate as generate
from .simulation.simulate import simulate as simulate
from .outputs.stills import draw_stills as draw_stills
from .outputs.trajectories import disturb as disturb
