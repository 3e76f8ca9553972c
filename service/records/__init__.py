"""What do events, cars, links, relation changes, streams and runs look like at the edge of the service?

The event log, the HTTP routes and the exports all speak in these structs. What the pipeline writes has no
sequence number yet (`EventDraft`); what comes out of the log has one (`EventRecord`) and never changes afterwards.
Times are integer microseconds of media time, counted from the start of the source; `start` and `end` repeat them on
the UTC calendar. Positions are metres, x east, y north.
"""
