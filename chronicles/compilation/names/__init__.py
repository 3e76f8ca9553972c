"""What do the names of some texts stand for? Declarations, domains, patterns and variables."""
