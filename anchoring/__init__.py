"""Which car is which? From vision objects, which come and go, to car symbols, which stay."""
