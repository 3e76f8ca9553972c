"""Which choices of events are looked at, in which text and which events, and how near do they come?"""
