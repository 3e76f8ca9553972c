"""Which scenario has several junctions and parked cars? Six junctions of a town."""
