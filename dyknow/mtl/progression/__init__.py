"""What is left of a formula after each state? From templates over residuals to tables and automata."""
