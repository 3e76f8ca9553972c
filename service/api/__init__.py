"""How is an event log asked over HTTP?"""
