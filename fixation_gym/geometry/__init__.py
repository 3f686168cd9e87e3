"""Cameras, rigid motions, twists and the interaction matrix: pure NumPy, no simulator."""
