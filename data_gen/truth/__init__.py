"""What really happened? Events told from the simulator's state alone."""
