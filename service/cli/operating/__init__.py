"""Commands that serve a log, and look after an installation and who may ask it."""
