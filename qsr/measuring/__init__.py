"""How do objects lie to each other at one time? Quantities of pairs, as arrays."""
