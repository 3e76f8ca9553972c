"""How does what a camera sends now become a recording, and its recording a run?"""
