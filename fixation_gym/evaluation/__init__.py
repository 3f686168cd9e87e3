"""Rollouts, their statistics and their files. Nothing here imports the simulator until an episode starts."""
