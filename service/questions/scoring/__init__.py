"""How good is a log, or a file of tracks? Its events, cars and detections against the truth of the same scene."""
