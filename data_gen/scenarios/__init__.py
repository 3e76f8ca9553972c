"""The shipped scenarios, one folder each: a network, its sources and the traffic on it."""
