"""Who breaks the rules? Monitors over the cars and relations of a run."""
