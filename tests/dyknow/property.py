"""How property tests run: the same examples every time, without a time limit."""

from hypothesis import settings

PROPERTY = settings(max_examples=100, derandomize=True, deadline=None)
