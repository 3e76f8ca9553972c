"""Which questions does the HTTP interface answer? One module for each thing that is asked about; `wiring` joins them.

Routes are plain functions run in worker threads: the database is asked and the answer put together there, off the
event loop.
"""
