"""Which vehicles are in this frame? From cells that changed to boxes on the ground."""
