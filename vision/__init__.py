"""Which objects are in this frame, and which is which in the next? From timed video frames to tracked objects."""
