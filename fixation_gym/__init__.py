"""Gaze fixation for robots: distance and obstacles from one's own motion, as Gymnasium environments."""
