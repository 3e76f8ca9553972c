"""DyKnow: labelled streams, policies and processes that carry samples between engines."""
