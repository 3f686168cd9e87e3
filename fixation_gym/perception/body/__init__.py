"""The target's body: its centre, its size, how to grasp it."""
