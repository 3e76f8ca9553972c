"""What did a run see, and when did it look? Its cars and who they were, its roads, and the relations among its cars."""
