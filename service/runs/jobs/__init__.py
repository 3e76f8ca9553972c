"""Who processes what was queued? Workers on any machine that reaches the log."""
