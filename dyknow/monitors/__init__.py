"""Which objects broke, or kept, what named formulas ask of them? Formulas run for every object of a sort."""
