"""The simulated robot and its task, behind the Gymnasium interface."""
