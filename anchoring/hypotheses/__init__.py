"""What must hold for a link, and is it still believed? Conditions, hypotheses and their history."""
