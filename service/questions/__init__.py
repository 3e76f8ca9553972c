"""What can be asked of a log? Events, why and why not, and chronicles of one's own."""
