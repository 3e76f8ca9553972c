"""Which samples does a subscriber get, and what holds at one time? Policies, sampling and states."""
