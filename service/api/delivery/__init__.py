"""How do others hear of events as they come? By a stream that they open, or by posts to them."""
