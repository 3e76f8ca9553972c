"""Which streams shall a node have? KPL, the language in which sources, units, streams and policies are declared."""
