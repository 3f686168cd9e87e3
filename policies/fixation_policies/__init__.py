"""Policies for the fixation-gym environments."""
