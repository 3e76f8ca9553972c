"""Which vehicles are in one blob? Those of lanes, and bodies with a height."""
