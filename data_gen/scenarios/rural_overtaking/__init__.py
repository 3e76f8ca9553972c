"""Which scenario has many overtakes? A straight two-way rural road, where they lead through the oncoming lane."""
