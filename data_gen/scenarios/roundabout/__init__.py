"""Which scenario bends every path? A roundabout of one lane with four arms."""
