"""What is in front of the fixated target: the zero-flow test, its map and its memory."""
