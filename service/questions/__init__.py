"""What can be asked of a log? Its events, what was seen, and what chronicles find in that: why, and why not."""
