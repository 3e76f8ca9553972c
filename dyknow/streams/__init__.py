"""How do samples get from one process to the next? Streams, processes and what is told of them."""
