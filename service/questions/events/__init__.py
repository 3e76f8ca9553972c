"""Which events of a log does somebody ask for? Pages of them, counts, and what to know when nothing is found."""
