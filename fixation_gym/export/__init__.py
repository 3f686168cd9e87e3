"""Recorded episodes as data sets for other libraries: run, keep each episode, write the set."""
