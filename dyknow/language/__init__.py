"""How is a text language read, and how are its mistakes told? What all our languages share."""
