"""How do the engines hang together, and what do their streams become? Processes in a graph, and rows of the log."""
