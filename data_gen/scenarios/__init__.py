"""What traffic can be generated? The shipped scenarios, one folder each: a network, its sources, its traffic."""
