"""How are the project's own networks made? Worlds rendered, a network trained on them, its weights scored."""
