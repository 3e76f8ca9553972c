"""Event by event: partial instances, hypotheses, checkpoints."""
