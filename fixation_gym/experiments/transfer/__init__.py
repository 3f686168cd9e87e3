"""Trained where things are plain, tested where they look otherwise."""
