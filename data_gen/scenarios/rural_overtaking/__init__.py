"""A straight two-way rural road where fast cars overtake slow ones through the oncoming lane."""
