"""Where the target is in an image."""
