"""How does the traffic move? SUMO inside the process, and what it does not do by itself."""

import os

# Else it warns of an installed pyarrow, into what commands print.
os.environ.setdefault("LIBSUMO_AS_TRACI", "quiet")
