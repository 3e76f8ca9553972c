"""Did what should hold over time hold? Metric temporal logic over states, answered in three values."""
