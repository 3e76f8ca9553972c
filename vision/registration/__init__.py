"""From where was this picture taken? A camera that moves, followed by what stays."""
