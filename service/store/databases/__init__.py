"""Where may an event log lie, and what differs from place to place?"""
