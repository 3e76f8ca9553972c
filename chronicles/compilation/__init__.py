"""From the tree of a chronicle to the plan that every executor reads."""
