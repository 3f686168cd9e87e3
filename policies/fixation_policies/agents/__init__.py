"""Trained agents that come with the package; README.md here says how they were made."""
