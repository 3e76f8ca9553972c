"""How is what takes long answered? In processes beside the server, for a time."""
