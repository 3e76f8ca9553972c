"""Which detection is which object of a moment ago? Prediction, assignment and the life of tracks."""
