"""Why was a chronicle recognised, and why was it not? `why.py` and `why_not.py` answer; nothing here keeps state."""
