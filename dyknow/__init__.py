"""How do samples get from one engine to the next? By labelled streams, policies and processes."""
