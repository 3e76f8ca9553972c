"""Roads and cameras: where things are on the ground and on the road network."""
