"""Where are the roads, and how are they joined? Networks of lanes, read from files and followed."""
