"""Which scenarios look like overtaking and are not? Following, meeting, passing a parked car, changing lanes."""
