"""How does the traffic move? SUMO inside the process, and what it does not do by itself."""
