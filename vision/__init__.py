"""Vision: from timed video frames to tracked objects on the ground."""
