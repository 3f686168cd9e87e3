"""Recordings of cameras that moved: readers of several layouts, and a writer of the project's own."""
