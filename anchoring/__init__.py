"""Anchoring: from vision objects, which come and go, to car symbols, which stay."""
